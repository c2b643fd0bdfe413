"""The verb of a pair: a shape, a transformation of it, and the moments of both."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import IntArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import TRANSFORMING
from workers.pipeline.solve import solve_view
from workers.pipeline.training.meshes import load_cleaned_mesh, load_mesh_in_file_order
from workers.pipeline.training.results import Arrays, store_result
from workers.pipeline.workbench import Workbench
from workers.storage.parts import Claim
from workers.training.correspondence import CorrespondingPoints, Solved, corresponding_points
from workers.training.examples import Pair
from workers.training.moments import PairMoments, moments_of_solved
from workers.training.sources import (
    CreatureSource,
    Posing,
    StoredSource,
    load_creature,
    simulate,
)


@dataclass(frozen=True, eq=False)
class MeasuredPair:
    """What is stored of a pair.

    Attributes
    ----------
    moments : PairMoments
    sha256 : str
        Content under which the shape itself was solved.
    """

    moments: PairMoments
    sha256: str

    def to_arrays(self) -> Arrays:
        """Return every field as an array.

        Returns
        -------
        mapping of str to array
        """
        return {**self.moments.to_arrays(), "sha256": np.array(self.sha256)}

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "MeasuredPair":
        """Return the pair that `to_arrays` wrote.

        Parameters
        ----------
        arrays : mapping of str to array
            Every field by its name.

        Returns
        -------
        MeasuredPair
        """
        return cls(PairMoments.from_arrays(arrays), str(arrays["sha256"]))


MeasurePair: TypeAlias = Callable[[Workbench, Pair], MeasuredPair]


def measure_pair(bench: Workbench, pair: Pair) -> MeasuredPair:
    """Make and solve both shapes of a pair, and take their moments.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    pair : Pair
        A shape and how it became another.

    Returns
    -------
    MeasuredPair

    Raises
    ------
    ProteusError
        A mesh cannot be read, transformed or solved, or too few of its points correspond.
    """
    shape, transformed, origin = _both_meshes(bench, pair)
    moments = moments_of_solved(
        shape.solved(bench, pair),
        transformed.solved(bench, pair),
        origin,
        criterion=pair.criterion,
    )
    return MeasuredPair(moments, shape.sha256)


def points_of_pair(bench: Workbench, pair: Pair) -> CorrespondingPoints:
    """Find the points that a pair's moments are taken of.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    pair : Pair
        A shape and how it became another.

    Returns
    -------
    CorrespondingPoints
        Eigenfunctions of both shapes at them.

    Raises
    ------
    ProteusError
        As for `measure_pair`.
    """
    shape, transformed, origin = _both_meshes(bench, pair)
    return corresponding_points(shape.solved(bench, pair), transformed.solved(bench, pair), origin)


def compute_pair(bench: Workbench, claim: Claim, *, measure: MeasurePair = measure_pair) -> Outcome:
    """Store the moments of a pair, unless they are there already.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload is the pair.
    measure : callable
        Takes the moments.

    Returns
    -------
    Outcome
        Names the pair if it has none.

    Raises
    ------
    ProteusError
        It fails for a reason that is not its own.
    """
    pair = Pair.from_payload(claim.payload)
    bench.progress.enter(TRANSFORMING)
    return store_result(bench.blobs, pair, lambda: measure(bench, pair).to_arrays())


@dataclass(frozen=True, eq=False)
class _Shape:
    """A mesh whose vertices are known by their numbers, its cleaned form, and their content."""

    mesh: TriangleMesh
    cleaned: TriangleMesh
    sha256: str

    def solved(self, bench: Workbench, pair: Pair) -> Solved:
        """Solve it under the pair's view, or find it solved."""
        return Solved(self.mesh, solve_view(bench.blobs, self.sha256, self.cleaned, pair.view))


def _both_meshes(bench: Workbench, pair: Pair) -> tuple[_Shape, _Shape, IntArray]:
    """Make shape X, shape Y, and the vertex of X that each vertex of Y comes from."""
    source, change = pair.source, pair.change
    if isinstance(change, StoredSource):
        return _same_vertex_order(bench, source, change)
    if isinstance(source, CreatureSource):
        shape = _made(load_creature(source).rest)
    else:
        mesh = load_cleaned_mesh(bench, source)
        shape = _Shape(mesh, mesh, source.sha256)
    made = simulate(shape.mesh, source, change, posing=Posing.GRADED)
    return shape, _made(made.mesh), made.origin


def _same_vertex_order(
    bench: Workbench, source: CreatureSource | StoredSource, change: StoredSource
) -> tuple[_Shape, _Shape, IntArray]:
    """Read two files whose vertices correspond by their numbers."""
    if isinstance(source, CreatureSource):
        raise InvalidRequestError(
            f"{change.name} has the vertex order of a file, not of a creature"
        )
    shape, other = _uploaded(bench, source), _uploaded(bench, change)
    if other.mesh.n_vertices != shape.mesh.n_vertices:
        raise InvalidRequestError(
            f"{change.name} has {other.mesh.n_vertices} vertices, expected as many as the "
            f"{shape.mesh.n_vertices} of the shape that it is paired with"
        )
    return shape, other, np.arange(other.mesh.n_vertices)


def _made(mesh: TriangleMesh) -> _Shape:
    """Mesh that was made here, known by its own content."""
    content = hashlib.sha256(f"mesh {mesh.n_vertices} {mesh.n_faces} ".encode())
    content.update(mesh.vertices.astype("<f8").tobytes())
    content.update(mesh.faces.astype("<i8").tobytes())
    return _Shape(mesh, clean(mesh).mesh, content.hexdigest())


def _uploaded(bench: Workbench, source: StoredSource) -> _Shape:
    """Mesh in the vertex order of its file."""
    mesh = load_mesh_in_file_order(bench, source)
    return _Shape(mesh, clean(mesh).mesh, source.sha256)
