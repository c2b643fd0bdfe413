"""Edges of a mesh: listed, measured, and as graphs. Any winding, manifold or not."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from workers.geometry.arrays import FloatArray, IntArray, ascending, lengths
from workers.geometry.mesh import TriangleMesh


def directed_edges(faces: IntArray) -> IntArray:
    """Edges of the faces in their winding.

    Parameters
    ----------
    faces : (m, 3) int64
        Vertex indices a, b, c of each face.

    Returns
    -------
    (3m, 2) int64
        All ab, then all bc, then all ca.
    """
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def undirected_edges(mesh: TriangleMesh) -> IntArray:
    """Every edge of a mesh once.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.

    Returns
    -------
    (e, 2) int64
        The smaller index first; rows ascend.
    """
    keys = ascending(face_edge_keys(mesh.faces, mesh.n_vertices), own=True)
    ends = np.empty((2, len(keys)), dtype=np.int64)  # each end lies in one run of the memory
    np.floor_divide(keys, max(mesh.n_vertices, 1), out=ends[0])
    np.multiply(ends[0], mesh.n_vertices, out=ends[1])
    np.subtract(keys, ends[1], out=ends[1])
    return ends.T


def edge_keys(edges: IntArray, n_vertices: int) -> IntArray:
    """One number for each edge, the same in both directions.

    Parameters
    ----------
    edges : (e, 2) int64
        Vertex indices.
    n_vertices : int
        n, above every index.

    Returns
    -------
    (e,) int64
        ``smaller * n + larger``: ascends as edges sorted by their ends do.
    """
    keys: IntArray = edges.min(axis=1) * n_vertices + edges.max(axis=1)
    return keys


def face_edge_keys(faces: IntArray, n_vertices: int) -> IntArray:
    """`edge_keys` of `directed_edges`, without the edges themselves.

    Parameters
    ----------
    faces : (m, 3) int64
        Vertex indices of each face.
    n_vertices : int
        n, above every index.

    Returns
    -------
    (3m,) int64
        Of all ab, then all bc, then all ca.
    """
    corners = np.ascontiguousarray(faces.T)  # (3, m)
    keys = np.empty_like(corners)
    for corner, start in enumerate(corners):
        end = corners[(corner + 1) % 3]
        np.minimum(start, end, out=keys[corner])
        keys[corner] *= n_vertices
        keys[corner] += np.maximum(start, end)
    return keys.ravel()


def single_edges(faces: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    """Find the edges that only one face has.

    Parameters
    ----------
    faces : (m, 3) int64
        Of any winding, manifold or not.
    n_vertices : int
        n, above every index.

    Returns
    -------
    corners, faces : (b,) int64
        The edge begins at this corner of this face. All ab, then all bc, then all ca.
    """
    ordered = face_edge_keys(faces, n_vertices)
    ordered.sort()
    new = np.ones(len(ordered) + 1, dtype=np.bool_)
    np.not_equal(ordered[1:], ordered[:-1], out=new[1:-1])
    single = ordered[new[1:] & new[:-1]]  # (b,), ascending
    del ordered, new
    if len(single) == 0:
        return single, single
    near = np.zeros(n_vertices, dtype=np.bool_)
    for ends in np.divmod(single, n_vertices):
        near[ends] = True
    around = np.flatnonzero(np.count_nonzero(near[faces], axis=1) >= 2)  # faces worth a look
    keys = face_edge_keys(faces[around], n_vertices)
    place = np.minimum(np.searchsorted(single, keys), len(single) - 1)
    corners, of_around = np.divmod(np.flatnonzero(single[place] == keys), len(around))
    return corners, around[of_around]


def edge_lengths(vertices: FloatArray, edges: IntArray) -> FloatArray:
    """Lengths of edges.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    edges : (e, 2) int64
        Vertex indices.

    Returns
    -------
    (e,) float64
        In the unit of the vertices.
    """
    start, end = (vertices.take(edges[:, i], axis=0) for i in range(2))
    start -= end
    return lengths(start)


def symmetric_graph(edges: IntArray, weights: FloatArray, n_vertices: int) -> sparse.csr_array:
    """Weights of edges as a matrix that is symmetric to the last bit.

    Parameters
    ----------
    edges : (e, 2) int64
        Vertex indices. For exact symmetry an edge that is listed again must be listed in the
        same direction: its weights are then added once, for both entries.
    weights : (e,) float64
        One for each edge.
    n_vertices : int
        n.

    Returns
    -------
    (n, n) sparse
        Entries (i, j) and (j, i) are the sum of the weights listed for the edge.
    """
    shape = (n_vertices, n_vertices)
    half = sparse.coo_array((weights, (edges[:, 0], edges[:, 1])), shape=shape).tocsr()
    return sparse.csr_array(half + half.T)


def length_graph(mesh: TriangleMesh, edges: IntArray) -> sparse.csr_array:
    """Lengths of edges as a symmetric matrix, for shortest paths.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    edges : (e, 2) int64
        Each edge once: those of `undirected_edges`, and others if wanted.

    Returns
    -------
    (n, n) sparse
        In the mesh's unit. No entry is 0, since a stored 0 would be no edge.
    """
    along = np.maximum(edge_lengths(mesh.vertices, edges), np.finfo(np.float64).tiny)
    return symmetric_graph(edges, along, mesh.n_vertices)


def component_labels(edges: IntArray, n_vertices: int) -> IntArray:
    """Label of the connected component of every vertex.

    Parameters
    ----------
    edges : (e, 2) int64
        Vertex indices, in any direction.
    n_vertices : int
        n.

    Returns
    -------
    (n,) int64
        From 0 without gaps, in the order of the components' first vertices.
    """
    ones = np.ones(len(edges), dtype=np.int8)
    shape = (n_vertices, n_vertices)
    graph = sparse.coo_array((ones, (edges[:, 0], edges[:, 1])), shape=shape)
    _, labels = connected_components(graph.tocsr(), directed=False)
    return np.asarray(labels, dtype=np.int64)
