"""What a creature is before it has a surface: bones, flesh on them, and how they may move."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, read_only


@dataclass(frozen=True, eq=False)
class Capsule:
    """A tapered capsule in a space stretched by a matrix.

    Without stretch it is a round cone: all spheres along a segment whose radii run from one to
    the other. Stretched across its axis it is a fin or a wing. A stretched sphere is an ellipsoid.
    Under a norm of a high power it is a box with rounded edges.

    Attributes
    ----------
    bone : int
        The bone that carries it.
    group : int
        Parts of a group are joined sharply, groups are blended smoothly.
    start, end : (3,) float64
        Ends of the segment in rest pose; equal for a sphere.
    radii : (start, end)
        Radii at the ends.
    stretch : (3, 3) float64
        Space is stretched by it before distances are taken.
    softness : float
        Width of the blend with other groups, as a share of the radius.
    power : float
        Of the norm that distances are taken in; 2 is round.
    fin : (3,) float64, optional
        Unit normal of a fin: a flat sheet with a round rim instead of a body of revolution.
    ratio : float
        Half thickness of the fin as a share of its radius.
    least : float
        Half thickness that a fin has at least.
    """

    bone: int
    group: int
    start: FloatArray
    end: FloatArray
    radii: tuple[float, float]
    stretch: FloatArray
    softness: float
    power: float = 2.0
    fin: FloatArray | None = None
    ratio: float = 1.0
    least: float = 0.0

    @property
    def thinness(self) -> float:
        """Smallest half thickness as a share of the radius, 0 to 1 where nothing is widened."""
        return self.ratio / float(np.linalg.norm(self.stretch, ord=2))

    @property
    def reach(self) -> FloatArray:
        """Half extents of the box around a sphere of radius 1 in the stretched space, (3,)."""
        inverse = np.linalg.inv(self.stretch)
        half_extents: FloatArray = np.linalg.norm(inverse, axis=1, ord=2 if self.power == 2 else 1)
        return half_extents


@dataclass(frozen=True, eq=False)
class Motion:
    """One degree of freedom: bones that turn together, each by its share of one angle.

    Attributes
    ----------
    bones : (j,) int64
    turns : (j, 3) float64
        Axis of each bone in rest pose; its length is the bone's share of the angle.
    low, high : float
        Range of the angle in radians; 0 is the rest pose.
    """

    bones: IntArray
    turns: FloatArray
    low: float
    high: float

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "bones", read_only(self.bones, np.int64))
        object.__setattr__(self, "turns", read_only(self.turns, np.float64))


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones, capsules and motions of one individual in rest pose.

    Attributes
    ----------
    heads : (b, 3) float64
        The joint each bone turns about.
    parents : (b,) int64
        The bone each bone hangs on, which comes before it; -1 for the root, bone 0.
    capsules : tuple of Capsule
    motions : tuple of Motion
    """

    heads: FloatArray
    parents: IntArray
    capsules: tuple[Capsule, ...]
    motions: tuple[Motion, ...]

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "heads", read_only(self.heads, np.float64))
        object.__setattr__(self, "parents", read_only(self.parents, np.int64))

    def rotation_vectors(self, angles: FloatArray) -> FloatArray:
        """How each bone turns against its parent.

        Parameters
        ----------
        angles : (motions,) float64
            Angle of each motion in radians; what turns the same bone is added up.

        Returns
        -------
        (b, 3) float64: axis times radians
        """
        turns = np.zeros((self.n_bones, 3))
        for motion, angle in zip(self.motions, angles, strict=True):
            np.add.at(turns, motion.bones, angle * motion.turns)
        return turns

    @property
    def ancestry(self) -> BoolArray:
        """Whether bone i hangs on bone j, or is it, (b, b)."""
        hangs = np.eye(self.n_bones, dtype=np.bool_)
        for bone, parent in enumerate(self.parents):
            if parent >= 0:
                hangs[bone] |= hangs[parent]
        return hangs

    @property
    def n_bones(self) -> int:
        """Number of bones."""
        return len(self.parents)
