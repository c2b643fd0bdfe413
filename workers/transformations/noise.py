"""Noise on every vertex, and shots: few vertices far away."""

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import vertex_normals
from workers.transformations.metric import mean_edge, random_vertices
from workers.transformations.transformed import TransformedMesh, moved

# Chosen, not measured.
_HALVINGS = 40  # of the interval that the amplitude lies in
_MOST_COUNTED = 10_000  # vertices of which there are shots: a finer mesh is not shot to pieces
_LARGEST_AMPLITUDE = 16.0  # mean edges


def add_noise(mesh: TriangleMesh, *, growth: float, rng: np.random.Generator) -> TransformedMesh:
    """Add normally distributed noise, of the amplitude that makes the area grow as asked.

    So the effect is the same at any resolution, and for regular and irregular meshes.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    growth : float
        Area afterwards over area before, at least 1.
    rng : Generator
        Draws the displacements.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    directions = rng.normal(size=mesh.vertices.shape)  # (n, 3)
    return moved(mesh, mesh.vertices + _amplitude(mesh, directions, growth) * directions)


def add_shots(
    mesh: TriangleMesh, *, share: float, farthest: float, rng: np.random.Generator
) -> TransformedMesh:
    """Displace few vertices, drawn by area, far along their normals, in or out.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    share : float
        Of the vertices, of 10,000 where there are more; at least two. Fewer where one is drawn
        again.
    farthest : float
        Longest displacement in √A; the shortest is half of it.
    rng : Generator
        Draws the vertices and how far they go.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    count = max(2, round(share * min(mesh.n_vertices, _MOST_COUNTED)))
    chosen = np.unique(random_vertices(mesh, count, rng))
    heights = farthest * np.sqrt(mesh.area) * rng.uniform(0.5, 1.0, len(chosen))
    heights *= rng.choice([-1.0, 1.0], len(chosen))
    vertices = mesh.vertices.copy()
    vertices[chosen] += heights[:, None] * vertex_normals(mesh, corner_by_corner=True)[chosen]
    return moved(mesh, vertices)


def _amplitude(mesh: TriangleMesh, directions: FloatArray, growth: float) -> float:
    """Factor on the directions by which the area grows as asked, by bisection."""
    low, high = 0.0, _LARGEST_AMPLITUDE * mean_edge(mesh)
    wanted = growth * mesh.area
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if TriangleMesh(mesh.vertices + middle * directions, mesh.faces).area < wanted:
            low = middle
        else:
            high = middle
    return low
