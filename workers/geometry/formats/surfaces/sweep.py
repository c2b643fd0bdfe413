"""Triangles of a large polygon in the plane, by a sweep: n log n, whatever its shape.

A line sweeps from top to bottom and cuts the polygon by diagonals into pieces that are monotone:
each horizontal line meets such a piece once. A monotone piece is cut into triangles in one walk
(de Berg et al., Computational Geometry, chapter 3).
"""

from bisect import bisect_left
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray

BLOCK = 512  # edges of one block of the ordered list


class NotSimpleError(Exception):
    """The sides of the polygon cross, so that a sweep loses its way."""


def sweep_triangles(points: FloatArray, *, opening: float = 1e-9) -> IntArray:
    """Cut a polygon into triangles by diagonals.

    Sides may touch, as the two sides of a slit that leads to a hole do: every corner is moved
    inwards a little, and so they part.

    Parameters
    ----------
    points : (n, 2) float64
        Corners against the clock; neighbours are not in the same place.
    opening : float
        How far corners are moved, in units of the polygon's extent.

    Returns
    -------
    (n - 2, 3) int64
        Corners of each triangle, against the clock.

    Raises
    ------
    NotSimpleError
        The sides cross.
    """
    opened = _opened(points, opening)
    order = np.lexsort((opened[:, 0], -opened[:, 1]))  # from the top, then from the left
    rank = np.empty(len(points), dtype=np.int64)
    rank[order] = np.arange(len(points))
    diagonals = _Sweep(opened.tolist(), rank.tolist()).diagonals(order.tolist())
    ranks, positions = rank.tolist(), opened.tolist()
    triangles: list[tuple[int, int, int]] = []
    for piece in _pieces(opened, diagonals):
        _cut_monotone(piece, positions, ranks, triangles)
    if len(triangles) != len(points) - 2:
        raise NotSimpleError
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _opened(points: FloatArray, opening: float) -> FloatArray:
    """Corners (n, 2) moved inwards, in units of the polygon's extent."""
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max())
    unit = (points - low) / extent  # (n, 2)
    sides = np.roll(unit, -1, axis=0) - unit
    sides /= np.hypot(sides[:, 0], sides[:, 1])[:, None]  # of length 1
    inward = np.stack([-sides[:, 1], sides[:, 0]], axis=1)  # (n, 2), left of each side
    sums = inward + np.roll(inward, 1, axis=0)
    lengths = np.hypot(sums[:, 0], sums[:, 1])
    turned = lengths < 1e-6  # the way goes back on itself: the tip of a slit
    directions = np.where(turned[:, None], -sides, sums / np.where(turned, 1.0, lengths)[:, None])
    return np.asarray(unit + opening * directions, dtype=np.float64)


@dataclass
class _Sweep:
    """The sweep; an edge is named by the corner that it starts from."""

    points: list[list[float]]
    rank: list[int]  # of each corner, from the top
    helper: dict[int, int] = field(default_factory=dict)  # lowest corner right of a left edge
    merging: set[int] = field(default_factory=set)  # corners at which two pieces become one
    cuts: list[tuple[int, int]] = field(default_factory=list)

    def diagonals(self, order: list[int]) -> list[tuple[int, int]]:
        """Pairs of corners that cut the polygon into monotone pieces."""
        status = _OrderedEdges(self.points)
        n, rank = len(order), self.rank
        for v in order:
            before, after = v - 1 if v else n - 1, v + 1 if v + 1 < n else 0
            from_above, to_above = rank[before] < rank[v], rank[after] < rank[v]
            if from_above:  # the side before v is a left edge that ends
                self._connect(v, self.helper.pop(before, None))
                status.remove(before, v)
            if from_above != to_above:
                if from_above:
                    self._begin(status, v)
                else:
                    self._help(status, v)
                continue
            is_convex = _turn(self.points[before], self.points[v], self.points[after]) > 0
            if is_convex:
                if not from_above:
                    self._begin(status, v)
                continue
            if from_above:
                self._help(status, v)
                self.merging.add(v)
            else:
                left = status.left_of(v)
                self._cut(v, self.helper[left])
                self.helper[left] = v
                self._begin(status, v)
        return self.cuts

    def _begin(self, status: "_OrderedEdges", v: int) -> None:
        """Take up the left edge that starts at v."""
        status.insert(v)
        self.helper[v] = v

    def _help(self, status: "_OrderedEdges", v: int) -> None:
        """Let v be the helper of the edge left of it."""
        left = status.left_of(v)
        self._connect(v, self.helper[left])
        self.helper[left] = v

    def _connect(self, v: int, helper: int | None) -> None:
        """Draw the diagonal that a merging helper waits for."""
        if helper is None:
            raise NotSimpleError
        if helper in self.merging:
            self._cut(v, helper)

    def _cut(self, v: int, other: int) -> None:
        """Draw a diagonal."""
        if abs(v - other) in (0, 1, len(self.points) - 1):
            raise NotSimpleError
        self.cuts.append((v, other))


