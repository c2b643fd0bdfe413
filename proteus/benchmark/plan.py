"""The contents of a benchmark, before any of it is made."""

import contextlib
import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from proteus.benchmark.folders import find_distractors, find_nulls, find_poses, unique_label
from proteus.benchmark.sources import CreatureMesh, MeshFile, Source, connectivity
from workers.creatures import TESTED_SPECIES
from workers.errors import InvalidRequestError, ProteusError
from workers.transformations import PAPER_TRANSFORMATIONS, STRENGTHS, TRANSFORMATIONS

Normalisation = Literal["none", "area"]
NULL = "null"
BENCHMARK_VERSION = "2"
"""Part of the manifest. Raise it when the same sources give other files."""
COMMON_AREA = 2.4
"""Area that ``area`` scales shapes to: the mean area of the built-in creatures. Kernels in raw
units that were learned on creatures then meet eigenvalues like those they were learned on."""

UNPOSED = frozenset({"scale"})
"""Transformations of the null shape itself, not of a pose. In the paper's Table 1 scale-free
kernels have 100 in the row of scale and less in that of isometry, so its scaled copies are of null
shapes."""
DISTRACTOR_SEED = 10_000
"""Seed of the first individual that is a target only."""


@dataclass(frozen=True)
class BenchmarkOptions:
    """The options of a benchmark.

    Attributes
    ----------
    nulls, poses, distractors : Path, optional
        Folders: null shapes, ``<label>/<pose>`` of the same vertex order, other shapes.
    creatures, creature_distractors : int
        Number of individuals that are query classes, and of those that are targets only.
    creature_vertices : int
        Vertices of each creature, roughly.
    transformations, strengths : tuple
        Of the queries.
    seed : int
    normalise : "none" or "area"
        Whether every shape is scaled to the same area first.
    """

    nulls: Path | None = None
    poses: Path | None = None
    distractors: Path | None = None
    creatures: int = 0
    creature_distractors: int = 0
    creature_vertices: int = 4000
    transformations: tuple[str, ...] = PAPER_TRANSFORMATIONS
    strengths: tuple[int, ...] = STRENGTHS
    seed: int = 0
    normalise: Normalisation = "none"

    def __post_init__(self) -> None:
        """Check what needs no file."""
        unknown = [name for name in self.transformations if name not in TRANSFORMATIONS]
        if unknown or not self.transformations:
            known = ", ".join(TRANSFORMATIONS)
            raise InvalidRequestError(f"transformations are {unknown}, expected some of {known}")
        if not self.strengths or not set(self.strengths) <= set(STRENGTHS):
            raise InvalidRequestError(f"strengths are {self.strengths}, expected some of 1 to 5")
        if self.nulls is None and self.creatures < 1:
            raise InvalidRequestError(
                "a benchmark needs null shapes: a folder of them or creatures"
            )
        if self.poses is not None and self.nulls is None:
            raise InvalidRequestError(
                "poses were given without the null shapes that they belong to"
            )
        if min(self.seed, self.creatures, self.creature_distractors) < 0:
            raise InvalidRequestError("the seed and the numbers of creatures must be at least 0")

    def to_json(self) -> dict[str, Any]:
        """Return the options that decide on the files, without the sources."""
        return {
            "transformations": list(self.transformations),
            "strengths": list(self.strengths),
            "seed": self.seed,
            "normalise": self.normalise,
        }


@dataclass(frozen=True)
class ShapePlan:
    """One shape of a benchmark.

    Attributes
    ----------
    label : str
        Unique in the benchmark.
    source : MeshFile or CreatureMesh
    poses : tuple of MeshFile
        Candidates; a pose with another number of vertices than the null is left out later.
    is_query : bool
        Whether transformed copies of it are queries; otherwise it is a target only.
    same_as : str
        Label of the query class whose mesh this is, in another pose; empty for most. Such a shape
        is left out: it would be a right answer that counts as wrong.
    """

    label: str
    source: Source
    poses: tuple[MeshFile, ...] = ()
    is_query: bool = True
    same_as: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return its entry in the manifest."""
        entry: dict[str, Any] = {
            "label": self.label,
            "role": "query" if self.is_query else "distractor",
            "source": self.source.to_json(),
        }
        if self.same_as:
            entry["same_as"] = self.same_as
        return entry | ({"poses": [p.to_json() for p in self.poses]} if self.poses else {})


def plan_shapes(options: BenchmarkOptions) -> tuple[ShapePlan, ...]:
    """Return the shapes of a benchmark: null shapes, creatures, and the other targets.

    Raises
    ------
    InvalidRequestError
        A folder does not hold what it should.
    """
    shapes: dict[str, ShapePlan] = {}
    for label, null in find_nulls(options.nulls).items() if options.nulls else ():
        poses = find_poses(options.poses, label, null) if options.poses else ()
        shapes[label] = ShapePlan(label, null, poses)
    for name, creature in _query_creatures(options):
        label = unique_label(name, shapes)
        shapes[label] = ShapePlan(label, creature)
    others: list[tuple[str, Source]] = []
    others += find_distractors(options.distractors) if options.distractors else []
    others += _other_creatures(options)
    known = {_connectivity(shape.source): label for label, shape in shapes.items()}
    for name, source in others:
        label = unique_label(name, shapes)
        same_as = known.get(_connectivity(source), "")
        shapes[label] = ShapePlan(label, source, is_query=False, same_as=same_as)
    return tuple(shapes.values())


def _connectivity(source: Source) -> str:
    """Return a digest of a file's connectivity; unique for a creature or an unreadable file."""
    if isinstance(source, MeshFile):
        with contextlib.suppress(ProteusError):
            return connectivity(source)
    return repr(source)


def _query_creatures(options: BenchmarkOptions) -> Iterator[tuple[str, CreatureMesh]]:
    """Iterate over individuals of distinct species, spread evenly; then over further ones."""
    total = len(TESTED_SPECIES)
    spread = min(options.creatures, total)
    for number in range(options.creatures):
        species = TESTED_SPECIES[number % spread * total // spread]
        individual = options.seed + number // spread
        yield species, CreatureMesh(species, individual, options.creature_vertices)


def _other_creatures(options: BenchmarkOptions) -> Iterator[tuple[str, CreatureMesh]]:
    """Iterate over individuals with other seeds, of species that no kernel is trained on."""
    for number in range(options.creature_distractors):
        species = TESTED_SPECIES[number % len(TESTED_SPECIES)]
        individual = DISTRACTOR_SEED + options.seed + number // len(TESTED_SPECIES)
        mesh = CreatureMesh(species, individual, options.creature_vertices)
        yield f"other-{species}", mesh


def near_twins(shapes: Sequence[ShapePlan]) -> dict[str, int]:
    """Return the species of which several individuals are query classes, with their number."""
    counts = Counter(
        shape.source.species
        for shape in shapes
        if shape.is_query and isinstance(shape.source, CreatureMesh)
    )
    return {species: count for species, count in counts.items() if count > 1}


def pose_number(transformation: str, strength: int) -> int:
    """Return the pose of a query, counted from 0; each transformation and strength has its own."""
    return TRANSFORMATIONS.index(transformation) * len(STRENGTHS) + strength - 1


def shape_seed(seed: int, label: str) -> int:
    """Return the seed of one shape's transformations; two shapes have two seeds."""
    digest = hashlib.sha256(f"benchmark/{seed}/{label}".encode()).digest()
    return int.from_bytes(digest[:6], "little")
