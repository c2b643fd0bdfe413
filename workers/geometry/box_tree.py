"""Trees of boxes over triangles: which of them can lie within a distance of a point.

The triangles are sorted into classes of size, and each class has its own tree. So a large triangle
among small ones does not widen the boxes of the small ones.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from workers.geometry.arrays import FloatArray, IntArray

ARITY = 4  # children a node
CLASS_BITS = 2  # triangles of one class differ by less than a factor of 2**2 in size
CLASSES = 16  # whatever is smaller than 4**-15 of the largest is in the last class
MORTON_BITS = 20  # an axis; three of them fit into an int64
MOST_PAIRS = 2_000_000  # of points and boxes at a time


@dataclass(frozen=True, eq=False)
class BoxTree:
    """Boxes of some triangles, and boxes of four boxes each, up to a single one.

    Attributes
    ----------
    triangles : (t,) int64
        Number of each triangle, in the order of the leaves.
    centres : cKDTree
        Of the mean corners, in the same order.
    levels : tuple of (b, 2, 3) float64
        Smallest and largest coordinates of the boxes; the first level has one box, the last t.
        Children of box i of a level are the boxes 4 i to 4 i + 3 of the next, as far as they exist.
    """

    triangles: IntArray
    centres: cKDTree
    levels: tuple[FloatArray, ...]

    def nearest_centres(self, points: FloatArray) -> IntArray:
        """Find the triangle whose mean corner is nearest to each point.

        Parameters
        ----------
        points : (p, 3) float64
            Anywhere.

        Returns
        -------
        (p,) int64
            Numbers of triangles.
        """
        places = np.asarray(self.centres.query(points)[1], dtype=np.int64)
        return self.triangles[places]

    def within(
        self, points: FloatArray, squared_radii: FloatArray
    ) -> Iterator[tuple[IntArray, IntArray]]:
        """Find all triangles whose box reaches into a ball around each point.

        Parameters
        ----------
        points : (p, 3) float64
            Middles of the balls.
        squared_radii : (p,) float64
            Of the ball around each point.

        Yields
        ------
        point, triangle : (q,) int64
            Pairs, a few million at most at a time; all pairs of one point come together.
        """
        waiting = [(0, np.arange(len(points)), np.zeros(len(points), dtype=np.int64))]
        while waiting:
            level, point, box = waiting.pop()
            inside = _squared_distances(points[point], self.levels[level][box])
            reached = inside <= squared_radii[point]
            point, box = point[reached], box[reached]
            if level == len(self.levels) - 1:
                yield point, self.triangles[box]
                continue
            for part in _portions(point):
                child = (ARITY * box[part, None] + np.arange(ARITY)).ravel()
                parent = np.repeat(point[part], ARITY)
                exists = child < len(self.levels[level + 1])
                waiting.append((level + 1, parent[exists], child[exists]))


def box_trees(corners: FloatArray) -> list[BoxTree]:
    """Build one tree for each class of size, the largest triangles first.

    Parameters
    ----------
    corners : (m, 3, 3) float64
        Of each triangle, finite.

    Returns
    -------
    list of BoxTree
        Of at most 16 trees; each triangle is in one of them.
    """
    boxes = np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)  # (m, 2, 3)
    sizes = (boxes[:, 1] - boxes[:, 0]).max(axis=1)  # (m,)
    exponents = np.frexp(sizes)[1]
    classes = np.minimum((exponents.max() - exponents) // CLASS_BITS, CLASSES - 1)
    order = np.lexsort((_morton_codes(corners.mean(axis=1)), classes))
    ends = np.flatnonzero(np.diff(classes[order])) + 1
    return [
        BoxTree(members, cKDTree(corners[members].mean(axis=1)), _levels(boxes[members]))
        for members in np.split(order, ends)
    ]


def _levels(boxes: FloatArray) -> tuple[FloatArray, ...]:
    """Boxes of the leaves, and above them those of four boxes each; the root comes first."""
    levels = [boxes]
    while len(levels[0]) > 1:
        starts = np.arange(0, len(levels[0]), ARITY)
        low = np.minimum.reduceat(levels[0][:, 0], starts, axis=0)
        high = np.maximum.reduceat(levels[0][:, 1], starts, axis=0)
        levels.insert(0, np.stack([low, high], axis=1))
    return tuple(levels)


def _morton_codes(positions: FloatArray) -> IntArray:
    """Places (n,) along a curve that keeps near positions (n, 3) near: bits interleaved."""
    low = positions.min(axis=0)
    extent = float((positions.max(axis=0) - low).max()) or 1.0
    cells = ((positions - low) * ((2**MORTON_BITS - 1) / extent)).astype(np.int64)  # (n, 3)
    codes = np.zeros(len(positions), dtype=np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            codes |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return codes


def _squared_distances(points: FloatArray, boxes: FloatArray) -> FloatArray:
    """Squared distance (q,) of each point (q, 3) to its box (q, 2, 3); 0 inside."""
    gaps = np.maximum(np.maximum(boxes[:, 0] - points, points - boxes[:, 1]), 0.0)  # (q, 3)
    squared: FloatArray = gaps[:, 0] ** 2 + gaps[:, 1] ** 2 + gaps[:, 2] ** 2
    return squared


def _portions(points: IntArray) -> list[slice]:
    """Cut a list of pairs, sorted by point, so that one point's children stay together.

    A portion has at most 500,000 pairs, or those of a single point.
    """
    most = MOST_PAIRS // ARITY
    cuts = [0]
    while len(points) - cuts[-1] > most:
        first = int(points[cuts[-1]])
        last = int(points[cuts[-1] + most])
        after = last if last > first else first + 1
        cuts.append(int(np.searchsorted(points, after)))
    cuts.append(len(points))
    return [slice(a, b) for a, b in pairwise(cuts) if b > a]
