"""One individual of a species: its surface, its skin weights, and its poses."""

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workers.creatures.clearance import Clearance
from workers.creatures.implicit import evaluate, extract_surface, thickened
from workers.creatures.relaxation import relax
from workers.creatures.skeleton import Skeleton
from workers.creatures.skinning import blend, bone_motions, skin_weights
from workers.creatures.slivers import drop_slivers
from workers.creatures.species import BUILDERS
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, read_only
from workers.geometry.mesh import TriangleMesh

SPECIES: tuple[str, ...] = tuple(BUILDERS)
TRAINING_SPECIES, TESTED_SPECIES = SPECIES[0::2], SPECIES[1::2]
"""What models are learned from, and what they are tested with: no species is both."""

CREATURES_VERSION = "1"
"""Part of the key of what is stored of creatures: raised when the same seeds give other bytes."""

FEWEST_VERTICES, MOST_VERTICES = 2_000, 20_000
# Chosen, not measured.
_WIDE, _TRIES = 1.8, 20  # factor on the angles of poses in which limbs meet, and how many are tried
_ATTEMPTS = 10  # to bring limbs apart that run into each other,
_CALMER = 0.65  # each time by this factor on the angles that are to blame


@dataclass(frozen=True, eq=False)
class Creature:
    """A deformable shape of its own: all its poses share faces and vertex order.

    Attributes
    ----------
    species : str
    seed : int
        Of the individual.
    rest : TriangleMesh
        One closed surface in rest pose, wound outwards; +y is up.
    skeleton : Skeleton
    weights : (n, b) float64
        Share of each bone in the motion of each vertex.
    """

    species: str
    seed: int
    rest: TriangleMesh
    skeleton: Skeleton
    weights: FloatArray

    def __post_init__(self) -> None:
        """Freeze the weights."""
        object.__setattr__(self, "weights", read_only(self.weights, np.float64))

    @cached_property
    def _clearance(self) -> Clearance:
        return Clearance(self.skeleton)

    def posed(self, seed: int, *, strength: float = 1.0) -> TriangleMesh:
        """A pose: every motion of the species at a random angle within its range.

        Parameters
        ----------
        seed : int
            At least 0; the same seed gives the same bytes.
        strength : float
            Factor on all angles; 0 is the rest pose. Where limbs would run into each other, the
            angles that cause it are made smaller.

        Returns
        -------
        TriangleMesh
            With the faces and the vertex order of `rest`.

        Raises
        ------
        InvalidRequestError
            The seed is negative, or the strength negative or not finite.
        """
        if not (math.isfinite(strength) and strength >= 0.0):
            raise InvalidRequestError(f"strength is {strength}, at least 0 is expected")
        rng = _generator("pose", self.species, self.seed, seed)
        motions = self.skeleton.motions
        angles = strength * self._angles(rng)
        for _ in range(_ATTEMPTS):
            moved = bone_motions(self.skeleton, angles)
            guilty = self._clearance.offenders(moved)  # (b,)
            if not guilty.any():
                break
            calm = [_CALMER if guilty[motion.bones].any() else 1.0 for motion in motions]
            angles = angles * np.array(calm)
        return TriangleMesh(blend(self.rest.vertices, self.weights, moved), self.rest.faces)

    def touching(self, seed: int) -> TriangleMesh:
        """A pose in which limbs meet or run into each other, as nearly as the species can.

        Of twenty wide poses it is the one in which the most bones do. Welds are made on it.

        Parameters
        ----------
        seed : int
            At least 0; the same seed gives the same bytes.

        Returns
        -------
        TriangleMesh
            With the faces and the vertex order of `rest`.
        """
        rng = _generator("touching", self.species, self.seed, seed)
        tried = [bone_motions(self.skeleton, _WIDE * self._angles(rng)) for _ in range(_TRIES)]
        closest = max(tried, key=lambda moved: int(self._clearance.offenders(moved).sum()))
        return TriangleMesh(blend(self.rest.vertices, self.weights, closest), self.rest.faces)

    def _angles(self, rng: np.random.Generator) -> FloatArray:
        """One angle for every motion, evenly within its range."""
        motions = self.skeleton.motions
        low = np.array([motion.low for motion in motions])
        high = np.array([motion.high for motion in motions])
        angles: FloatArray = rng.uniform(low, high)
        return angles


def make_creature(species: str, *, seed: int, vertices: int = 4000) -> Creature:
    """An individual of a species; the same arguments give the same bytes.

    Parameters
    ----------
    species : str
        One of `SPECIES`.
    seed : int
        At least 0; decides on the proportions, which vary continuously within the species.
    vertices : int
        About how many vertices the surface has, 2,000 to 20,000.

    Returns
    -------
    Creature
        At rest, one closed surface, with all that is needed to pose it.

    Raises
    ------
    InvalidRequestError
        The species is unknown, or the seed or the number of vertices out of range.
    """
    if species not in BUILDERS:
        raise InvalidRequestError(
            f"the species {species!r} is unknown, expected one of {', '.join(SPECIES)}"
        )
    if not FEWEST_VERTICES <= vertices <= MOST_VERTICES:
        raise InvalidRequestError(
            f"{vertices} vertices were asked for, {FEWEST_VERTICES} to {MOST_VERTICES} are expected"
        )
    skeleton = BUILDERS[species](_generator("individual", species, seed))
    points, faces, spacing = extract_surface(skeleton.capsules, vertices)
    capsules = thickened(skeleton.capsules, spacing)
    points = relax(points, faces, lambda places: evaluate(capsules, places), spacing)
    points, faces = drop_slivers(points, faces)
    weights = skin_weights(skeleton, capsules, points, faces)
    return Creature(species, seed, TriangleMesh(points, faces), skeleton, weights)


def _generator(purpose: str, species: str, *seeds: int) -> np.random.Generator:
    """A stream of random numbers of its own for every purpose, species and seed."""
    if min(seeds) < 0:
        raise InvalidRequestError(f"the seed is {min(seeds)}, at least 0 is expected")
    name = hashlib.sha256(f"{purpose}/{species}".encode()).digest()[:8]
    return np.random.default_rng([int.from_bytes(name, "little"), *seeds])
