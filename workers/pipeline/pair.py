"""A part of a training: a shape, a transformation of it, and the moments of both."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workers.errors import (
    InvalidRequestError,
    SpectrumError,
)
from workers.geometry.arrays import IntArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.pipeline.outcome import Outcome
from workers.pipeline.solve import parse_upload, solve_view
from workers.pipeline.training_meshes import load_creature, load_stored
from workers.pipeline.training_pairs import CreatureSource, Pair, Simulation, StoredSource
from workers.pipeline.training_parts import PAIR, Arrays, compute_kept
from workers.pipeline.workbench import Workbench
from workers.storage.parts import Claim
from workers.training.correspondence import CorrespondingPoints, Solved, corresponding_points
from workers.training.pairs import PairMoments, pair_moments
from workers.transformations import transform


@dataclass(frozen=True, eq=False)
class Learnt:
    """What is kept of a pair: its moments, and under which content its shape was solved."""

    moments: PairMoments
    sha256: str


def compute_pair(
    bench: Workbench, claim: Claim, *, measure: "MeasurePair | None" = None
) -> Outcome:
    """Store the moments of a pair, unless they are there; a pair that has none is named."""
    pair = Pair.from_payload(claim.payload)
    measure = measure or measure_pair
    return compute_kept(bench, PAIR, pair, lambda: _arrays(measure(bench, pair)))


MeasurePair = Callable[[Workbench, Pair], Learnt]


def learnt_from(arrays: Arrays) -> Learnt:
    """What was learned from a pair, as it is stored."""
    return Learnt(PairMoments.from_arrays(arrays), str(arrays["sha256"]))


def _arrays(learnt: Learnt) -> Arrays:
    return {**learnt.moments.to_arrays(), "sha256": np.array(learnt.sha256)}


@dataclass(frozen=True, eq=False)
class _Shape:
    """A mesh whose vertices are known by their numbers, its cleaned form, and their content."""

    mesh: TriangleMesh
    cleaned: TriangleMesh
    sha256: str

    def solved(self, bench: Workbench, pair: Pair) -> Solved:
        """Solve it under the pair's view, or find it solved."""
        return Solved(self.mesh, solve_view(bench.blobs, self.sha256, self.cleaned, pair.view))


def measure_pair(bench: Workbench, pair: Pair) -> Learnt:
    """Make and solve both shapes of a pair, and take their moments."""
    shape, first, second, origin = _solve_both(bench, pair)
    found = corresponding_points(first, second, origin)
    moments = pair_moments(
        first.solution.spectrum,
        second.solution.spectrum,
        found.points,
        found.transformed_points,
        found.weights,
        criterion=pair.criterion,
    )
    return Learnt(moments, shape.sha256)


def points_of_pair(bench: Workbench, pair: Pair) -> CorrespondingPoints:
    """Return the points that a pair's moments are taken of, with their eigenfunctions."""
    _, first, second, origin = _solve_both(bench, pair)
    return corresponding_points(first, second, origin)


def _solve_both(bench: Workbench, pair: Pair) -> tuple[_Shape, Solved, Solved, IntArray]:
    """Make and solve the shape and its transformation; with where its vertices come from."""
    shape = _original(bench, pair)
    transformed, origin = _transformed(bench, pair, shape)
    first, second = shape.solved(bench, pair), transformed.solved(bench, pair)
    _require_eigenpairs(first.solution, second.solution)
    return shape, first, second, origin


def _original(bench: Workbench, pair: Pair) -> _Shape:
    """Shape X of a pair."""
    source = pair.source
    if isinstance(source, CreatureSource):
        return _made(load_creature(source).rest)
    if isinstance(pair.change, StoredSource):
        return _uploaded(bench, source)
    mesh = load_stored(bench, source)
    return _Shape(mesh, mesh, source.sha256)


def _transformed(bench: Workbench, pair: Pair, shape: _Shape) -> tuple[_Shape, IntArray]:
    """Shape Y of a pair, and the vertex of X that each of its vertices comes from."""
    change = pair.change
    if isinstance(change, StoredSource):
        other = _uploaded(bench, change)
        if other.mesh.n_vertices != shape.mesh.n_vertices:
            raise InvalidRequestError(
                f"{change.name} has {other.mesh.n_vertices} vertices, expected as many as the "
                f"{shape.mesh.n_vertices} of the shape that it is paired with"
            )
        return other, np.arange(other.mesh.n_vertices)
    made = transform(
        shape.mesh,
        change.transformation,
        change.strength,
        seed=change.seed,
        pose=_pose(pair.source, change),
    )
    return _made(made.mesh), made.origin


def _pose(source: CreatureSource | StoredSource, change: Simulation) -> TriangleMesh | None:
    """Pose of a creature, the farther from rest the stronger the transformation."""
    if change.pose is None or not isinstance(source, CreatureSource):
        return None
    return load_creature(source).posed(change.pose, strength=change.strength / 5)


def _made(mesh: TriangleMesh) -> _Shape:
    """Mesh that was made here, known by its own content."""
    content = hashlib.sha256(f"mesh {mesh.n_vertices} {mesh.n_faces} ".encode())
    content.update(mesh.vertices.astype("<f8").tobytes())
    content.update(mesh.faces.astype("<i8").tobytes())
    return _Shape(mesh, clean(mesh).mesh, content.hexdigest())


def _uploaded(bench: Workbench, source: StoredSource) -> _Shape:
    """Mesh in the vertex order of its file."""
    parsed = parse_upload(bench.blobs, source.sha256, filename=source.name, settings=bench.settings)
    return _Shape(parsed.mesh, clean(parsed.mesh).mesh, source.sha256)


def _require_eigenpairs(*solutions: Solution) -> None:
    for solution in solutions:
        if not solution.spectrum.n_eigenpairs:
            raise SpectrumError("a mesh of the pair has no eigenpairs")
