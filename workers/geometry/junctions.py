"""T-junctions: a vertex of one open edge lies inside another one, whose face is split there."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.edges import component_labels
from workers.geometry.openings import FOLDED, SHARE_OF_EDGE, OpenEdges, inward
from workers.geometry.splitting import Splits, split_faces

LOOSE = 10.0  # two edges that come apart more slowly than this are a slit, no junction
SLOW = 0.25  # times as far apart as they are long
MOST_SLITS = 0.1  # of the pieces that are closed
FROM_ENDS = 4.0  # distances between the vertex and the ends of the edge that it lies on
NEIGHBOURS = 4
MOST_EDGES = 300_000  # for which near vertices are sought
MOST_AT_VERTEX = 16  # open edges: where more meet, nothing is sure
MOST_ROUNDS = 1_000  # vertices on one edge, counted from both its ends


@dataclass(frozen=True, eq=False)
class Junctions:
    """Faces after edges were split.

    Attributes
    ----------
    faces : (m + s, 3) int64
        The pieces of a face take its place.
    vertices : tuple of lists of int
        For each edge that was split, the vertices on it.
    """

    faces: IntArray
    vertices: tuple[list[int], ...]


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Open edges, cut into pieces.

    Attributes
    ----------
    ends : (p, 2) int64
        Vertices, in the winding of the face.
    parents : (p,) int64
        The open edge that each is a piece of.
    partners : (p,) int64
        The piece that runs the other way between the same vertices, or -1.
    """

    ends: IntArray
    parents: IntArray
    partners: IntArray

    def cut(self, pieces: IntArray, vertices: IntArray) -> "_Pieces":
        """Cut some pieces in two, each at a vertex."""
        ends = self.ends.copy()
        rest = np.stack([vertices, ends[pieces, 1]], axis=1)
        ends[pieces, 1] = vertices
        return _Pieces(
            np.concatenate([ends, rest]),
            np.concatenate([self.parents, self.parents[pieces]]),
            np.concatenate([self.partners, np.full(len(pieces), -1)]),
        )

    def without(self, excluded: BoolArray) -> "_Pieces":
        """Take the partners from some pieces, and those pieces from their partners."""
        partners = np.where(excluded | excluded[self.partners], -1, self.partners)
        return _Pieces(self.ends, self.parents, partners)


def split_at_junctions(
    vertices: FloatArray, faces: IntArray, opening: OpenEdges, *, distance: float
) -> Junctions:
    """Split the faces of open edges where vertices of other open edges lie on them.

    Two open edges may meet in a vertex and run along each other. Then the longer one is split at
    the end of the shorter one, and so on along both. Where they come apart slowly they are the
    two sides of a slit, and stay as they are.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions; none is moved.
    faces : (m, 3) int64
        Without degenerate or repeated ones.
    opening : OpenEdges
        Of these faces.
    distance : float
        Vertices farther from an edge do not lie on it.

    Returns
    -------
    Junctions
        With the array of faces given if nothing was split.
    """
    if len(opening) < 3:
        return Junctions(faces, ())
    splitter = _Splitter(vertices, opening, distance)
    pieces = splitter.pieces()
    excluded = np.zeros(len(opening), dtype=np.bool_)
    while len(pieces.parents) > len(opening):
        splits = splitter.useful(pieces, excluded)
        if not splits:
            break
        split = split_faces(vertices, faces, opening, splits)
        if not len(split.harmful):
            return Junctions(split.faces, tuple(splits.values()))
        excluded |= np.isin(opening.faces, split.harmful)
    return Junctions(faces, ())


