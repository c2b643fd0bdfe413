"""A z-buffer in numpy: which face is seen at each pixel."""

from collections.abc import Iterator

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray

# Chosen, not measured.
_BLOCK = 1 << 16  # faces in work at a time
_BUDGET = 1.2e7  # pixels covered by all faces together; beyond it faces are left out evenly


def rasterise(screen: FloatArray, faces: IntArray, pixels: int) -> tuple[IntArray, FloatArray]:
    """Find the nearest face at each pixel of a square picture.

    Parameters
    ----------
    screen : (n, 3) float64
        Vertices in pixels, x to the right and y along the rows; the larger z is nearer.
    faces : (m, 3) int64
        Vertex indices.
    pixels : int
        p, of each side of the picture.

    Returns
    -------
    nearest : (p²,) int64
        The face at each pixel's centre, row by row; -1 for none.
    weights : (p², 3) float64
        Barycentric weights of its corners there.
    """
    height = np.full(pixels * pixels, -np.inf)
    nearest = np.full(pixels * pixels, -1, dtype=np.int64)
    for block in _blocks(screen, faces):
        corners = screen[faces[block]]  # (b, 3, 3)
        edges, area = _edge_functions(corners)
        rows, which = _rows(corners, area, pixels)  # (r,), (r,)
        edges = edges[which]  # (r, 3, 3)
        first, last = _spans(edges, rows, pixels)  # (r,), (r,)
        row, column = _ranges(first, last)  # (q,) which row, and the column
        x, y = column + 0.5, (rows + 0.5).take(row)
        level = np.zeros(len(row))
        for corner in range(3):  # each sum in this order: it decides the last bits
            along, across, rest = edges[:, corner].T.copy()  # (r,) each
            weight = along.take(row)
            weight *= x
            across = across.take(row)
            across *= y
            weight += across
            weight += rest.take(row)
            weight *= corners[:, corner, 2].take(which).take(row)
            level += weight
        cell = (rows * pixels).take(row) + column
        np.maximum.at(height, cell, level)
        won = level >= height[cell]
        nearest[cell[won]] = block[which[row[won]]]
    hit = np.flatnonzero(nearest >= 0)
    drawn, place = distinct(nearest[hit], len(faces))
    edges, _ = _edge_functions(screen[faces[drawn]])
    x, y = hit % pixels + 0.5, hit // pixels + 0.5
    weights = np.zeros((pixels * pixels, 3))
    for corner in range(3):
        along, across, rest = (edges[:, corner, i].take(place) for i in range(3))
        weights[hit, corner] = np.clip(along * x + across * y + rest, 0.0, 1.0)
    return nearest, weights


def distinct(numbers: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Find which of the numbers below a count there are, faster than by sorting them.

    Parameters
    ----------
    numbers : (q,) int64
        From 0 to below the count.
    count : int
        Above all numbers.

    Returns
    -------
    found : (u,) int64
        Each number once, ascending.
    place : (q,) int64
        Where each stands among those: ``found[place]`` are the numbers.
    """
    there = np.zeros(count, dtype=np.bool_)
    there[numbers] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1)[numbers]


def _blocks(screen: FloatArray, faces: IntArray) -> Iterator[IntArray]:
    """Face numbers in parts that fit into memory; a part of the faces if they cover too much."""
    costs = []
    for start in range(0, len(faces), _BLOCK):
        corners = screen[faces[start : start + _BLOCK]]
        costs.append(np.abs(_doubled_areas(corners)) / 2 + np.ptp(corners[:, :, 1], axis=1) + 1)
    cost = np.concatenate(costs) if costs else np.zeros(0)  # (m,) about the pixels covered
    step = max(1, int(np.ceil(cost.sum() / _BUDGET)))
    kept = np.arange(0, len(faces), step)
    parts = np.cumsum(cost[kept]) // 1e6 + np.arange(len(kept)) // _BLOCK  # grows
    yield from np.split(kept, np.flatnonzero(np.diff(parts)) + 1)


def _doubled_areas(corners: FloatArray) -> FloatArray:
    """Twice the signed areas in the picture, (b,)."""
    a, b, c = (corners[:, i, :2] for i in range(3))
    areas: FloatArray = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return areas


def _edge_functions(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Barycentric weight of each corner as a x + b y + c, (b, 3, 3), and doubled areas (b,)."""
    area = _doubled_areas(corners)
    area = np.where(np.abs(area) < 1e-9, np.inf, area)  # seen as a line: weights are 0
    start, end = corners[:, [1, 2, 0], :2], corners[:, [2, 0, 1], :2]
    slope_x, slope_y = start[:, :, 1] - end[:, :, 1], end[:, :, 0] - start[:, :, 0]  # (b, 3)
    constant = -(slope_x * start[:, :, 0] + slope_y * start[:, :, 1])
    return np.stack([slope_x, slope_y, constant], axis=2) / area[:, None, None], area


def _rows(corners: FloatArray, area: FloatArray, pixels: int) -> tuple[IntArray, IntArray]:
    """Rows of pixel centres that each face meets, (r,), and the face of each, (r,)."""
    first = np.clip(np.ceil(corners[:, :, 1].min(axis=1) - 0.5), 0, pixels)
    last = np.clip(np.floor(corners[:, :, 1].max(axis=1) - 0.5), -1, pixels - 1)
    last = np.where(np.isfinite(area), last, first - 1)
    which, rows = _ranges(first.astype(np.int64), last.astype(np.int64))
    return rows, which


def _spans(edges: FloatArray, rows: IntArray, pixels: int) -> tuple[IntArray, IntArray]:
    """First and last column whose centre has three weights of at least 0, (r,) and (r,)."""
    slope = edges[:, :, 0]  # (r, 3)
    rest = edges[:, :, 1] * (rows[:, None] + 0.5) + edges[:, :, 2]  # (r, 3)
    flat = np.abs(slope) < 1e-12
    crossing = -rest / np.where(flat, 1.0, slope)
    low = np.where((slope > 0) & ~flat, crossing, -np.inf).max(axis=1)
    high = np.where((slope < 0) & ~flat, crossing, np.inf).min(axis=1)
    outside = (flat & (rest < -1e-9)).any(axis=1)
    first = np.clip(np.ceil(low - 0.5 - 1e-7), 0, pixels)
    last = np.clip(np.floor(high - 0.5 + 1e-7), -1, pixels - 1)
    return first.astype(np.int64), np.where(outside, first - 1, last).astype(np.int64)


def _ranges(first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """All whole numbers from first to last of each pair: which pair (q,), and the number (q,)."""
    counts = np.maximum(last - first + 1, 0)
    which = np.repeat(np.arange(len(counts)), counts)  # (q,)
    start = np.cumsum(counts) - counts
    return which, np.arange(len(which)) - start[which] + first[which]
