"""Regions of a surface: what lies among some vertices, or around one, cut out along edges."""

import numpy as np
from scipy.sparse.csgraph import dijkstra

from workers.errors import InvalidRequestError
from workers.geometry.arrays import BoolArray, IntArray, lengths
from workers.geometry.cleaning import FEWEST_FACES
from workers.geometry.geodesics import surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.geometry.strays import without_unreferenced

SLACK = 1e-9  # relative: no sum of lengths along a path is rounded by as much


def cut_vertices(mesh: TriangleMesh, vertices: IntArray) -> TriangleMesh:
    """Cut out the faces all of whose corners are among some vertices.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    vertices : (s,) int64
        Indices in any order, perhaps repeated. Those without such a face are left out.

    Returns
    -------
    TriangleMesh
        Faces, their winding and vertices in the order of the mesh; the mesh itself where no face
        is missing. It may have several components.

    Raises
    ------
    InvalidRequestError
        A vertex is none of the mesh, or fewer than 4 faces are left.
    """
    require_vertices(mesh, vertices)
    chosen = np.zeros(mesh.n_vertices, dtype=np.bool_)
    chosen[vertices] = True
    faces = _faces_among(mesh, chosen)
    if len(faces) < FEWEST_FACES:
        raise InvalidRequestError(
            f"vertices: {int(chosen.sum()):,}, faces with all their corners among them: "
            f"{len(faces)}; expected at least {FEWEST_FACES} faces"
        )
    return _with_faces(mesh, faces)


def cut_disc(mesh: TriangleMesh, center: int, radius: float) -> TriangleMesh:
    """Cut out a geodesic disc: the faces whose corners lie within a distance along the surface.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    center : int
        Index of the vertex that distances are measured from.
    radius : float
        The longest distance, in the mesh's unit; along the paths of `surface_graph`.

    Returns
    -------
    TriangleMesh
        Faces, their winding and vertices in the order of the mesh; the mesh itself where no face
        is missing. It is connected by its vertices.

    Raises
    ------
    InvalidRequestError
        The center is no vertex of the mesh, or fewer than 4 faces are left.
    """
    require_vertices(mesh, np.array([center]))
    chosen = _within(mesh, center, radius)
    faces = _faces_among(mesh, chosen)
    if len(faces) < FEWEST_FACES:
        raise InvalidRequestError(
            f"whole faces within {radius:g} of vertex {center}: {len(faces)}; expected at least "
            f"{FEWEST_FACES} (its longest edge is {_longest_edge(mesh, center):.4g} long)"
        )
    return _with_faces(mesh, faces)


def require_vertices(mesh: TriangleMesh, vertices: IntArray) -> None:
    """Refuse indices that are none of a mesh's vertices.

    Parameters
    ----------
    mesh : TriangleMesh
        Of n vertices.
    vertices : (s,) int64
        Indices; each should be from 0 to n - 1.

    Raises
    ------
    InvalidRequestError
        It names the first of those that are not.
    """
    unknown = np.flatnonzero((vertices < 0) | (vertices >= mesh.n_vertices))
    if len(unknown):
        raise InvalidRequestError(
            f"there is no vertex {vertices[unknown[0]]}, expected 0 to {mesh.n_vertices - 1}"
        )


def _within(mesh: TriangleMesh, center: int, radius: float) -> BoolArray:
    """Which vertices (n,) lie within a distance along the surface."""
    # No path is shorter than the straight line, so only what lies in a ball is searched: the faces
    # with a corner in it. Their neighbours are there, too, as they decide which edges two faces
    # share, and so which lines across edges there are. The distances are those of the whole mesh.
    offsets = mesh.vertices - mesh.vertices[center]  # (n, 3)
    near = _touching(mesh, lengths(offsets) <= radius * (1.0 + SLACK))  # (m,)
    touched = np.zeros(mesh.n_vertices, dtype=np.bool_)
    touched[mesh.faces[near]] = True
    around = mesh.faces[_touching(mesh, touched)]
    kept = np.zeros(mesh.n_vertices, dtype=np.bool_)
    kept[around] = True
    new_index = np.cumsum(kept) - 1  # (n,)
    ball = TriangleMesh(mesh.vertices[kept], new_index[around])
    chosen = np.zeros(mesh.n_vertices, dtype=np.bool_)
    chosen[center] = True
    if kept[center]:
        start = int(new_index[center])
        found = dijkstra(surface_graph(ball), directed=True, indices=[start], limit=radius)[0]
        chosen[np.flatnonzero(kept)[found <= radius]] = True
    return chosen


def _touching(mesh: TriangleMesh, chosen: BoolArray) -> BoolArray:
    """Which faces (m,) have a corner among the chosen vertices (n,)."""
    at: BoolArray = np.asarray(chosen[mesh.faces].any(axis=1))
    return at


def _faces_among(mesh: TriangleMesh, chosen: BoolArray) -> IntArray:
    """Faces (f,) all of whose corners are among the chosen vertices (n,), ascending."""
    return np.flatnonzero(chosen[mesh.faces].all(axis=1))


def _with_faces(mesh: TriangleMesh, faces: IntArray) -> TriangleMesh:
    """Return these faces and their vertices as a mesh; the mesh itself where they are all."""
    if len(faces) == mesh.n_faces:
        return mesh
    return TriangleMesh(*without_unreferenced(mesh.vertices, mesh.faces[faces]))


def _longest_edge(mesh: TriangleMesh, vertex: int) -> float:
    """Length of the longest edge at a vertex, 0 where there is none."""
    own = mesh.faces[(mesh.faces == vertex).any(axis=1)]
    away = lengths(mesh.vertices[own.ravel()] - mesh.vertices[vertex])
    return float(away.max(initial=0.0))
