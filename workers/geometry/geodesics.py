"""Distances along a surface: a graph of edges and unfolded diagonals, and farthest points in it.

Shortest paths along edges alone are some per cent too long, in another way on every mesh. A path
may also cross an edge: two faces unfold into a plane, and the line between their tips is a short
cut where it stays inside them.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.shared_edges import SharedEdges


@dataclass(frozen=True, eq=False)
class FarthestPoints:
    """Vertices spread over a surface, with how far all others are from them.

    Attributes
    ----------
    vertices : (s,) int64
        In the order in which they were taken: the first ones are spread, too.
    distances : (s, n) float64
        To every vertex, infinite beyond the reach that was asked for.
    cells : (n,) int64
        The point that is nearest to each vertex, by its place in ``vertices``.
    """

    vertices: IntArray
    distances: FloatArray
    cells: IntArray


def surface_graph(mesh: TriangleMesh) -> sparse.csr_array:
    """Lengths of edges, and of straight lines across them.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices; edges of one, three or more faces are crossed by no line.

    Returns
    -------
    (n, n) sparse
        Symmetric, in the mesh's unit. No entry is 0, since a stored 0 would be no edge.
    """
    edges = undirected_edges(mesh)
    tips, across = _unfolded(mesh)
    ends = np.concatenate([edges, tips])
    along = np.concatenate([edge_lengths(mesh.vertices, edges), across])
    # Of several ways between two vertices the shortest counts.
    keys = ends.min(axis=1) * mesh.n_vertices + ends.max(axis=1)
    order = np.lexsort((along, keys))
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = keys[order[1:]] != keys[order[:-1]]
    start, end = np.divmod(keys[order[first]], max(mesh.n_vertices, 1))
    ways = np.maximum(along[order[first]], np.finfo(np.float64).tiny)
    shape = (mesh.n_vertices, mesh.n_vertices)
    half = sparse.coo_array((ways, (start, end)), shape=shape).tocsr()
    return sparse.csr_array(half + half.T)


def farthest_points(
    graph: sparse.csr_array, count: int, *, start: int, reach: float
) -> FarthestPoints:
    """Vertices each farthest from those before it, by searches that end early.

    A search for a new point may end early. It goes as far as the points are apart by then, and at
    least as far as distances are wanted.

    Parameters
    ----------
    graph : (n, n) sparse
        What `surface_graph` gave.
    count : int
        s, at least 1; all n vertices where there are fewer.
    start : int
        The first point is the farthest from this vertex in its component.
    reach : float
        Up to which all distances of every point are found, in the unit of the graph.

    Returns
    -------
    FarthestPoints
        Components without a point come first, in the order of their vertices.
    """
    n = graph.shape[0]
    from_start = _search(graph, start, np.inf)
    taken = int(np.argmax(np.where(np.isfinite(from_start), from_start, -1.0)))
    vertices = np.empty(min(count, n), dtype=np.int64)
    distances = np.empty((len(vertices), n))
    nearest = np.full(n, np.inf)
    cells = np.zeros(n, dtype=np.int64)
    for place in range(len(vertices)):
        vertices[place] = taken
        limit = max(reach, float(nearest.max()))
        found = _search(graph, taken, limit)
        distances[place] = found
        closer = found < nearest
        nearest[closer], cells[closer] = found[closer], place
        taken = int(np.argmax(nearest))
    return FarthestPoints(vertices, distances, cells)


def distances_from(graph: sparse.csr_array, vertices: IntArray, reach: float) -> FloatArray:
    """Distances from some vertices to all others within reach.

    Parameters
    ----------
    graph : (n, n) sparse
        What `surface_graph` gave.
    vertices : (s,) int64
        Indices; one may come again.
    reach : float
        Longest distance that is looked for, in the unit of the graph.

    Returns
    -------
    (s, n) float64
        Infinite beyond the reach and in other components.
    """
    if len(vertices) == 0:
        return np.empty((0, graph.shape[0]))
    found = dijkstra(graph, directed=True, indices=vertices, limit=reach)
    return np.asarray(found, dtype=np.float64)


def mutual_distances(near: FloatArray, count: int) -> FloatArray:
    """Distances between points of which those of near ones are known: by way of the others.

    They are a little too long. Of 256 points with a reach of 0.3 √A on a horse, an octopus and a
    human it was 0.014 √A at most and 0.002 √A on average, measured once. It takes a tenth of the
    time.

    Parameters
    ----------
    near : (s, s) float64
        Distances within reach, infinite beyond it.
    count : int
        Of the first so many points.

    Returns
    -------
    (count, count) float64
        Symmetric to the last bit; infinite between components.
    """
    known = np.minimum(near, near.T)
    ways = np.where(np.isfinite(known), np.maximum(known, np.finfo(np.float64).tiny), 0.0)
    np.fill_diagonal(ways, 0.0)
    first = np.arange(min(count, len(near)))
    between = distances_from(sparse.csr_array(ways), first, np.inf)[:, first]
    symmetric: FloatArray = np.minimum(between, between.T)
    return symmetric


def _search(graph: sparse.csr_array, start: int, limit: float) -> FloatArray:
    """Distances (n,) from a vertex; the graph is symmetric, so its direction is no matter."""
    found: FloatArray = distances_from(graph, np.array([start]), limit)[0]
    return found


def _unfolded(mesh: TriangleMesh) -> tuple[IntArray, FloatArray]:
    """Tips (d, 2) of two faces whose line crosses the edge between them, and its length (d,)."""
    shared = SharedEdges.of(mesh.faces, mesh.n_vertices)
    start, end = (mesh.vertices[shared.ends[:, i]] for i in range(2))
    length = lengths(end - start)  # (e,)
    safe = np.maximum(length, np.finfo(np.float64).tiny)
    along, height = [], []
    for side in range(2):
        corner = mesh.vertices[shared.tips[:, side]] - start
        place = np.einsum("ei,ei->e", corner, end - start) / safe
        along.append(place)
        squared = np.einsum("ei,ei->e", corner, corner) - place**2
        height.append(np.sqrt(np.maximum(squared, 0.0)))
    total = height[0] + height[1]
    run = along[1] - along[0]
    crossing = along[0] + run * height[0] / np.maximum(total, np.finfo(np.float64).tiny)
    inside = (crossing > 0.0) & (crossing < length) & (shared.tips[:, 0] != shared.tips[:, 1])
    return shared.tips[inside], np.hypot(run, total)[inside]
