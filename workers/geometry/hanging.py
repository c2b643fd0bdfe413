"""Hanging vertices: what only divides an edge of one face, on the side of a seam, is taken out."""

from collections import defaultdict

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.degenerate import degenerate_faces

_Corners = tuple[int, int, int]


def without_hanging(
    vertices: FloatArray, faces: IntArray, candidates: IntArray, *, distance: float
) -> tuple[IntArray, int]:
    """Take out vertices that divide an edge of what was one face.

    Such a vertex has two faces, which share an edge. Their other two edges at the vertex lie on
    one line. One face without the vertex is the same surface.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions; none is moved.
    faces : (m, 3) int64
        Without degenerate or repeated ones.
    candidates : (q,) int64
        The vertices that may be taken out.
    distance : float
        Vertices farther from the line stay.

    Returns
    -------
    faces : (m - t, 3) int64
        The array given if no vertex was taken out.
    n_taken : int
        How many were, t.
    """
    if len(candidates) == 0:
        return faces, 0
    around = _Around.of(faces, candidates)
    ids = np.unique(candidates)
    waiting = ids[np.lexsort(vertices[ids].T[::-1])].tolist()
    n_taken = 0
    while waiting:  # what is taken out may leave others with two faces
        rest = [vertex for vertex in waiting if not _take_out(vertices, around, vertex, distance)]
        if len(rest) == len(waiting):
            break
        n_taken += len(waiting) - len(rest)
        waiting = rest
    return (around.changed(faces), n_taken) if n_taken else (faces, 0)


class _Around:
    """The faces around some vertices, as they change."""

    def __init__(self, faces: dict[int, _Corners]) -> None:
        self._faces = faces
        self._gone: list[int] = []
        self._of: defaultdict[int, set[int]] = defaultdict(set)
        for number, corners in faces.items():
            for corner in corners:
                self._of[corner].add(number)

    @staticmethod
    def of(faces: IntArray, candidates: IntArray) -> "_Around":
        """The faces (m, 3) that touch a candidate (q,) or one of its neighbours."""
        near = np.zeros(int(faces.max()) + 1, dtype=np.bool_)
        near[candidates] = True
        near[faces[near[faces].any(axis=1)]] = True
        numbers = np.flatnonzero(near[faces].any(axis=1))
        corners = [(a, b, c) for a, b, c in faces[numbers].tolist()]
        return _Around(dict(zip(numbers.tolist(), corners, strict=True)))

    def fan(self, vertex: int) -> _Corners | None:
        """Ends of the edge that a vertex divides, in the winding, and the corner opposite."""
        if len(self._of[vertex]) != 2:
            return None
        first, second = (_from(self._faces[number], vertex) for number in self._of[vertex])
        if first[1] == second[0]:
            first, second = second, first
        return (first[1], second[0], first[0]) if first[0] == second[1] else None

    def leaves_room(self, corners: _Corners) -> bool:
        """Whether the edge from the first to the second corner has at most one other face.

        That face has it in the other direction, and not the third corner.
        """
        a, b, c = corners
        others = [self._faces[number] for number in self._of[a] & self._of[b]]
        return len(others) <= 1 and all(
            _from(other, b)[0] == a and c not in other for other in others
        )

    def take_out(self, vertex: int, corners: _Corners) -> None:
        """Put one face in the place of the two at a vertex."""
        kept, gone = sorted(self._of.pop(vertex))
        for number in (kept, gone):
            for corner in self._faces.pop(number):
                self._of[corner].discard(number)
        self._faces[kept] = corners
        self._gone.append(gone)
        for corner in corners:
            self._of[corner].add(kept)

    def changed(self, faces: IntArray) -> IntArray:
        """All faces, those around the vertices as they are now."""
        result = faces.copy()
        result[list(self._faces)] = list(self._faces.values())
        return np.delete(result, self._gone, axis=0)


def _from(corners: _Corners, vertex: int) -> tuple[int, int]:
    """The other two corners of a face, in its winding."""
    a, b, c = corners
    return {a: (b, c), b: (c, a), c: (a, b)}[vertex]


def _take_out(vertices: FloatArray, around: _Around, vertex: int, distance: float) -> bool:
    """Take a vertex out if it only divides an edge; tell whether it does."""
    corners = around.fan(vertex)
    if corners is None or not around.leaves_room(corners):
        return False
    a, b, _ = corners
    ray, to = vertices[b] - vertices[a], vertices[vertex] - vertices[a]
    length = float(np.linalg.norm(ray))
    if length <= 2.0 * distance:
        return False
    along = float(to @ ray) / length
    off = float(np.linalg.norm(to - along * (ray / length)))
    is_between = off <= distance < along < length - distance
    if not is_between or degenerate_faces(vertices, np.array([corners])).any():
        return False
    around.take_out(vertex, corners)
    return True
