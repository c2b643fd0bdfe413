"""Lengths along a surface: edges, shortest paths, farthest vertices."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import vertex_components

# Chosen, not measured.
_TETHERS = 4  # that hold a smaller component


def tethered_edges(mesh: TriangleMesh) -> tuple[IntArray, IntArray]:
    """Edges, and tethers that tie each component to the largest one.

    A tether runs from a vertex of the smaller component to the nearest of the largest. So what is
    smooth along edges and tethers moves eyes with the head that they sit in.

    Parameters
    ----------
    mesh : TriangleMesh
        Of one component or several.

    Returns
    -------
    edges : (e, 2) int64
        Each edge once, as from `undirected_edges`.
    tethers : (t, 2) int64
        At most four for each smaller component.
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
    """Lengths of the shortest paths along edges (Dijkstra).

    Parameters
    ----------
    graph : (n, n) sparse
        Symmetric edge lengths, as from `length_graph`.
    sources : (s,) int64
        Vertices that paths start from.
    limit : float
        Longest path that is looked for.

    Returns
    -------
    (s, n) float64
        In the unit of the graph; infinite beyond the limit and in other components.
    """
    distances = dijkstra(graph, directed=True, indices=sources, limit=limit)  # it is symmetric
    return np.asarray(distances, dtype=np.float64)


def farthest_vertices(
    graph: sparse.csr_array, start: int, count: int
) -> tuple[IntArray, FloatArray]:
    """Vertices each farthest along the surface from those before it.

    Parameters
    ----------
    graph : (n, n) sparse
        Symmetric edge lengths, as from `length_graph`.
    start : int
        The first vertex is the farthest from this one, which is not among them.
    count : int
        c; all n vertices where there are fewer.

    Returns
    -------
    vertices : (c,) int64
        In the order in which they were taken.
    distances : (c, n) float64
        From each of them, in the unit of the graph; what is out of reach is as far as the farthest.
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
    """Draw vertices uniformly over the area; one may come again.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    count : int
        How many.
    rng : Generator
        Draws them.

    Returns
    -------
    (count,) int64
        Vertex indices.
    """
    shares = np.cumsum(mesh.face_areas)
    faces = np.searchsorted(shares, rng.uniform(0.0, shares[-1], count), side="right")
    corners = rng.integers(3, size=count)
    vertices: IntArray = mesh.faces[np.minimum(faces, mesh.n_faces - 1), corners]
    return vertices


def mean_edge(mesh: TriangleMesh) -> float:
    """Mean length of the edges.

    Parameters
    ----------
    mesh : TriangleMesh
        With at least one edge.

    Returns
    -------
    float
        In the mesh's unit.
    """
    return float(edge_lengths(mesh.vertices, undirected_edges(mesh)).mean())


def _finite(distances: FloatArray) -> FloatArray:
    """The distances with unreachable vertices as far as the farthest."""
    reached = np.isfinite(distances)
    finite: FloatArray = np.where(reached, distances, distances[reached].max())
    return finite
