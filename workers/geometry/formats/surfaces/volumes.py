"""The boundary surface of volume cells: the faces that one cell alone has."""

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.formats.text.tokens import Polygons

NONE = -1
# Faces of each type by VTK's number. Their winding is set by the cell's middle, because writers
# do not agree on the order of a wedge's corners.
FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    10: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    12: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    13: ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    14: ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
for _kind, _sides in ((15, 5), (16, 6)):  # pentagonal and hexagonal prism
    _base = tuple(range(_sides))
    FACES[_kind] = (
        _base,
        tuple(corner + _sides for corner in _base),
        *((i, (i + 1) % _sides, (i + 1) % _sides + _sides, i + _sides) for i in _base),
    )
VOLUME_CORNERS = {10: 4, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12}


def boundary_faces(
    vertices: FloatArray, cells: dict[int, IntArray], faces: Polygons
) -> tuple[Polygons, int]:
    """Faces that belong to one cell, wound so that they look outwards, and the faces beside them.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions.
    cells : dict of (c, k) int64
        Corners of the volume cells by VTK's type; all of them are vertices.
    faces : Polygons
        Surface cells of the same file; all corners are vertices.

    Returns
    -------
    surface : Polygons
        Boundary faces of the volume cells, then those of ``faces`` that no volume cell has.
    n_left_out : int
        How many of ``faces`` are faces of a volume cell.
    """
    sides: dict[int, list[tuple[IntArray, FloatArray]]] = {}
    for kind, table in cells.items():
        with np.errstate(invalid="ignore", over="ignore"):  # points may be infinite
            middles = vertices[table].mean(axis=1)  # (c, 3)
        for face in FACES[kind]:
            sides.setdefault(len(face), []).append((table[:, face], middles))
    size = max(sides)
    small = np.flatnonzero((faces.counts >= 3) & (faces.counts <= size))
    own, n_own = _padded(faces, small, size)
    of_volumes = [
        np.pad(corners.astype(np.int32), ((0, 0), (0, size - n)), constant_values=NONE)
        for n, parts in sides.items()
        for corners, _ in parts
    ]
    keys = _keys(np.concatenate([*of_volumes, own]), len(vertices))
    split = len(keys) - n_own
    single, known = _single(keys[:split], keys[split:])
    kept = np.ones(len(faces.counts), dtype=bool)
    kept[small[known]] = False
    boundary = _outwards(vertices, sides, single)
    rest = Polygons(faces.counts[kept], faces.corners[np.repeat(kept, faces.counts)])
    surface = Polygons(
        np.concatenate([*(np.full(len(b), b.shape[1]) for b in boundary), rest.counts]),
        np.concatenate([*(b.ravel() for b in boundary), rest.corners]),
    )
    return surface, int(known.sum())


def _padded(faces: Polygons, rows: IntArray, size: int) -> tuple[NDArray[np.int32], int]:
    """Corners (r, size) of some polygons, filled up with -1, and how many they are."""
    starts = (np.cumsum(faces.counts) - faces.counts)[rows]
    columns = np.arange(size)
    places = starts[:, None] + columns
    inside = columns < faces.counts[rows][:, None]
    corners = faces.corners[np.where(inside, places, 0)] if len(rows) else np.zeros_like(places)
    return np.where(inside, corners, NONE).astype(np.int32), len(rows)


def _keys(corners: NDArray[np.int32], n_vertices: int) -> IntArray:
    """Faces (f, k) as rows that are equal where the sets of corners are, two corners a number."""
    ordered = np.sort(corners, axis=1)
    twice = ordered[:, 1:] == ordered[:, :-1]
    if twice.any():  # a quad with a corner twice is a triangle
        ordered[:, 1:][twice] = NONE
        ordered.sort(axis=1)
    if ordered.shape[1] % 2:
        ordered = np.pad(ordered, ((0, 0), (1, 0)), constant_values=NONE)
    pairs = ordered.reshape(len(ordered), -1, 2).astype(np.int64) + 1
    keys: IntArray = pairs[:, :, 0] * (n_vertices + 1) + pairs[:, :, 1]  # below 2**63
    return keys


def _single(volume: IntArray, own: IntArray) -> tuple[BoolArray, BoolArray]:
    """Which faces of volumes come once, and which other faces are among those of volumes."""
    keys = np.concatenate([volume, own])
    order = np.lexsort(keys.T)
    ordered = keys[order]
    new = np.ones(len(keys), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    group = np.empty(len(keys), dtype=np.int64)
    group[order] = np.cumsum(new) - 1
    times = np.bincount(group[: len(volume)], minlength=int(new.sum()))
    return times[group[: len(volume)]] == 1, times[group[len(volume) :]] > 0


def _outwards(
    vertices: FloatArray, sides: dict[int, list[tuple[IntArray, FloatArray]]], single: BoolArray
) -> list[IntArray]:
    """Faces marked as single, turned away from the middle of their cell, a table a size."""
    tables = []
    start = 0
    for parts in sides.values():
        corners = np.concatenate([part for part, _ in parts])
        middles = np.concatenate([middle for _, middle in parts])
        chosen = single[start : start + len(corners)]
        start += len(corners)
        corners, middles = corners[chosen], middles[chosen]
        points = vertices[corners]  # (f, k, 3)
        with np.errstate(invalid="ignore", over="ignore"):  # points may be infinite
            around = points - points[:, :1]
            normals = np.cross(around[:, 1:-1], around[:, 2:]).sum(axis=1)  # (f, 3)
            inwards = (normals * (points.mean(axis=1) - middles)).sum(axis=1) < 0
        corners[inwards] = corners[inwards, ::-1]
        tables.append(corners)
    return tables
