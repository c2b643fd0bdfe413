"""Where the shapes of a training come from, and how one shape becomes another."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Any, TypeAlias

from workers.creatures import Creature, make_creature, make_uneven_creature
from workers.geometry.mesh import TriangleMesh
from workers.transformations import TransformedMesh, transform

STRONGEST = 5
"""Strength of a transformation on top of which a graded pose is the farthest from rest."""


@dataclass(frozen=True)
class CreatureSource:
    """A procedural creature at rest, of even triangles or of uneven ones."""

    species: str
    seed: int
    vertices: int
    uneven: bool = False

    @property
    def identity(self) -> str:
        """What seeds follow from: the individual, however it is meshed."""
        return f"{self.species}/{self.seed}"


@dataclass(frozen=True)
class StoredSource:
    """A mesh that was uploaded: the hash of its bytes, and the name of its file."""

    sha256: str
    name: str

    @property
    def identity(self) -> str:
        """What seeds follow from: the content."""
        return self.sha256


Source: TypeAlias = CreatureSource | StoredSource


@dataclass(frozen=True)
class Simulation:
    """A transformation of the shape itself, or of a pose of it.

    Attributes
    ----------
    transformation : str
        One of `workers.transformations.TRANSFORMATIONS`.
    strength : int
        1 to 5.
    seed : int
        Of the transformation.
    pose : int or None
        Seed of a creature's pose; without one the shape at rest is transformed.
    """

    transformation: str
    strength: int
    seed: int
    pose: int | None = None


Change: TypeAlias = Simulation | StoredSource
"""How a shape became another: by simulation, or as another file with the same vertex order."""


class Posing(Enum):
    """How far from rest a creature is posed before it is transformed."""

    GRADED = "graded"
    """The farther the stronger the transformation, for pairs: a kernel is learned from how much
    each strength changes."""

    FULL = "full"
    """As far as in a benchmark, for variants: decision 7. Where parts are welded, limbs touch."""


def source_from_json(document: Mapping[str, Any]) -> Source:
    """Return the source whose fields these are.

    Parameters
    ----------
    document : mapping of str
        The fields of a `CreatureSource` or a `StoredSource`.

    Returns
    -------
    CreatureSource or StoredSource
    """
    return StoredSource(**document) if "sha256" in document else CreatureSource(**document)


def change_from_json(document: Mapping[str, Any]) -> Change:
    """Return the change whose fields these are.

    Parameters
    ----------
    document : mapping of str
        The fields of a `Simulation` or a `StoredSource`.

    Returns
    -------
    Simulation or StoredSource
    """
    return StoredSource(**document) if "sha256" in document else Simulation(**document)


@lru_cache(maxsize=2)
def load_creature(source: CreatureSource) -> Creature:
    """Make the creature of a source; the last two are kept.

    Parameters
    ----------
    source : CreatureSource
        Species, seed and number of vertices.

    Returns
    -------
    Creature
        At rest, with a skeleton to be posed by.
    """
    make = make_uneven_creature if source.uneven else make_creature
    return make(source.species, seed=source.seed, vertices=source.vertices)


def simulate(
    mesh: TriangleMesh, source: Source, simulation: Simulation, *, posing: Posing
) -> TransformedMesh:
    """Transform a shape, on top of a pose if it is a creature that has one.

    Parameters
    ----------
    mesh : TriangleMesh
        The shape at rest.
    source : CreatureSource or StoredSource
        Where the shape comes from; only creatures have poses.
    simulation : Simulation
        The transformation, its strength and seeds.
    posing : Posing
        How far from rest the pose is.

    Returns
    -------
    TransformedMesh
        The mesh, and for each of its vertices the vertex of the shape that it comes from.

    Raises
    ------
    InvalidMeshError
        The transformation leaves no usable mesh.
    """
    pose = _pose(source, simulation, posing) if isinstance(source, CreatureSource) else None
    return transform(
        mesh, simulation.transformation, simulation.strength, seed=simulation.seed, pose=pose
    )


def _pose(source: CreatureSource, simulation: Simulation, posing: Posing) -> TriangleMesh | None:
    """Pose of a creature; None if the creature at rest is transformed."""
    if simulation.pose is None:
        return None
    creature = load_creature(source)
    if posing is Posing.GRADED:
        return creature.posed(simulation.pose, strength=simulation.strength / STRONGEST)
    if simulation.transformation == "topology":
        return creature.touching(simulation.pose)
    return creature.posed(simulation.pose)
