"""Lengths along a surface: edges, shortest paths, farthest vertices."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import vertex_components

_TETHERS = 4  # that hold a smaller component


def tethered_edges(mesh: TriangleMesh) -> tuple[IntArray, IntArray]:
    """Edges (e, 2), and tethers (t, 2) that tie each component to the largest one.

    A tether runs from a vertex of the smaller component to the nearest of the largest, so that
    what is smooth along edges and tethers moves eyes with the head that they sit in.
    """
    labels = vertex_components(mesh)  # (n,)
    sizes = np.bincount(labels)
    largest = np.flatnonzero(labels == np.argmax(sizes))
    others = np.flatnonzero(labels != np.argmax(sizes))
    edges = undirected_edges(mesh)
    if len(others) == 0:
        return edges, np.zeros((0, 2), dtype=np.int64)
    found = cKDTree(mesh.vertices[largest]).query(mesh.vertices[others])
    gaps, nearest = np.asarray(found[0]), np.asarray(found[1])
    order = np.lexsort((others, gaps, labels[others]))  # by component, the nearest first
    _, first = np.unique(labels[others][order], return_index=True)
    place = np.arange(len(order)) - np.repeat(first, np.diff([*first, len(order)]))
    chosen = order[place < _TETHERS]
    return edges, np.stack([others[chosen], largest[nearest[chosen]]], axis=1)


def geodesic_distances(
    graph: sparse.csr_array, sources: IntArray, *, limit: float = np.inf
) -> FloatArray:
    """Lengths of the shortest paths along edges, (s, n); inf beyond the limit."""
    distances = dijkstra(graph, directed=True, indices=sources, limit=limit)  # it is symmetric
    return np.asarray(distances, dtype=np.float64)


def farthest_vertices(
    graph: sparse.csr_array, start: int, count: int
) -> tuple[IntArray, FloatArray]:
    """Vertices (c,) each farthest from those before it, and the distances from each, (c, n).

    The first is the farthest from ``start``, which is not among them.
    """
    reach = _finite(geodesic_distances(graph, np.array([start]))[0])
    chosen = [int(np.argmax(reach))]
    distances = [_finite(geodesic_distances(graph, np.array(chosen))[0])]
    nearest = distances[0].copy()  # (n,)
    while len(chosen) < min(count, len(reach)):
        chosen.append(int(np.argmax(nearest)))
        distances.append(_finite(geodesic_distances(graph, np.array(chosen[-1:]))[0]))
        np.minimum(nearest, distances[-1], out=nearest)
    return np.array(chosen), np.stack(distances)


def random_vertices(mesh: TriangleMesh, count: int, rng: np.random.Generator) -> IntArray:
    """Draw vertices (count,), uniformly over the area; one may come again."""
    shares = np.cumsum(mesh.face_areas)
    faces = np.searchsorted(shares, rng.uniform(0.0, shares[-1], count), side="right")
    corners = rng.integers(3, size=count)
    vertices: IntArray = mesh.faces[np.minimum(faces, mesh.n_faces - 1), corners]
    return vertices


def mean_edge(mesh: TriangleMesh) -> float:
    """Mean length of the edges."""
    return float(edge_lengths(mesh.vertices, undirected_edges(mesh)).mean())


def _finite(distances: FloatArray) -> FloatArray:
    """The distances with unreachable vertices as far as the farthest."""
    reached = np.isfinite(distances)
    finite: FloatArray = np.where(reached, distances, distances[reached].max())
    return finite