class _OrderedEdges:
    """Left edges that the sweep line meets, from left to right, in blocks."""

    def __init__(self, points: list[list[float]]) -> None:
        self._points = points
        self._blocks: list[list[int]] = [[]]

    def insert(self, v: int) -> None:
        """Add the edge that starts at v."""
        block, place = self._place(v, v)
        edges = self._blocks[block]
        edges.insert(place, v)
        if len(edges) > 2 * BLOCK:
            self._blocks[block : block + 1] = [edges[:BLOCK], edges[BLOCK:]]

    def remove(self, edge: int, v: int) -> None:
        """Take out the edge that ends at v."""
        block, place = self._place(v, edge)
        edges = self._blocks[block]
        if place >= len(edges) or edges[place] != edge:
            raise NotSimpleError
        del edges[place]
        if not edges and len(self._blocks) > 1:
            del self._blocks[block]

    def left_of(self, v: int) -> int:
        """Nearest edge on the left of corner v."""
        block, place = self._place(v, -1)
        if place:
            return self._blocks[block][place - 1]
        if block:
            return self._blocks[block - 1][-1]
        raise NotSimpleError

    def _place(self, v: int, own: int) -> tuple[int, int]:
        """Block and place of the first edge that is not left of v; ``own`` is the edge at v."""
        point = self._points[v]

        def is_right(edge: int) -> bool:
            if edge == own:
                return True
            end = self._points[edge + 1] if edge + 1 < len(self._points) else self._points[0]
            return _turn(self._points[edge], end, point) <= 0

        block = 0
        if len(self._blocks) > 1:
            block = bisect_left(self._blocks, True, key=lambda edges: is_right(edges[-1]))
            block = min(block, len(self._blocks) - 1)
        return block, bisect_left(self._blocks[block], True, key=is_right)


def _turn(a: list[float], b: list[float], c: list[float]) -> float:
    """Twice the signed area of a triangle: positive where c is left of the way from a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _pieces(points: FloatArray, diagonals: list[tuple[int, int]]) -> list[list[int]]:
    """Polygons (lists of corners) into which the diagonals cut a polygon."""
    n = len(points)
    if not diagonals:
        return [list(range(n))]
    pairs = np.array(diagonals, dtype=np.int64)  # (d, 2)
    sides = np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1)
    ways = np.concatenate([sides, pairs, pairs[:, ::-1]])  # (w, 2), with the inside on the left
    d = len(pairs)
    back = np.concatenate([np.full(n, -1), n + d + np.arange(d), n + np.arange(d)])
    # From a way into v goes on the next way out of v against the clock from the way back.
    offsets = points[ways[:, 1]] - points[ways[:, 0]]
    before = points[(ways[:, 0] - 1) % n] - points[ways[:, 0]]
    angles = np.arctan2(offsets[:, 1], offsets[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    angles = np.mod(angles, 2.0 * np.pi)  # from the side before, so that the outside comes last
    order = np.lexsort((-angles, ways[:, 0]))  # clockwise from the side before
    following = np.full(len(ways), -1)
    same = ways[order[1:], 0] == ways[order[:-1], 0]
    # Clockwise neighbour of a way out, after which the way in along it continues.
    clockwise = np.full(len(ways), -1)
    clockwise[order[:-1][same]] = order[1:][same]
    first = np.searchsorted(ways[order, 0], np.arange(n))
    following[:n] = order[first[ways[:n, 1]]]  # after a side: the first one clockwise from it
    following[n:] = clockwise[back[n:]]
    return _loops(ways[:, 0].tolist(), following.tolist())


def _loops(origins: list[int], following: list[int]) -> list[list[int]]:
    """Closed walks along ways, each as the corners it starts from."""
    seen = bytearray(len(origins))
    loops = []
    for start in range(len(origins)):
        if seen[start]:
            continue
        loop = []
        way = start
        while not seen[way]:
            seen[way] = 1
            loop.append(origins[way])
            way = following[way]
            if way < 0:
                raise NotSimpleError
        if way != start:
            raise NotSimpleError
        loops.append(loop)
    return loops


def _cut_monotone(
    piece: list[int],
    points: list[list[float]],
    rank: list[int],
    triangles: list[tuple[int, int, int]],
) -> None:
    """Add the triangles of a piece that each horizontal line meets once."""
    n = len(piece)
    if n == 3:
        triangles.append((piece[0], piece[1], piece[2]))
        return
    if n < 3:
        raise NotSimpleError
    ranks = [rank[corner] for corner in piece]
    top, bottom = ranks.index(min(ranks)), ranks.index(max(ranks))
    # Against the clock the way down from the top is the left chain.
    is_left = {piece[i % n] for i in range(top, bottom + (n if bottom < top else 0))}
    corners = sorted(piece, key=rank.__getitem__)
    stack = corners[:2]
    for corner in corners[2:-1]:
        left = corner in is_left
        if (stack[-1] in is_left) != left:
            for upper, lower in pairwise(stack):
                triangles.append((corner, lower, upper) if left else (corner, upper, lower))
            stack = [stack[-1], corner]
            continue
        last = stack.pop()
        while stack:
            a, b, c = (stack[-1], last, corner) if left else (corner, last, stack[-1])
            if not _turn(points[a], points[b], points[c]) > 0:
                break
            triangles.append((a, b, c))
            last = stack.pop()
        stack += [last, corner]
    end = corners[-1]
    for upper, lower in pairwise(stack):
        left = lower in is_left
        triangles.append((upper, lower, end) if left else (lower, upper, end))
