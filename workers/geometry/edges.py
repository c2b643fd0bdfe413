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
    keys = ascending(face_edge_keys(mesh.faces, mesh.n_vertices))
    return np.stack(np.divmod(keys, max(mesh.n_vertices, 1)), axis=1)


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
