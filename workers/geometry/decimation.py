"""Fewer vertices by quadric error, unchecked: what a level of a simplification is made by.

A flat piece of a surface has no error, so a decimation leaves needles there (decision 35).
"""

import threading
from dataclasses import dataclass
from typing import Protocol

import fast_simplification
import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.cleaning import useful_faces
from workers.geometry.diagonals import turn_edges
from workers.geometry.edges import edge_lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.needles import merge_needles

JITTER = 0.01  # of an edge, to each side; chosen, not measured
JITTER_SEED = 20261128

ONE_AT_A_TIME = threading.Lock()  # fast_simplification keeps its mesh in global variables


@dataclass(frozen=True, eq=False)
class Coarser:
    """A coarser mesh of n vertices of a mesh.

    Attributes
    ----------
    mesh : TriangleMesh
        Without degenerate faces; may have no face at all.
    to : (n,) int64
        The vertex of the coarser mesh that each vertex became part of; -1 where it has no face.
    """

    mesh: TriangleMesh
    to: IntArray


class Decimate(Protocol):
    """Makes a coarser mesh, as `decimate_by_error` does."""

    def __call__(
        self,
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        """Mesh of about ``target`` vertices."""


def decimate_by_error(
    mesh: TriangleMesh,
    target: int,
    aggressiveness: float,
    *,
    keep_border: bool,
    shaken: bool = False,
    rough: bool = False,
) -> Coarser:
    """Mesh of about so many vertices by quadric error (Garland, Heckbert 1997), unchecked.

    A flat piece has no error, so its vertices come to lie anywhere. Needles are merged, and edges
    are turned. Where that does not do, a little noise makes errors grow with what was merged.

    Parameters
    ----------
    mesh : TriangleMesh
        Of area 1.
    target : int
        About how many vertices the result has.
    aggressiveness : float
        How fast the error allowed grows; the smaller, the more strictly small errors go first.
    keep_border : bool
        Whether edges of the boundary stay.
    shaken : bool
        Whether vertices get a little noise first.
    rough : bool
        Whether edges and vertices stay as they come, since another level follows, and nobody asks
        what became of the vertices.

    Returns
    -------
    Coarser
        What became of the mesh and of its vertices.
    """
    n_faces = round(mesh.n_faces * target / mesh.n_vertices)
    corners = mesh.faces.astype(np.int32)
    vertices = mesh.vertices + _jitter(mesh) if shaken else mesh.vertices.copy()
    with ONE_AT_A_TIME:
        points, triangles, collapses = fast_simplification.simplify(
            vertices.copy(),
            corners,
            target_count=n_faces,
            agg=aggressiveness,
            preserve_border=keep_border,
            return_collapses=True,
        )
        to = np.zeros(0, dtype=np.int64) if rough else collapsed(collapses, mesh.n_vertices)
        if not rough and to.max(initial=-1) + 1 != len(points):  # a vertex has lost all its faces
            _, _, to = fast_simplification.replay_simplification(vertices, corners, collapses)
    found = TriangleMesh(points.astype(np.float64), triangles.astype(np.int64))
    if rough:
        return _without_useless(found.vertices, found.faces, to)
    merged, into = merge_needles(found)
    shaped = turn_edges(merged)
    return _without_useless(shaped.vertices, shaped.faces, into[to])


def _jitter(mesh: TriangleMesh) -> FloatArray:
    """A little noise, (n, 3): in units of the shortest edge that a vertex has."""
    shortest = np.full(mesh.n_vertices, np.inf)
    for corner in range(3):
        edges = mesh.faces[:, [corner, (corner + 1) % 3]]
        along = edge_lengths(mesh.vertices, edges)
        for side in range(2):
            np.minimum.at(shortest, edges[:, side], along)
    rng = np.random.Generator(np.random.PCG64(JITTER_SEED))
    noise: FloatArray = rng.uniform(-JITTER, JITTER, size=mesh.vertices.shape)
    noise *= np.where(np.isfinite(shortest), shortest, 0.0)[:, None]
    return noise


def collapsed(collapses: IntArray, n_vertices: int) -> IntArray:
    """Follow each vertex through the collapses of edges to the vertex that it became part of.

    Parameters
    ----------
    collapses : (c, 2) int
        The vertex that stays and the one that goes, each of which goes once.
    n_vertices : int
        n, before them.

    Returns
    -------
    (n,) int64
        Numbers among the n - c vertices that are left, in their order.
    """
    into = np.arange(n_vertices)
    into[collapses[:, 1]] = collapses[:, 0]
    left = into == np.arange(n_vertices)
    while True:  # what they became part of may itself have become part of another one
        further = into.take(into)
        if np.array_equal(further, into):
            break
        into = further
    numbers: IntArray = (np.cumsum(left) - 1).take(into)
    return numbers


def _without_useless(points: FloatArray, triangles: IntArray, to: IntArray) -> Coarser:
    """Leave out faces without area, repeated ones, and vertices (p,) that only they had."""
    finite: BoolArray = np.asarray(np.isfinite(points).all(axis=1))
    triangles = triangles[finite[triangles].all(axis=1)]
    if len(triangles) == 0:
        return nothing(len(to))
    mesh = TriangleMesh(np.where(finite[:, None], points, 0.0), triangles)
    faces = mesh.faces[useful_faces(mesh)]
    if len(faces) == 0:
        return nothing(len(to))
    return renumbered(mesh.vertices, faces, to)


def renumbered(points: FloatArray, faces: IntArray, to: IntArray) -> Coarser:
    """Leave out vertices without a face.

    Parameters
    ----------
    points : (p, 3) float64
        Positions.
    faces : (f, 3) int64
        Of these points.
    to : (n,) int64
        The point that each vertex of a finer mesh became part of, or -1.

    Returns
    -------
    Coarser
        With the other points, numbered anew.
    """
    used = np.zeros(len(points), dtype=np.bool_)
    used[faces] = True
    numbers = np.where(used, np.cumsum(used) - 1, -1)
    return Coarser(TriangleMesh(points[used], numbers[faces]), np.where(to >= 0, numbers[to], -1))


def nothing(n_vertices: int) -> Coarser:
    """What has no face left.

    Parameters
    ----------
    n_vertices : int
        Of the finer mesh.

    Returns
    -------
    Coarser
        Without vertices.
    """
    empty = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    return Coarser(empty, np.full(n_vertices, -1))
