"""How a species is written down: limbs, blobs and motions, the left side mirrored to the right.

Every creature is built facing +x with +y up; z = 0 is its plane of symmetry, and what is
mirrored is written for z > 0. Angles are in degrees here, and in radians everywhere else.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workers.creatures.skeleton import Capsule, Motion, Skeleton
from workers.geometry.arrays import FloatArray

Point = Sequence[float] | FloatArray

_MIRROR = np.array([1.0, 1.0, -1.0])
_SIDES = ("left", "right")
# Chosen, not measured.
_THIN = 0.4  # ratio below which a limb is a fin
_X, _Y, _Z = np.eye(3)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class SkeletonBuilder:
    """A skeleton under construction; `vary` makes individuals of a species differ."""

    def __init__(self, rng: np.random.Generator, root: Point) -> None:
        self._rng = rng
        self._names = {"root": 0}
        self._heads = [np.array(root, dtype=np.float64)]
        self._tails = [np.array(root, dtype=np.float64)]
        self._parents = [-1]
        self._parts: list[Capsule] = []
        self._motions: list[Motion] = []
        self._groups = 0

    def vary(self, value: float, spread: float = 0.1) -> float:
        """Draw one proportion of this individual.

        Parameters
        ----------
        value : float
            What the species has.
        spread : float
            Largest deviation, as a share of the value; the draw is uniform.

        Returns
        -------
        float, between value · (1 − spread) and value · (1 + spread)
        """
        return float(value * (1.0 + spread * self._rng.uniform(-1.0, 1.0)))

    def at(self, bone: str, share: float = 0.0, offset: Point = (0.0, 0.0, 0.0)) -> FloatArray:
        """Place beside a bone; beside the left one (z > 0) where the bone is mirrored.

        Parameters
        ----------
        bone : str
            Name of the bone, such as ``spine.0``.
        share : float
            How far along the bone: 0 is its head, 1 its end.
        offset : (3,) float
            Added to that place.

        Returns
        -------
        (3,) float64
        """
        number = self._resolve(bone, _SIDES[0])
        head, tail = self._heads[number], self._tails[number]
        place: FloatArray = head + share * (tail - head) + np.array(offset)
        return place

    def limb(
        self,
        name: str,
        parent: str,
        points: Sequence[Point] | FloatArray,
        radii: Sequence[float],
        *,
        mirrored: bool = False,
        flat: Point | None = None,
        ratio: float = 1.0,
        rigid: bool = False,
        softness: float = 0.3,
        jitter: float = 0.06,
    ) -> None:
        """Add a chain of bones through points, named name.0, name.1, …, with flesh around it.

        Parameters
        ----------
        name, parent : str
            Of the limb, and of the bone it hangs on. The parent of a mirrored limb is the bone of
            its own side, if there is one.
        points : p of (3,) float
            Joints from the first to the end.
        radii : p of float
            Of the flesh at the points; each is varied by ± jitter.
        mirrored : bool
            Add the same limb on the other side too.
        flat : (3,) float, optional
            Direction in which the flesh is only ratio times as thick. Below 0.4 it is a sheet with
            a round rim (fin, wing, ear), above it a limb with an ellipse as section.
        ratio : float
            Thickness along ``flat`` as a share of the thickness across it.
        rigid : bool
            Make no bones: the flesh moves with the parent.
        softness : float
            Width of the blend with other flesh, as a share of the radius.
        jitter : float
            Largest deviation of a radius, as a share.
        """
        places = np.array(points, dtype=np.float64)
        widths = [self.vary(radius, jitter) for radius in radii]
        for side in _SIDES if mirrored else ("",):
            sign = _MIRROR if side == "right" else np.ones(3)
            direction = None if flat is None else np.array(flat) * sign
            thin = ratio < _THIN
            stretch = np.eye(3) if thin else _flattened(direction, ratio)
            bone = self._resolve(parent, side)
            for i in range(len(places) - 1):
                start, end = places[i] * sign, places[i + 1] * sign
                if not rigid:
                    bone = self._add_bone(_sided(f"{name}.{i}", side), bone, start, end)
                ends = (widths[i], widths[i + 1])
                capsule = Capsule(bone, self._groups, start, end, ends, stretch, softness)
                if thin and direction is not None:
                    capsule = replace(capsule, fin=_across(direction, end - start), ratio=ratio)
                self._parts.append(replace(capsule, softness=softness * capsule.thinness))
            self._groups += 1

    def blob(
        self,
        bone: str,
        centre: Point,
        radii: Point,
        *,
        mirrored: bool = False,
        pitch: float = 0.0,
        yaw: float = 0.0,
        roll: float = 0.0,
        power: float = 2.0,
        joined: bool = False,
        softness: float = 0.3,
        jitter: float = 0.06,
    ) -> None:
        """Add an ellipsoid to a bone.

        Parameters
        ----------
        bone : str
            The bone that carries it.
        centre : (3,) float
            Its middle.
        radii : (3,) float
            Along x, y and z, before it is turned.
        mirrored : bool
            Add it on the other side too.
        pitch, yaw, roll : float
            Degrees. It is turned about x by roll, then about z by pitch (nose up), then about y by
            yaw (nose to −z).
        power : float
            2 is an ellipsoid. A high power is a box with rounded edges and these half lengths.
        joined : bool
            Do not blend it with the blob before it, so that no bulge appears between them.
        softness : float
            Width of the blend with other flesh, as a share of the radius.
        jitter : float
            Largest deviation of a radius, as a share.
        """
        half = np.array([self.vary(radius, jitter) for radius in radii])
        size = float(half.max())
        turn = _turn(_Y, np.radians(-yaw)) @ _turn(_Z, np.radians(pitch))
        turn = turn @ _turn(_X, np.radians(roll))
        stretch = np.diag(size / half) @ turn.T
        for side in _SIDES if mirrored else ("",):
            sign = _MIRROR if side == "right" else np.ones(3)
            place = np.array(centre, dtype=np.float64) * sign
            owner, shape = self._resolve(bone, side), stretch * sign
            self._groups -= joined
            capsule = Capsule(
                owner, self._groups, place, place, (size, size), shape, softness, power
            )
            self._parts.append(replace(capsule, softness=softness * capsule.thinness))
            self._groups += 1

    def joint(self, name: str, parent: str, head: Point, tail: Point) -> None:
        """Add a bone without flesh, named name.0.

        Parameters
        ----------
        name, parent : str
            Of the bone, and of the one it hangs on.
        head, tail : (3,) float
            Its ends.
        """
        start, end = np.array(head, dtype=np.float64), np.array(tail, dtype=np.float64)
        self._add_bone(f"{name}.0", self._resolve(parent, ""), start, end)

    def move(
        self,
        bones: str | Sequence[str],
        axis: Point,
        low: float,
        high: float,
        *,
        shares: Sequence[float] | None = None,
    ) -> None:
        """Let bones turn together about an axis.

        A mirrored bone stands for both sides, and each side moves on its own.

        Parameters
        ----------
        bones : str or sequence of str
            Names of the bones.
        axis : (3,) float
            Of the rotation at rest; its length does not count.
        low, high : float
            Range of the angle in degrees; 0 is the rest pose.
        shares : sequence of float, optional
            Share of the angle for each bone; 1 each by default.
        """
        names = [bones] if isinstance(bones, str) else list(bones)
        weights = np.ones(len(names)) if shares is None else np.array(shares)
        direction = np.array(axis) / np.linalg.norm(axis)
        paired = _sided(names[-1], _SIDES[0]) in self._names
        for side in _SIDES if paired else ("",):
            # an axis of rotation is mirrored as a pseudovector
            turned = -direction * _MIRROR if side == "right" else direction
            numbers = np.array([self._resolve(name, side) for name in names])
            turns = weights[:, None] * turned  # (j, 3)
            self._motions.append(Motion(numbers, turns, np.radians(low), np.radians(high)))

    def curl(self, name: str, axis: Point, low: float, high: float) -> None:
        """Let a whole limb bend about an axis; its bones share the angle evenly.

        Parameters
        ----------
        name : str
            Of the limb.
        axis : (3,) float
            Of the rotation at rest.
        low, high : float
            Range of the whole angle in degrees.
        """
        names = self._chain(name)
        self.move(names, axis, low, high, shares=[1.0 / len(names)] * len(names))

    def wave(self, name: str, axis: Point, angle: float, waves: float) -> None:
        """Let a whole limb take the form of a sine wave of any phase.

        Parameters
        ----------
        name : str
            Of the limb.
        axis : (3,) float
            Of the rotation at rest.
        angle : float
            Largest bend of one joint, in degrees.
        waves : float
            Number of waves along the limb.
        """
        names = self._chain(name)
        phase = 2.0 * np.pi * waves * np.arange(len(names)) / max(1, len(names) - 1)
        self.move(names, axis, -angle, angle, shares=np.sin(phase).tolist())
        self.move(names, axis, -angle, angle, shares=np.cos(phase).tolist())

    def skeleton(self, heading: float = 0.0, lean: float = 0.0) -> Skeleton:
        """Freeze the body, turned to where it should face.

        Parameters
        ----------
        heading : float
            Degrees: 0 faces +x, 90 faces +z.
        lean : float
            Degrees by which the back leans towards +z.

        Returns
        -------
        Skeleton
        """
        turn = _turn(_X, np.radians(lean)) @ _turn(_Y, np.radians(-heading))
        capsules = tuple(
            replace(
                capsule,
                start=turn @ capsule.start,
                end=turn @ capsule.end,
                stretch=capsule.stretch @ turn.T,
                fin=None if capsule.fin is None else turn @ capsule.fin,
            )
            for capsule in self._parts
        )
        motions = tuple(replace(motion, turns=motion.turns @ turn.T) for motion in self._motions)
        return Skeleton(np.array(self._heads) @ turn.T, np.array(self._parents), capsules, motions)

    def _add_bone(self, name: str, parent: int, head: FloatArray, tail: FloatArray) -> int:
        self._names[name] = len(self._heads)
        self._heads.append(head)
        self._tails.append(tail)
        self._parents.append(parent)
        return len(self._heads) - 1

    def _resolve(self, name: str, side: str) -> int:
        sided = _sided(name, side)
        return self._names[sided if sided in self._names else name]

    def _chain(self, name: str) -> list[str]:
        """Bones of a limb in order, by the names that `move` understands."""
        bones = [known.split("@")[0] for known in self._names]
        own = [bone for bone in bones if bone.rpartition(".")[0] == name]
        return list(dict.fromkeys(own))


def beside(place: Point, x: float, y: float, z: float) -> FloatArray:
    """Place at an offset from another.

    Parameters
    ----------
    place : (3,) float
        Where to start.
    x, y, z : float
        The offset.

    Returns
    -------
    (3,) float64
    """
    return np.asarray(place, dtype=np.float64) + np.array([x, y, z], dtype=np.float64)


def _sided(name: str, side: str) -> str:
    return f"{name}@{side}" if side else name


def _unit(vector: FloatArray) -> FloatArray:
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit


def _across(direction: FloatArray, axis: FloatArray) -> FloatArray:
    """Unit vector across an axis, as near to a direction as there is."""
    return _unit(direction - (direction @ axis) / (axis @ axis) * axis)


def _flattened(direction: FloatArray | None, ratio: float) -> FloatArray:
    """Stretch that makes spheres ratio times as thick in a direction, (3, 3)."""
    if direction is None:
        return np.eye(3)
    normal = _unit(direction)
    return np.eye(3) + (1.0 / ratio - 1.0) * np.outer(normal, normal)


def _turn(axis: FloatArray, angle: float) -> FloatArray:
    """Rotation about a unit axis by radians, (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: FloatArray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn
