"""Eigenfunctions of a shape and of its transformation at points that correspond."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.transfer import closest_points

CORRESPONDENCE_VERSION = "2"
"""Part of the key of what is stored of a pair: raised when the same meshes give other points."""

FARTHEST = 0.02  # of the root of the area: what lies farther off corresponds to nothing
FEWEST_POINTS = 100  # of 800: moments of fewer say little


@dataclass(frozen=True, eq=False)
class Solved:
    """A mesh whose vertices are known by their numbers, and what was computed of it.

    Attributes
    ----------
    mesh : TriangleMesh
        As it was before cleaning and preparation.
    solution : Solution
        Of its working mesh.
    """

    mesh: TriangleMesh
    solution: Solution


@dataclass(frozen=True, eq=False)
class CorrespondingPoints:
    """Eigenfunctions at corresponding points; arrays are read-only.

    Attributes
    ----------
    points : (s, k) float64
        Those of the shape.
    transformed_points : (s, k') float64
        Those of its transformation.
    weights : (s,) float64
        Share of the transformation's area that each point stands for; they sum to 1.
    """

    points: FloatArray
    transformed_points: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("points", "transformed_points", "weights"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))


def corresponding_points(
    original: Solved, transformed: Solved, origin: IntArray
) -> CorrespondingPoints:
    """Find the sample points of a transformation on the shape that it was made of.

    A sample point goes to the closest point of the transformed mesh. From there the vertices'
    numbers lead to the original mesh, and then to the closest point of the shape's working mesh.
    Working meshes are simplified, and their holes are closed. So a point that is moved by more than
    2 % of √area on the way corresponds to nothing and is left out.

    Parameters
    ----------
    original, transformed : Solved
        The shape X and its transformation Y.
    origin : (n',) int64
        Vertex of X's mesh that each vertex of Y's mesh corresponds to.

    Returns
    -------
    CorrespondingPoints
        Eigenfunctions of both at the points that are left.

    Raises
    ------
    InsufficientTrainingDataError
        Fewer than 100 points are left.
    """
    sample = transformed.solution.sample()
    working = transformed.solution.mesh.vertices[sample.indices]  # (s, 3)
    on_transformed = closest_points(transformed.mesh, working)
    is_near = _is_near(on_transformed.squared_distances, transformed.solution)
    positions = on_transformed.interpolate(original.mesh.vertices[origin])  # (s, 3)
    on_original = closest_points(original.solution.mesh, positions)
    is_near &= _is_near(on_original.squared_distances, original.solution)
    left = np.flatnonzero(is_near)
    if len(left) < FEWEST_POINTS:
        raise InsufficientTrainingDataError(
            f"{len(left)} of {len(is_near)} points have a counterpart on the shape, expected at "
            f"least {FEWEST_POINTS}"
        )
    weights = sample.weights[left]
    return CorrespondingPoints(
        points=on_original.interpolate(original.solution.spectrum.eigenvectors)[left],
        transformed_points=transformed.solution.spectrum.eigenvectors[sample.indices[left]],
        weights=weights / weights.sum(),
    )


def _is_near(squared_distances: FloatArray, solution: Solution) -> np.ndarray:
    """Whether points lie within the tolerance of a surface, (s,)."""
    return squared_distances <= FARTHEST**2 * solution.spectrum.area
