"""Edges turned where two triangles lie in a plane, so that no angle is larger than it must be.

A triangle without height has cotangents that are worthless, and opens a hole where it is left out.
"""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, cross, lengths
from workers.geometry.edges import edge_keys
from workers.geometry.mesh import TriangleMesh
from workers.geometry.shared_edges import SharedEdges

# Chosen, not measured.
ROUNDS = 30  # most edges are turned in the first five
LEAST_GAIN = 0.01  # of the angles' sum beyond π, in radians: below, one diagonal is as good
MOST_LOST = 0.01  # of the area of both faces
FLATNESS = 0.02  # how far apart both diagonals may pass, in units of the shorter one


def turn_edges(mesh: TriangleMesh) -> TriangleMesh:
    """Turn edges until both angles that face an edge sum to π at most (Delaunay 1934).

    Only edges between two faces that lie nearly in a plane are turned: the surface stays where it
    is. Many edges are turned at a time, none of which share a face, the worst ones first.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any unit.

    Returns
    -------
    TriangleMesh
        The same vertices, as many faces, and the same topology; the mesh itself where no edge is
        turned.
    """
    faces = mesh.faces.copy()
    changed = np.ones(len(faces), dtype=np.bool_)  # (m,) faces with edges that were not looked at
    for _ in range(ROUNDS):
        touched = np.zeros(mesh.n_vertices, dtype=np.bool_)
        touched[faces[changed]] = True
        near = np.flatnonzero(touched[faces].any(axis=1))
        turned = _turn_some(mesh.vertices, faces, near, changed)
        if len(turned) == 0:
            break
        changed = np.zeros(len(faces), dtype=np.bool_)
        changed[turned] = True
    return mesh if np.array_equal(faces, mesh.faces) else TriangleMesh(mesh.vertices, faces)


def _turn_some(
    vertices: FloatArray, faces: IntArray, near: IntArray, changed: BoolArray
) -> IntArray:
    """Turn some edges of the faces that changed, in place, and tell which faces change by it.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    near : (f,) int64
        Faces that changed and all that share a vertex with one.
    changed : (m,) bool
    """
    n = len(vertices)
    shared = SharedEdges.of(faces[near], n)
    pairs = near[shared.faces]  # (e, 2)
    gains = np.where(changed[pairs].any(axis=1), _gains(vertices, shared.ends, shared.tips), 0.0)
    wanted = np.flatnonzero(gains > LEAST_GAIN)
    new = shared.tips[wanted]
    wanted = wanted[(new[:, 0] != new[:, 1]) & ~shared.contain(new, n)]
    # Of the edges of a face the one with the largest gain is turned, if it is that of both faces.
    wanted = wanted[np.argsort(-gains[wanted], kind="stable")]
    place = np.arange(len(wanted))
    best = np.full(len(faces), len(wanted))
    for side in range(2):
        np.minimum.at(best, pairs[wanted, side], place)
    wanted = wanted[(best[pairs[wanted]] == place[:, None]).all(axis=1)]
    # Two edges may not become the same one.
    _, first = np.unique(edge_keys(shared.tips[wanted], n), return_index=True)
    wanted = wanted[np.sort(first)]
    (a, b), (c, d), (left, right) = shared.ends[wanted].T, shared.tips[wanted].T, pairs[wanted].T
    faces[left] = np.stack([c, d, b], axis=1)
    faces[right] = np.stack([d, c, a], axis=1)
    return np.concatenate([left, right])


def _gains(vertices: FloatArray, ends: IntArray, tips: IntArray) -> FloatArray:
    """How far the angles at the tips (e, 2), which face an edge, sum beyond π, (e,).

    0 where the edge may not be turned.
    """
    a, b = vertices[ends[:, 0]], vertices[ends[:, 1]]
    c, d = vertices[tips[:, 0]], vertices[tips[:, 1]]
    ca, cb, da, db = a - c, b - c, a - d, b - d
    normal_c, normal_d = cross(ca, cb), cross(db, da)
    angles_c = np.arctan2(lengths(normal_c), (ca * cb).sum(axis=1))
    angles_d = np.arctan2(lengths(normal_d), (da * db).sum(axis=1))
    # The diagonals of a plane quadrilateral meet.
    edge, diagonal = b - a, d - c
    between = cross(edge, diagonal)
    apart = np.abs((between * ca).sum(axis=1))  # times the length of `between`
    shorter = np.minimum(lengths(edge), lengths(diagonal))
    flat = apart <= FLATNESS * shorter * lengths(between)
    # Both new faces look to where the old ones do.
    normal = normal_c + normal_d
    upright = ((cross(diagonal, cb) * normal).sum(axis=1) > 0.0) & (
        (cross(-diagonal, da) * normal).sum(axis=1) > 0.0
    )
    areas = lengths(normal_c) + lengths(normal_d)
    new = lengths(cross(diagonal, cb)) + lengths(cross(diagonal, da))
    flat &= np.abs(new - areas) <= MOST_LOST * areas
    gains: FloatArray = np.where(flat & upright, angles_c + angles_d - np.pi, 0.0)
    return gains
