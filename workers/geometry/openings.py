"""Open edges: those of one face. What they are, and which of them could be one edge."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.edges import directed_edges, single_edges

NEIGHBOURS = 5  # an edge itself and four others; where more lie on each other, nothing is sure
SHARE_OF_EDGE = 0.25  # of the shortest edge around: vertices farther apart than this are two
FOLDED = 0.99  # cosine between two faces seen from their common edge: below 8° they are folded


@dataclass(frozen=True, eq=False)
class OpenEdges:
    """The edges that only one face has.

    Attributes
    ----------
    ends : (b, 2) int64
        Vertices, in the winding of the face.
    faces : (b,) int64
        The face of each.
    apexes : (b,) int64
        The face's third vertex.
    shortest : (b, 2) float64
        The shortest edge of any face around each end.
    """

    ends: IntArray
    faces: IntArray
    apexes: IntArray
    shortest: FloatArray

    def __len__(self) -> int:
        """Return the number of open edges."""
        return len(self.faces)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of open edges that could be one edge; each edge is in one pair at most.

    Attributes
    ----------
    edges : (q, 2) int64
        Numbers of open edges.
    vertices : (q, 2, 2) int64
        The two pairs of vertices that would become one.
    gaps : (q,) float64
        The larger distance of both.
    """

    edges: IntArray
    vertices: IntArray
    gaps: FloatArray


def open_edges(vertices: FloatArray, faces: IntArray) -> OpenEdges:
    """Find the edges that only one face has.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    faces : (m, 3) int64
        Of any winding, manifold or not.

    Returns
    -------
    OpenEdges
        All ab, then all bc, then all ca, each by face.
    """
    corners, own = single_edges(faces, len(vertices))
    start, end, apex = (faces[own, (corners + i) % 3] for i in range(3))
    ends = np.stack([start, end], axis=1)
    shortest = shortest_edges(vertices, faces, ends.ravel()) if len(ends) else np.zeros(0)
    return OpenEdges(ends, own, apex, shortest[ends])


def shortest_edges(vertices: FloatArray, faces: IntArray, at: IntArray) -> FloatArray:
    """Length of the shortest edge of any face around each vertex.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    faces : (m, 3) int64
        Of these vertices.
    at : (q,) int64
        The vertices to look at.

    Returns
    -------
    (n,) float64
        Infinite at all other vertices.
    """
    chosen = np.zeros(len(vertices), dtype=np.bool_)
    chosen[at] = True
    around = faces[chosen[faces].any(axis=1)]
    edges = directed_edges(around)
    lengths = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    shortest = np.full(len(vertices), np.inf)
    np.minimum.at(shortest, edges.ravel(), np.repeat(lengths, 2))
    shortest[~chosen] = np.inf
    return shortest


def inward(vertices: FloatArray, opening: OpenEdges) -> FloatArray:
    """Directions from open edges into their faces, across the edge.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    opening : OpenEdges
        Of faces without degenerate ones.

    Returns
    -------
    (b, 3) float64
        Of length 1.
    """
    start, end = (vertices[opening.ends[:, i]] for i in range(2))
    along = end - start
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    across = vertices[opening.apexes] - start
    across = across - along * (across * along).sum(axis=1, keepdims=True)
    unit: FloatArray = across / np.linalg.norm(across, axis=1, keepdims=True)
    return unit


def pair_edges(vertices: FloatArray, opening: OpenEdges, *, reach: float) -> Pairs:
    """Pair open edges that lie on each other along their whole length.

    They run against each other, as two faces of one winding do; where they run in the same
    direction, the faces must lie on different sides. Faces that are folded onto each other are no
    continuation of each other. Of several edges in a place those nearest to each other are paired.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    opening : OpenEdges
        Of faces without degenerate ones.
    reach : float
        Vertices farther apart are never one. Neither are those farther apart than a quarter of
        the shortest edge around them.

    Returns
    -------
    Pairs
        Each nearest to the other.
    """
    if len(opening) < 2:
        return _pairs_of(np.zeros((0, 2), dtype=np.int64), opening, np.zeros(0), np.zeros(0, bool))
    first, second = _neighbours(vertices[opening.ends].mean(axis=1), reach)
    ends = vertices[opening.ends]  # (b, 2, 3)
    against = _gaps(ends[first], ends[second][:, ::-1])
    along = _gaps(ends[first], ends[second])
    reverse = against <= along
    gaps = np.minimum(against, along)
    shortest = opening.shortest.min(axis=1)  # (b,)
    limits = np.minimum(reach, SHARE_OF_EDGE * np.minimum(shortest[first], shortest[second]))
    near = gaps <= limits
    first, second, gaps, reverse = first[near], second[near], gaps[near], reverse[near]
    into = inward(vertices, opening)
    cosines = (into[first] * into[second]).sum(axis=1)
    sound = cosines < np.where(reverse, FOLDED, 0.0)
    first, second, gaps, reverse, cosines = (
        values[sound] for values in (first, second, gaps, reverse, cosines)
    )
    mutual = _nearest_to_each_other(first, second, np.stack([cosines, gaps]), len(opening))
    pairs = np.stack([first[mutual], second[mutual]], axis=1)
    return _pairs_of(pairs, opening, gaps[mutual], reverse[mutual])


def _pairs_of(pairs: IntArray, opening: OpenEdges, gaps: FloatArray, reverse: BoolArray) -> Pairs:
    """Pairs with the vertices that they make one."""
    ends = opening.ends[pairs]  # (q, 2, 2)
    other = np.where(reverse[:, None], ends[:, 1, ::-1], ends[:, 1])  # (q, 2)
    return Pairs(pairs, np.stack([ends[:, 0], other], axis=2), gaps)


def _neighbours(middles: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Pairs of edges, the smaller number first, whose middles are near each other."""
    count = min(NEIGHBOURS, len(middles))
    _, near = cKDTree(middles).query(middles, k=count, distance_upper_bound=reach * (1 + 1e-9))
    first = np.repeat(np.arange(len(middles)), count)
    second = near.ravel()
    there = (second < len(middles)) & (second != first)
    first, second = first[there], second[there]
    keys = np.sort(np.minimum(first, second) * len(middles) + np.maximum(first, second))
    keys = keys[np.diff(keys, prepend=-1) > 0]
    low, high = np.divmod(keys, len(middles))
    return low, high


def _gaps(one: FloatArray, other: FloatArray) -> FloatArray:
    """Larger distance (q,) between the first and the second ends of two edges (q, 2, 3)."""
    gaps: FloatArray = np.sqrt(((one - other) ** 2).sum(axis=2).max(axis=1))
    return gaps


def _nearest_to_each_other(
    first: IntArray, second: IntArray, keys: FloatArray, count: int
) -> BoolArray:
    """Which pairs (q,) are the best of both their edges; the last row of keys weighs most."""
    order = np.lexsort(keys)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    best = np.full(count, len(order))
    np.minimum.at(best, first, rank)
    np.minimum.at(best, second, rank)
    mutual: BoolArray = (best[first] == rank) & (best[second] == rank)
    return mutual
