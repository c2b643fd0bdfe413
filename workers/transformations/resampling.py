"""Sampling: the same surface with fewer vertices."""

import fast_simplification
import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.cleaning import useful_faces
from workers.geometry.decimation import ONE_AT_A_TIME
from workers.geometry.mesh import TriangleMesh
from workers.transformations.transformed import FEWEST_FACES, TransformedMesh, part

# Chosen, not measured.
FEWEST_SAMPLED = 100  # faces that are aimed at, at least
AGGRESSIVENESS = 7.0  # of the simplifier: how fast the error that it allows grows


def resample(mesh: TriangleMesh, *, share: float) -> TransformedMesh:
    """Simplify by quadric error to a share of the faces, but to no fewer than about 100.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    share : float
        Of the faces.

    Returns
    -------
    TransformedMesh
        The origin of a vertex is, of the vertices that were collapsed into it, the nearest.
    """
    target = max(FEWEST_SAMPLED, round(share * mesh.n_faces))
    while target < mesh.n_faces:
        found = decimated(mesh, target)
        if found.mesh.n_faces >= FEWEST_FACES:
            return found
        target *= 2
    return part(mesh, np.ones(mesh.n_faces, dtype=np.bool_))


def decimated(
    mesh: TriangleMesh, n_faces: int, *, aggressiveness: float = AGGRESSIVENESS
) -> TransformedMesh:
    """The mesh simplified to about so many faces, none of them degenerate or repeated.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    n_faces : int
        About how many faces are left.
    aggressiveness : float
        How fast the error allowed grows; the smaller, the more strictly small errors go first.

    Returns
    -------
    TransformedMesh
        The origin of a vertex is, of the vertices that were collapsed into it, the nearest.
    """
    centre, unit = mesh.vertices.mean(axis=0), np.sqrt(mesh.area)
    vertices = (mesh.vertices - centre) / unit
    faces = mesh.faces.astype(np.int32)
    with ONE_AT_A_TIME:
        *_, collapses = fast_simplification.simplify(
            vertices.copy(),
            faces.copy(),
            target_count=n_faces,
            agg=aggressiveness,
            return_collapses=True,
        )
        points, triangles, owners = fast_simplification.replay_simplification(
            vertices.copy(), faces.copy(), collapses
        )
    points = np.asarray(points, dtype=np.float64)
    origin = _nearest_members(vertices, points, np.asarray(owners, dtype=np.int64))
    usable = np.isfinite(points).all(axis=1) & (origin >= 0)  # (n',)
    triangles = np.asarray(triangles, dtype=np.int64)
    points = np.where(usable[:, None], points, 0.0)
    coarse = TriangleMesh(centre + unit * points, triangles[usable[triangles].all(axis=1)])
    kept = np.zeros(coarse.n_faces, dtype=np.bool_)
    kept[useful_faces(coarse)] = True
    return TransformedMesh(coarse, origin).then(part(coarse, kept))


def _nearest_members(vertices: FloatArray, points: FloatArray, owners: IntArray) -> IntArray:
    """Of the vertices (n, 3) that each point (n', 3) owns the nearest, (n',); -1 for none."""
    members = np.flatnonzero((owners >= 0) & (owners < len(points)))
    gaps = np.linalg.norm(vertices[members] - points[owners[members]], axis=1)
    order = np.lexsort((members, gaps, owners[members]))
    owning, first = np.unique(owners[members][order], return_index=True)
    origin = np.full(len(points), -1, dtype=np.int64)
    origin[owning] = members[order[first]]
    return origin