class _Splitter:
    """Finds the vertices at which each open edge is to be split."""

    def __init__(self, vertices: FloatArray, opening: OpenEdges, distance: float) -> None:
        self._vertices = vertices
        self._opening = opening
        self._distance = distance
        self._inward = inward(vertices, opening)
        self._names = self._near_vertices()
        self._shortest = np.full(len(vertices), np.inf)
        self._shortest[opening.ends] = opening.shortest

    def pieces(self) -> _Pieces:
        """Open edges, cut wherever another one ends that runs along them."""
        b = len(self._opening)
        pieces = _Pieces(self._opening.ends, np.arange(b), np.full(b, -1))
        pieces = self._closed(pieces)
        for _ in range(MOST_ROUNDS):
            cut, at = self._junctions(pieces, self._distance)
            if len(cut) == 0:
                break
            pieces = self._closed(pieces.cut(cut, at))
        return pieces

    def _near_vertices(self) -> IntArray:
        """One name (n,) for vertices of open edges that are within the distance."""
        names = np.arange(len(self._vertices))
        if len(self._opening) > MOST_EDGES:
            return names
        ids, place = np.unique(self._opening.ends, return_index=True)
        limits = np.minimum(self._distance, SHARE_OF_EDGE * self._opening.shortest.ravel()[place])
        count = min(NEIGHBOURS, len(ids))
        positions = self._vertices[ids]
        apart, near = cKDTree(positions).query(
            positions, k=count, distance_upper_bound=self._distance * (1 + 1e-9)
        )
        first, second = np.repeat(np.arange(len(ids)), count), near.ravel()
        there = second < len(ids)
        first, second, apart = first[there], second[there], np.ravel(apart)[there]
        one = apart <= np.minimum(limits[first], limits[second])
        labels = component_labels(np.stack([first[one], second[one]], axis=1), len(ids))
        names[ids] = ids[np.unique(labels, return_index=True)[1]][labels]
        return names

    def _closed(self, pieces: _Pieces) -> _Pieces:
        """Find partners for pieces that have none yet."""
        alone = np.flatnonzero(pieces.partners < 0)
        names = self._names[pieces.ends[alone]]  # (q, 2)
        n = len(self._vertices)
        ahead, back = names @ np.array([n, 1]), names @ np.array([1, n])
        keys, first, own, counts = np.unique(
            ahead, return_index=True, return_inverse=True, return_counts=True
        )
        place = np.minimum(np.searchsorted(keys, back), len(keys) - 1)
        other = first[place]
        single = (counts[place] == 1) & (counts[own.reshape(-1)] == 1)
        found = (keys[place] == back) & single
        partners = pieces.partners.copy()
        partners[alone[found]] = alone[other[found]]
        return _Pieces(pieces.ends, pieces.parents, partners)

    def _meeting(self, pieces: _Pieces) -> tuple[IntArray, IntArray]:
        """Pairs of pieces without partners of which the first starts where the second ends."""
        alone = np.flatnonzero(pieces.partners < 0)
        starts, ends = self._names[pieces.ends[alone]].T
        order = np.argsort(ends, kind="stable")
        low = np.searchsorted(ends[order], starts, side="left")
        counts = np.searchsorted(ends[order], starts, side="right") - low
        counts[counts > MOST_AT_VERTEX] = 0
        first = np.repeat(np.arange(len(alone)), counts)
        offsets = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        second = order[np.repeat(low, counts) + offsets]
        other_face = pieces.parents[alone[first]] != pieces.parents[alone[second]]
        return alone[first[other_face]], alone[second[other_face]]

    def _junctions(self, pieces: _Pieces, distance: float) -> tuple[IntArray, IntArray]:
        """Pieces (q,) that other pieces end inside of, and the vertices (q,) where they end."""
        meeting = _Meeting.of(self._vertices, pieces, *self._meeting(pieces))
        parents = pieces.parents[meeting.longer], pieces.parents[meeting.shorter]
        cosines = (self._inward[parents[0]] * self._inward[parents[1]]).sum(axis=1)
        margin = np.maximum(FROM_ENDS * distance, SHARE_OF_EDGE * self._shortest[meeting.tip])
        inside = (meeting.along >= margin) & (meeting.length - meeting.along >= margin)
        apex = self._opening.apexes[parents[0]]
        sound = (cosines < FOLDED) & (apex != meeting.tip)
        chosen = np.flatnonzero((meeting.off <= distance) & inside & sound)
        order = np.lexsort((meeting.off[chosen], meeting.along[chosen], meeting.longer[chosen]))
        chosen = chosen[order]
        _, first = np.unique(meeting.longer[chosen], return_index=True)
        return meeting.longer[chosen[first]], meeting.tip[chosen[first]]

    def useful(self, pieces: _Pieces, excluded: BoolArray) -> Splits:
        """Cuts next to pieces that have a partner, by open edge; none along slits.

        The open edges that are ``excluded`` (b,) are not cut, so their pieces close nothing.
        """
        b = len(self._opening)
        several = np.bincount(pieces.parents, minlength=b) > 1
        pieces = pieces.without((excluded & several)[pieces.parents])
        closed = np.flatnonzero(pieces.partners >= 0)
        partners = pieces.parents[pieces.partners[closed]]
        seams = component_labels(np.stack([pieces.parents[closed], partners], axis=1), b)
        meeting = _Meeting.of(self._vertices, pieces, *self._meeting(pieces))
        slow = meeting.off <= np.minimum(LOOSE * self._distance, SLOW * meeting.along)
        slits = np.bincount(seams[pieces.parents[meeting.longer[slow]]], minlength=b)
        closings = np.bincount(seams[pieces.parents[closed]], minlength=b) / 2
        sewn = slits <= MOST_SLITS * closings  # by seam
        chosen = np.flatnonzero((several & ~excluded & sewn[seams])[pieces.parents])
        origins = self._vertices[self._opening.ends[pieces.parents[chosen], 0]]
        starts = self._vertices[pieces.ends[chosen, 0]]
        order = np.lexsort((((starts - origins) ** 2).sum(axis=1), pieces.parents[chosen]))
        chosen = chosen[order]
        splits: Splits = {}
        for before, after in pairwise(chosen.tolist()):
            parent = int(pieces.parents[after])
            if pieces.parents[before] == parent and (pieces.partners[[before, after]] >= 0).any():
                splits.setdefault(parent, []).append(int(pieces.ends[after, 0]))
        return splits


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Pairs of pieces that meet in a vertex: where the tip of the shorter lies along the longer.

    Attributes
    ----------
    longer, shorter : (q,) int64
        Pieces.
    tip : (q,) int64
        The other end of the shorter one.
    along, off : (q,) float64
        Of the tip: its distance along the longer one from where they meet, and from its line.
    length : (q,) float64
        Of the longer one.
    """

    longer: IntArray
    shorter: IntArray
    tip: IntArray
    along: FloatArray
    off: FloatArray
    length: FloatArray

    @staticmethod
    def of(vertices: FloatArray, pieces: _Pieces, first: IntArray, second: IntArray) -> "_Meeting":
        """Pairs of which the first starts where the second ends."""
        origins = np.stack([pieces.ends[first, 0], pieces.ends[second, 1]])  # (2, q)
        tips = np.stack([pieces.ends[first, 1], pieces.ends[second, 0]])  # (2, q)
        rays = vertices[tips] - vertices[origins]  # (2, q, 3)
        lengths = np.linalg.norm(rays, axis=2)  # (2, q)
        second_longer = lengths[1] > lengths[0]
        longer, pair = second_longer.astype(np.int64), np.arange(len(first))
        length = lengths[longer, pair]
        axis = rays[longer, pair] / length[:, None]
        tip = tips[1 - longer, pair]
        ray = vertices[tip] - vertices[origins[longer, pair]]
        along = (ray * axis).sum(axis=1)
        off = np.linalg.norm(ray - along[:, None] * axis, axis=1)
        both = np.stack([first, second])
        return _Meeting(both[longer, pair], both[1 - longer, pair], tip, along, off, length)
