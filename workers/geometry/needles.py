"""Edges that are short beside those around them shrink to a point.

A simplifier that looks at errors alone sees none on a flat piece of a surface. There it places
vertices anywhere, beside each other too, and leaves needles.
"""

import numpy as np
from scipy import sparse

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, cross, lengths
from workers.geometry.edges import edge_keys, edge_lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.shared_edges import SharedEdges

# Chosen, not measured.
SHORT = 0.1  # of the longest edge of both faces of an edge
FLAT = 1e-4  # height over longest edge of a face that looks nowhere
LEAST_COSINE = 0.95  # of the angle by which a face may turn
MOST_LOST = 0.01  # of the area of the faces around
MOST_NEIGHBOURS = 200  # comparing those of all short edges of a hub takes the square of them
ROUNDS = 30  # five or so are enough


def merge_needles(mesh: TriangleMesh) -> tuple[TriangleMesh, IntArray]:
    """Shrink edges that are short beside those around them, each to its middle.

    An edge shrinks where its ends have no common neighbours but the tips of its two faces: then no
    piece of the surface is closed off. And the surface around must stay where it is.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.

    Returns
    -------
    mesh : TriangleMesh
        Of the same topology, with vertices that no face has; the mesh itself where nothing is
        short.
    to : (n,) int64
        The vertex that each vertex became part of.
    """
    n = mesh.n_vertices
    vertices, faces, to = mesh.vertices.copy(), mesh.faces, np.arange(n)
    refused = np.empty(0, dtype=np.int64)
    for _ in range(ROUNDS):
        shared = SharedEdges.of(faces, n)
        if len(shared.ends) == 0:
            break
        graph = _adjacency(shared.keys, n)
        pairs, middles = _short_edges(vertices, faces, shared, graph)
        fresh = ~np.isin(edge_keys(pairs, n), refused)
        pairs, middles = pairs[fresh], middles[fresh]
        if len(pairs) == 0:
            break
        apart = _far_apart(pairs, graph)
        pairs, middles = pairs[apart], middles[apart]
        kept = _keep_the_surface(vertices, faces, pairs, middles)
        refused = np.concatenate([refused, edge_keys(pairs[~kept], n)])
        pairs, middles = pairs[kept], middles[kept]
        numbers = np.arange(n)
        numbers[pairs[:, 1]] = pairs[:, 0]
        vertices[pairs[:, 0]] = middles
        to = numbers[to]
        faces = numbers[faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
    return (mesh if faces is mesh.faces else TriangleMesh(vertices, faces)), to


def _short_edges(
    vertices: FloatArray, faces: IntArray, shared: SharedEdges, graph: sparse.csr_array
) -> tuple[IntArray, FloatArray]:
    """Edges (e, 2) that may shrink, the shortest first, and the points (e, 3) that they shrink to.

    Of an edge with one end on the rim this end stays.
    """
    n = len(vertices)
    longest = _longest_edges(vertices, faces)  # (m,)
    share = edge_lengths(vertices, shared.ends) / longest[shared.faces].max(axis=1)
    chosen = np.flatnonzero(share < SHORT)
    on_rim = np.ones(n, dtype=np.bool_)  # on an edge that is not shared, too
    counts = np.bincount(shared.ends.ravel(), minlength=n)
    on_rim[counts == np.bincount(faces.ravel(), minlength=n)] = False
    crowded = np.diff(graph.indptr) > MOST_NEIGHBOURS  # (n,)
    ends = shared.ends[chosen]
    chosen = chosen[~on_rim[ends].all(axis=1) & ~crowded[ends].any(axis=1)]
    ends = shared.ends[chosen]
    common = np.asarray(graph[ends[:, 0]].multiply(graph[ends[:, 1]]).sum(axis=1)).ravel()
    closed = common == 2
    ends, chosen = ends[closed], chosen[closed]
    order = np.lexsort((ends.max(axis=1), ends.min(axis=1), share[chosen]))
    ends = ends[order]
    start, end = vertices[ends[:, 0]], vertices[ends[:, 1]]
    middles = 0.5 * (start + end)
    for fixed, point in ((ends[:, 0], start), (ends[:, 1], end)):
        middles = np.where(on_rim[fixed][:, None], point, middles)
    return ends, middles


def _adjacency(keys: IntArray, n_vertices: int) -> sparse.csr_array:
    """Which vertices have an edge, as a symmetric matrix (n, n) of ones."""
    a, b = np.divmod(keys, n_vertices)
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    ones = np.ones(len(rows), dtype=np.int32)
    graph = sparse.csr_array((ones, (rows, columns)), shape=(n_vertices, n_vertices))
    graph.data[:] = 1
    return graph


def _far_apart(pairs: IntArray, graph: sparse.csr_array) -> BoolArray:
    """Of pairs (e, 2), from the first one on, those whose neighbourhoods do not meet."""
    taken = np.zeros(graph.shape[0], dtype=np.bool_)
    far = np.zeros(len(pairs), dtype=np.bool_)
    for place, (a, b) in enumerate(pairs.tolist()):
        around = np.concatenate(
            [graph.indices[graph.indptr[end] : graph.indptr[end + 1]] for end in (a, b)]
        )  # a and b, too
        if not taken[around].any():
            taken[around] = True
            far[place] = True
    return far


def _keep_the_surface(
    vertices: FloatArray, faces: IntArray, pairs: IntArray, middles: FloatArray
) -> BoolArray:
    """Whether the surface stays where it is when each pair (e, 2) moves to its middle (e, 3).

    The faces around look where they did, and have as much area together.
    """
    moved = vertices.copy()
    owner = np.full(len(vertices), -1)
    for side in range(2):
        moved[pairs[:, side]] = middles
        owner[pairs[:, side]] = np.arange(len(pairs))
    owners = owner[faces].max(axis=1)
    touched = owners >= 0
    around, owners = faces[touched], owners[touched]
    before, after = _normals(vertices, around), _normals(moved, around)
    sizes, left = lengths(before), lengths(after)  # those with both ends vanish: 0
    flat = sizes < FLAT * _longest_edges(vertices, around) ** 2  # look nowhere
    turned = ~flat & ((before * after).sum(axis=1) < LEAST_COSINE * sizes * left)
    kept = np.ones(len(pairs), dtype=np.bool_)
    kept[owners[turned]] = False
    total, rest = (np.bincount(owners, x, len(pairs)) for x in (sizes, left))
    kept &= np.abs(rest - total) <= MOST_LOST * total
    return kept


def _longest_edges(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Length of the longest edge of each face, (m,)."""
    one, two, three = (edge_lengths(vertices, faces[:, [i, (i + 1) % 3]]) for i in range(3))
    longest: FloatArray = np.maximum(np.maximum(one, two), three)
    return longest


def _normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Normals (m, 3), of twice the faces' areas."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return cross(b - a, c - a)
