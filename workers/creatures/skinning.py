"""How skin follows bones: smooth weights along the surface, and blended rigid motions."""

import numpy as np
from scipy import sparse

from workers.creatures.implicit import capsule_distance
from workers.creatures.skeleton import Capsule, Skeleton
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.edges import symmetric_graph
from workers.geometry.elements import LAST, NEXT, corner_cotangents, lumped_areas
from workers.geometry.factorisation import SymmetricFactor
from workers.geometry.mesh import TriangleMesh

# Chosen, not measured.
_WIDTH = 0.55  # of the transition between two bones, in radii of the flesh there
_COTANGENTS = (0.05, 20.0)  # held within: all positive, none dominates
_CONTRAST = 0.15  # radii by which a capsule must be nearer to be the only one that counts


def skin_weights(
    skeleton: Skeleton, capsules: tuple[Capsule, ...], points: FloatArray, faces: IntArray
) -> FloatArray:
    """Share of each bone in the motion of each vertex.

    Each vertex belongs to the bone of the capsule it lies on. This partition diffuses along the
    surface over about a radius, never through the air from one leg to another.

    Parameters
    ----------
    skeleton : Skeleton
        Its bones.
    capsules : tuple of Capsule
        The flesh, as thick as the surface was made.
    points : (n, 3) float64
        Vertices.
    faces : (m, 3) int64
        Of the closed surface.

    Returns
    -------
    (n, b) float64, not negative, rows of sum 1
    """
    owned, radius = _partition(capsules, points, skeleton.n_bones)  # (n, b), (n,)
    weights = np.clip(_diffused(owned, points, faces, _WIDTH * radius), 0.0, None)
    shares: FloatArray = weights / weights.sum(axis=1, keepdims=True)
    return shares


def bone_motions(skeleton: Skeleton, angles: FloatArray) -> FloatArray:
    """Rigid motions of all bones.

    Parameters
    ----------
    skeleton : Skeleton
        Its bones and motions.
    angles : (motions,) float64
        Angle of each of the skeleton's motions in radians.

    Returns
    -------
    (b, 8) float64: unit dual quaternions
    """
    local = _rotations(skeleton.rotation_vectors(angles))  # (b, 4)
    turns, heads = local.copy(), np.array(skeleton.heads)
    depths = skeleton.ancestry.sum(axis=1)
    for depth in range(2, int(depths.max()) + 1):
        bones = np.flatnonzero(depths == depth)
        parents = skeleton.parents[bones]
        turns[bones] = _products(turns[parents], local[bones])  # no jump of sign along a chain
        arms = skeleton.heads[bones] - skeleton.heads[parents]
        heads[bones] = heads[parents] + _rotated(turns[parents], arms)
    shift = np.zeros((skeleton.n_bones, 4))
    shift[:, 1:] = heads - _rotated(turns, skeleton.heads)
    return np.concatenate([turns, 0.5 * _products(shift, turns)], axis=1)


def blend(points: FloatArray, weights: FloatArray, motions: FloatArray) -> FloatArray:
    """Points moved by their blend of rigid motions.

    Dual-quaternion skinning: the blend of rotations is again a rotation, so limbs keep their
    thickness in a twist (Kavan, Collins, Žára, O'Sullivan 2008).

    Parameters
    ----------
    points : (n, 3) float64
        At rest.
    weights : (n, b) float64
        Share of each bone, rows of sum 1.
    motions : (b, 8) float64
        Unit dual quaternions.

    Returns
    -------
    (n, 3) float64
    """
    mixed = np.einsum("nb,bq->nq", weights, motions)  # the same bits whatever the BLAS
    mixed = mixed / np.linalg.norm(mixed[:, :4], axis=1, keepdims=True)
    turns, dual = mixed[:, :4], mixed[:, 4:]
    conjugate = turns * np.array([1.0, -1.0, -1.0, -1.0])
    shift = 2.0 * _products(dual, conjugate)[:, 1:]
    moved: FloatArray = _rotated(turns, points) + shift
    return moved


def _partition(
    capsules: tuple[Capsule, ...], points: FloatArray, n_bones: int
) -> tuple[FloatArray, FloatArray]:
    """How much each vertex lies on the flesh of each bone, (n, b), and the radius there, (n,)."""
    nearness = np.full((len(points), n_bones), np.inf)
    radii = np.ones((len(points), n_bones))
    for capsule in capsules:
        distance, radius = capsule_distance(capsule, points)
        width = radius * capsule.thinness
        nearer = distance < nearness[:, capsule.bone] * width
        nearness[nearer, capsule.bone] = (distance / width)[nearer]
        radii[nearer, capsule.bone] = radius[nearer]
    best = nearness.argmin(axis=1)
    lead = nearness - nearness.min(axis=1, keepdims=True)
    owned = np.exp(-((lead / _CONTRAST) ** 2))
    return owned / owned.sum(axis=1, keepdims=True), radii[np.arange(len(points)), best]


def _diffused(
    owned: FloatArray, points: FloatArray, faces: IntArray, widths: FloatArray
) -> FloatArray:
    """Values (n, b) after two implicit steps of diffusion that spread over widths (n,).

    Each step solves (M + L) new = M old. Area-weighted means stay.
    """
    n = len(points)
    doubled = np.linalg.norm(TriangleMesh(points, faces).face_normals, axis=1)  # (m,)
    masses = lumped_areas(faces, 0.5 * doubled, n)  # (n,)
    # all positive, so that shares stay between 0 and 1 (but for rounding)
    cotangents = corner_cotangents(points[faces], doubled, in_order=True)  # (m, 3)
    cotangents = np.clip(cotangents, *_COTANGENTS)
    reach = 0.5 * (widths[faces[:, NEXT]] + widths[faces[:, LAST]])  # (m, 3)
    opposite = np.stack([faces[:, NEXT], faces[:, LAST]], axis=2)  # (m, 3, 2)
    conductances = symmetric_graph(
        np.concatenate([opposite[:, c] for c in range(3)]),
        np.concatenate([0.5 * cotangents[:, c] * reach[:, c] ** 2 for c in range(3)]),
        n,
    )
    diagonal = masses + np.asarray(conductances.sum(axis=1), dtype=np.float64)  # (n,)
    system = SymmetricFactor(sparse.diags_array(diagonal) - conductances)
    for _ in range(2):
        owned = system.solve(masses[:, None] * owned)
    return owned


def _rotations(turns: FloatArray) -> FloatArray:
    """Quaternions (b, 4) of rotation vectors (b, 3) in radians."""
    half = np.linalg.norm(turns, axis=1, keepdims=True) / 2.0
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * turns], axis=1)


def _products(left: FloatArray, right: FloatArray) -> FloatArray:
    """Quaternion products row by row, (n, 4)."""
    a, u, b, v = left[:, :1], left[:, 1:], right[:, :1], right[:, 1:]
    real = a * b - (u * v).sum(axis=1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=1)


def _rotated(turns: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 3) turned by unit quaternions (n, 4)."""
    axis = turns[:, 1:]
    once = np.cross(axis, points) + turns[:, :1] * points
    moved: FloatArray = points + 2.0 * np.cross(axis, once)
    return moved
