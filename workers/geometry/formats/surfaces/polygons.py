"""From polygons to the triangles of a mesh, with the checks that all formats share."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray, frozen
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.surfaces.triangulation import triangulate
from workers.geometry.formats.text.tokens import Polygons
from workers.geometry.mesh import TriangleMesh


def polygon_mesh(vertices: FloatArray, polygons: Polygons, limits: MeshLimits) -> TriangleMesh:
    """Make a mesh of polygons cut into triangles; points and segments are left out.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    polygons : Polygons
        Corners are indices from 0, not checked before. The mesh keeps them where all are triangles:
        nothing may write to them again.
    limits : MeshLimits
        Most vertices and triangles that are accepted.

    Returns
    -------
    TriangleMesh
        All vertices, and the triangles in the order of the polygons.

    Raises
    ------
    InvalidMeshError
        No face, or a face that refers to a vertex that there is not.
    UploadTooLargeError
        More vertices or triangles than the limits allow.
    """
    n_triangles = int(np.maximum(polygons.counts - 2, 0).sum())
    limits.check(vertices=len(vertices), faces=n_triangles)
    require_faces(len(vertices), n_triangles)
    require_corners(polygons, len(vertices))
    with np.errstate(all="ignore"):  # what is not finite is left to cleaning
        return TriangleMesh(vertices, frozen(triangulate(vertices, polygons)))


def points_and_lines(polygons: Polygons) -> tuple[str, ...]:
    """Say how many faces are none.

    Parameters
    ----------
    polygons : Polygons
        As in the file.

    Returns
    -------
    tuple of str
        One sentence if there are faces of less than 3 corners, which `polygon_mesh` leaves out.
    """
    n_lines = int((polygons.counts < 3).sum())
    if not n_lines:
        return ()
    what = "1 face that is a point or a line"
    if n_lines > 1:
        what = f"{n_lines:,} faces that are points or lines"
    return (f"left out {what}",)


def require_faces(n_vertices: int, n_faces: int) -> None:
    """Raise ``InvalidMeshError`` for an empty file or a point cloud.

    Parameters
    ----------
    n_vertices, n_faces : int
        How many a file has.

    Raises
    ------
    InvalidMeshError
        There are no faces.
    """
    if n_faces == 0 and n_vertices == 0:
        raise InvalidMeshError("the file has neither vertices nor faces; expected a surface")
    if n_faces == 0:
        raise InvalidMeshError(
            f"the file has points but no faces ({n_vertices:,} points): it is a point cloud; "
            "expected a surface: make one of it first, for example with MeshLab"
        )


def require_corners(polygons: Polygons, n_vertices: int, *, first: int = 0) -> None:
    """Raise ``InvalidMeshError`` naming the first corner of a polygon that is no vertex.

    Parameters
    ----------
    polygons : Polygons
        Corners are indices from 0.
    n_vertices : int
        How many vertices there are.
    first : int
        What the format calls its first vertex, for the message (1 in OBJ).

    Raises
    ------
    InvalidMeshError
        An index below 0 or from ``n_vertices`` on.
    """
    corners = polygons.corners
    if len(corners) and (corners.min() < 0 or corners.max() >= n_vertices):
        faces_of_corners = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
        require_indices(corners, faces_of_corners, n_vertices, first=first)


def require_indices(
    corners: IntArray, faces_of_corners: IntArray, n_vertices: int, *, first: int = 0
) -> None:
    """Raise ``InvalidMeshError`` naming the first corner that is no vertex.

    Parameters
    ----------
    corners, faces_of_corners : (c,) int64
        Vertex indices from 0, and the face each belongs to.
    n_vertices : int
        How many vertices there are.
    first : int
        What the format calls its first vertex, for the message (1 in OBJ).

    Raises
    ------
    InvalidMeshError
        An index below 0 or from ``n_vertices`` on.
    """
    bad = (corners < 0) | (corners >= n_vertices)
    if bad.any():
        where = int(np.argmax(bad))
        raise InvalidMeshError(
            f"face {faces_of_corners[where]} refers to vertex {corners[where] + first}, "
            f"but the mesh has {n_vertices} vertices"
        )
