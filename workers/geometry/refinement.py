"""A finer mesh of the same surface: everywhere, or where edges are long."""

import numpy as np

from workers.geometry.arrays import BoolArray, IntArray
from workers.geometry.diagonals import turn_edges
from workers.geometry.edges import (
    directed_edges,
    edge_keys,
    edge_lengths,
    face_edge_keys,
    undirected_edges,
)
from workers.geometry.mesh import TriangleMesh

ROUNDS = 8  # an edge is halved in each; chosen, not measured


def refine(mesh: TriangleMesh, *, vertices: int) -> TriangleMesh:
    """Mesh of at least so many vertices by cutting every triangle into four, again and again.

    The surface, its components, boundary and Euler characteristic stay what they are.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    vertices : int
        A mesh with as many is returned as it is.

    Returns
    -------
    TriangleMesh
        The given vertices stay the first ones.
    """
    while mesh.n_vertices < vertices and mesh.n_faces:
        mesh = _quartered(mesh)
    return mesh


def _quartered(mesh: TriangleMesh) -> TriangleMesh:
    """Mesh with every triangle cut at the midpoints of its edges."""
    edges = np.sort(directed_edges(mesh.faces), axis=1)  # (3m, 2): all ab, all bc, all ca
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = mesh.vertices[unique].mean(axis=1)  # (e, 3)
    ab, bc, ca = (inverse.reshape(3, -1) + mesh.n_vertices).astype(np.int64)
    a, b, c = mesh.faces.T
    quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    faces = np.stack([np.stack(quarter, axis=1) for quarter in quarters], axis=1)  # (m, 4, 3)
    return TriangleMesh(np.concatenate([mesh.vertices, middles]), faces.reshape(-1, 3))


def split_long_edges(mesh: TriangleMesh, *, longest: float, most: int) -> TriangleMesh:
    """Halve edges that are too long, and turn those beside them that face large angles afterwards.

    Flat pieces of a mesh that was simplified have few vertices, since none was needed for their
    form. The functions on them need some.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    longest : float
        Longer edges are halved, in the unit of the mesh.
    most : int
        How many vertices may be added; the longest edges come first.

    Returns
    -------
    TriangleMesh
        The given vertices stay the first ones; the mesh itself where no edge is too long.
    """
    start = mesh.n_vertices
    for _ in range(ROUNDS):
        edges = undirected_edges(mesh)  # (e, 2)
        along = edge_lengths(mesh.vertices, edges)
        order = np.argsort(-along, kind="stable")[: start + most - mesh.n_vertices]
        halved = np.zeros(len(edges), dtype=np.bool_)
        halved[order[along[order] > longest]] = True
        if not halved.any():
            break
        mesh = turn_edges(_halved(mesh, edges, halved), since=mesh.n_vertices)
    return mesh


def _halved(mesh: TriangleMesh, edges: IntArray, halved: BoolArray) -> TriangleMesh:
    """Mesh with some of its edges (e, 2) cut at their middles, each face in up to four."""
    n = mesh.n_vertices
    numbers = np.where(halved, n - 1 + np.cumsum(halved), -1)  # (e,) of the middles
    keys = edge_keys(edges, n)  # ascending
    at = np.searchsorted(keys, face_edge_keys(mesh.faces, n).reshape(3, -1))
    middles = numbers[at]  # (3, m) of ab, bc, ca
    # Each face is turned until the edges that are cut come first: ab, then bc, then ca.
    is_cut = middles >= 0
    count = is_cut.sum(axis=0)  # (m,)
    turns = np.where(
        count == 1, is_cut.argmax(axis=0), np.where(count == 2, (is_cut.argmin(axis=0) + 1) % 3, 0)
    )
    places = (np.arange(3)[:, None] + turns) % 3  # (3, m)
    a, b, c = np.take_along_axis(mesh.faces.T, places, axis=0)
    ab, bc, ca = np.take_along_axis(middles, places, axis=0)
    patterns = (
        [(a, b, c)],
        [(a, ab, c), (ab, b, c)],
        [(ab, b, bc), (a, ab, bc), (a, bc, c)],
        [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
    )
    faces = [
        np.stack([corner[count == cuts] for corner in corners], axis=1)
        for cuts, pattern in enumerate(patterns)
        for corners in pattern
    ]
    points = mesh.vertices[edges[halved]].mean(axis=1)
    return TriangleMesh(np.concatenate([mesh.vertices, points]), np.concatenate(faces))
