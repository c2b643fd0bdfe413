"""Open edges that lie on each other become one edge: seams between parts of one surface."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.degenerate import degenerate_faces
from workers.geometry.edges import component_labels, directed_edges, edge_keys
from workers.geometry.openings import (
    SHARE_OF_EDGE,
    OpenEdges,
    Pairs,
    shortest_edges,
)

LOOSE = 10.0  # a seam is as wide everywhere; what is ten times wider elsewhere is a slit
WHOLE = 0.9  # of a seam's edges must lie on each other
MOST_ROUNDS = 8  # of taking back what would do harm


def weld(
    vertices: FloatArray,
    faces: IntArray,
    opening: OpenEdges,
    pairs: Pairs,
    *,
    distance: float,
    within_loop: float,
) -> tuple[IntArray, float]:
    """Make vertices along open edges one, as far as nothing collapses.

    Pairs of open edges that touch each other form a seam. It is welded if nine tenths of the pairs
    less than ten times as far apart are within the distance: so a slit is not sewn from its ends,
    and a seam is sewn as a whole or not at all.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions; none is moved.
    faces : (m, 3) int64
        Without degenerate or repeated ones.
    opening : OpenEdges
        Of these faces.
    pairs : Pairs
        Of these edges, up to ten times the distance apart, or more.
    distance : float
        Vertices farther apart are not welded.
    within_loop : float
        The same, for the two sides of a single boundary loop: such as lips.

    Returns
    -------
    faces : (m, 3) int64
        With the vertices that remain; the array given if nothing was welded.
    gap : float
        The largest distance that was closed.
    """
    chosen = _whole_seams(pairs, opening, len(vertices), distance, within_loop)
    kept, to = _harmless(vertices, faces, pairs.vertices[chosen])
    if not kept.any():
        return faces, 0.0
    return to[faces], float(pairs.gaps[chosen][kept].max())


def _whole_seams(
    pairs: Pairs, opening: OpenEdges, n_vertices: int, distance: float, within_loop: float
) -> IntArray:
    """Numbers of the pairs that are within the distance, in seams that are as a whole."""
    if not (pairs.gaps <= distance).any():
        return np.zeros(0, dtype=np.int64)
    loose = np.flatnonzero(pairs.gaps <= LOOSE * distance)
    pairs = Pairs(pairs.edges[loose], pairs.vertices[loose], pairs.gaps[loose])
    ends = opening.ends[pairs.edges].reshape(-1, 2)  # (2 q, 2)
    touching = np.concatenate([ends, pairs.vertices.reshape(-1, 2)])
    labels = component_labels(touching, n_vertices)[ends[::2, 0]]  # (q,)
    _, seams, sizes = np.unique(labels, return_inverse=True, return_counts=True)
    loops = component_labels(opening.ends, n_vertices)[opening.ends[:, 0]][pairs.edges]  # (q, 2)
    lowest = np.full(len(sizes), n_vertices)
    np.minimum.at(lowest, seams, loops.min(axis=1))
    across = np.zeros(len(sizes), dtype=np.bool_)
    across[seams[loops.max(axis=1) > lowest[seams]]] = True
    near = pairs.gaps <= np.where(across[seams], distance, min(distance, within_loop))
    whole = np.bincount(seams, weights=near) >= WHOLE * sizes
    chosen: IntArray = loose[near & whole[seams]]
    return chosen


def _harmless(vertices: FloatArray, faces: IntArray, welds: IntArray) -> tuple[BoolArray, IntArray]:
    """Which pairs of edges (q,) can be welded without harm, and what each vertex (n,) becomes.

    ``welds`` (q, 2, 2) are the two pairs of vertices of each. What harms is taken back with all
    pairs at the same vertices, until nothing harms.
    """
    kept = np.ones(len(welds), dtype=np.bool_)
    same = np.arange(len(vertices))
    if len(welds) == 0:
        return kept, same
    is_touched = np.zeros(len(vertices), dtype=np.bool_)
    is_touched[welds] = True
    touched = np.flatnonzero(is_touched)
    around = faces[is_touched[faces].any(axis=1)]
    limits = 2.0 * SHARE_OF_EDGE * shortest_edges(vertices, around, touched)
    for _ in range(MOST_ROUNDS):
        to = _representatives(vertices, welds[kept].reshape(-1, 2))
        bad = _too_wide(vertices, touched, to, limits) | _collapsing(vertices, around, to)
        harmful = kept & bad[to[welds]].any(axis=(1, 2))
        if not harmful.any():
            return kept, to
        kept &= ~harmful
        if not kept.any():
            break
    return np.zeros_like(kept), same


def _representatives(vertices: FloatArray, pairs: IntArray) -> IntArray:
    """The vertex (n,) that each becomes: of those made one, the first by coordinates."""
    chosen = np.zeros(len(vertices), dtype=np.bool_)
    chosen[pairs] = True
    ids = np.flatnonzero(chosen)
    labels = component_labels((np.cumsum(chosen) - 1)[pairs], len(ids))
    order = np.lexsort((*vertices[ids].T[::-1], labels))
    first = np.ones(len(ids), dtype=np.bool_)
    first[1:] = np.diff(labels[order]) > 0
    to = np.arange(len(vertices))
    to[ids] = ids[order[first]][labels]
    return to


def _too_wide(
    vertices: FloatArray, touched: IntArray, to: IntArray, limits: FloatArray
) -> BoolArray:
    """Which representatives (n,) stand for vertices too far from them, chained by others."""
    far = np.linalg.norm(vertices[touched] - vertices[to[touched]], axis=1) > limits[touched]
    wide = np.zeros(len(vertices), dtype=np.bool_)
    wide[to[touched[far]]] = True
    return wide


def _collapsing(vertices: FloatArray, around: IntArray, to: IntArray) -> BoolArray:
    """Which representatives (n,) have faces that lose their area or fall onto each other.

    Or they have an edge that more than two faces share, and that was not one edge before.
    """
    n_vertices = len(vertices)
    bad = np.zeros(n_vertices, dtype=np.bool_)
    after = to[around]  # (f, 3)
    bad[after[degenerate_faces(vertices, after)].ravel()] = True
    corners = np.sort(after, axis=1)
    _, same, counts = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    bad[after[counts[same.reshape(-1)] > 1].ravel()] = True
    edges = directed_edges(after)
    before = edge_keys(directed_edges(around), n_vertices)
    _, group, n_faces = np.unique(
        edge_keys(edges, n_vertices), return_inverse=True, return_counts=True
    )
    group = group.reshape(-1)
    lowest = np.full(len(n_faces), n_vertices**2)
    np.minimum.at(lowest, group, before)
    several = np.zeros(len(n_faces), dtype=np.bool_)
    several[group[before > lowest[group]]] = True
    bad[edges[((n_faces > 2) & several)[group]].ravel()] = True
    return bad
