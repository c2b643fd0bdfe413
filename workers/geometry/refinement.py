"""A finer mesh of the same surface, for boxes of a dozen triangles."""

import numpy as np

from workers.geometry.edges import directed_edges
from workers.geometry.mesh import TriangleMesh


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
