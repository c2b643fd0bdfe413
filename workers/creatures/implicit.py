"""The surface of a skeleton: a smooth union of tapered capsules, its level set as a mesh.

Each group of capsules g (a limb, a blob) has a distance d_g and a softness k_g, a share of its
radius. The surface is where Σ exp(-d_g / k_g) = 1. Far from other groups this is d_g = 0. Where
two groups meet it is a fillet about k wide.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from skimage.measure import marching_cubes

from workers.creatures.skeleton import Capsule
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import euler_characteristic, vertex_components

# Chosen, not measured.
_ATTEMPTS = 6  # to meet the number of vertices, on a grid that keeps limbs apart
_FAR = 8.0  # softnesses from a group beyond which it is not felt: exp(-8) = 0.0003
_AWAY = 0.12  # grid spacings that the surface keeps from grid points, against slivers
_THINNEST = 0.95  # grid spacings of the smallest half thickness that is sampled safely


def extract_surface(
    capsules: tuple[Capsule, ...], vertices: int
) -> tuple[FloatArray, IntArray, float]:
    """Triangles of the surface around capsules.

    Parameters
    ----------
    capsules : tuple of Capsule
        The flesh.
    vertices : int
        About how many the surface has.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        Wound outwards.
    spacing : float
        Of the grid they were sampled at.
    """
    spacing = 1.2 * np.sqrt(_rough_area(capsules) / vertices)
    for attempt in range(_ATTEMPTS):
        used, shift = spacing, 0.29 * attempt % 1.0
        points, faces = _march(capsules, used, shift)
        close = abs(len(points) / vertices - 1.0) < 0.04
        if close and _is_sphere(points, faces):  # else limbs were welded between grid points
            break
        spacing *= float(np.sqrt(len(points) / vertices))  # vertices grow with 1 / spacing²
    return points, faces, used


def evaluate(capsules: tuple[Capsule, ...], points: FloatArray) -> FloatArray:
    """About the signed distance of points from the surface.

    Parameters
    ----------
    capsules : tuple of Capsule
        The flesh.
    points : (n, 3) float64
        Where.

    Returns
    -------
    (n,) float64, negative inside; of first order at the surface
    """
    total, weighted = np.zeros(len(points)), np.zeros(len(points))
    for group in groups(capsules):
        _add(group, points, total, weighted)
    return _distance(total, weighted)


def thickened(capsules: tuple[Capsule, ...], spacing: float) -> tuple[Capsule, ...]:
    """The capsules, none so thin that a grid of this spacing could miss it.

    Parameters
    ----------
    capsules : tuple of Capsule
        The flesh.
    spacing : float
        Of the grid.

    Returns
    -------
    tuple of Capsule
    """
    least = _THINNEST * spacing
    thick = []
    for capsule in capsules:
        thinness = 1.0 if capsule.fin is not None else capsule.thinness  # sheets thicken, not grow
        start, end = (max(radius, least / thinness) for radius in capsule.radii)
        thick.append(replace(capsule, radii=(start, end), least=least))
    return tuple(thick)


def groups(capsules: tuple[Capsule, ...]) -> Iterator[list[Capsule]]:
    """Parts by group, in order.

    Parameters
    ----------
    capsules : tuple of Capsule
        The flesh.

    Yields
    ------
    list of Capsule
        Parts of one group: they are joined sharply.
    """
    numbers = sorted({capsule.group for capsule in capsules})
    for number in numbers:
        yield [capsule for capsule in capsules if capsule.group == number]


def capsule_distance(capsule: Capsule, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances of points from one capsule, and the capsule's radius there.

    Parameters
    ----------
    capsule : Capsule
        A tapered capsule, an ellipsoid or a fin.
    points : (..., 3) float64
        Where.

    Returns
    -------
    distances, radii : (...,) float64
        Negative inside.
    """
    if capsule.fin is not None:
        return _fin_distance(capsule, points)
    return _cone_distance(capsule, points)


def _fin_distance(capsule: Capsule, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance from a flat sheet with a round rim, exact on its own; and the radius."""
    normal = capsule.fin if capsule.fin is not None else np.zeros(3)
    height = (points - capsule.start) @ normal  # (...,)
    flat = replace(
        capsule, fin=None, end=capsule.end - ((capsule.end - capsule.start) @ normal) * normal
    )
    distance, radius = _cone_distance(flat, points - height[..., None] * normal)
    half = np.minimum(np.maximum(capsule.ratio * radius, capsule.least), radius)
    beside = np.maximum(distance + half, 0.0)
    return np.sqrt(beside**2 + height**2) - half, radius


def _cone_distance(capsule: Capsule, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance from a round cone or ellipsoid, of first order at its surface; and the radius."""
    stretched = points @ capsule.stretch.T  # (..., 3)
    start, axis = capsule.stretch @ capsule.start, capsule.stretch @ (capsule.end - capsule.start)
    length = float(np.linalg.norm(axis))
    first, last = capsule.radii
    relative = stretched - start
    if length <= abs(first - last):  # one end lies inside the other
        away = relative if first >= last else relative - axis
        radius = np.full(points.shape[:-1], max(first, last))
    else:
        along = relative @ (axis / length)
        across = np.sqrt(np.maximum((relative**2).sum(axis=-1) - along**2, 0.0))
        sine = (first - last) / length
        share = np.clip((along - across * sine / np.sqrt(1 - sine**2)) / length, 0.0, 1.0)
        away = relative - share[..., None] * axis
        radius = first + share * (last - first)
    distance, gradient = _norm(away, capsule.power)
    bent = np.sqrt(((gradient @ capsule.stretch) ** 2).sum(axis=-1))
    return (distance - radius) / np.where(bent > 1e-12, bent, 1.0), radius


def _norm(vectors: FloatArray, power: float) -> tuple[FloatArray, FloatArray]:
    """Norms of vectors (..., 3) of a power of 2 or more, (...,), and their gradients (..., 3)."""
    if power == 2:
        length = np.sqrt((vectors**2).sum(axis=-1))
        return length, vectors / np.maximum(length, 1e-12)[..., None]
    largest = np.maximum(np.abs(vectors).max(axis=-1), 1e-12)
    scaled = np.abs(vectors) / largest[..., None]  # at most 1: no overflow
    size = (scaled**power).sum(axis=-1) ** (1.0 / power)
    gradient = np.sign(vectors) * (scaled / size[..., None]) ** (power - 1.0)
    return largest * size, gradient


def _is_sphere(points: FloatArray, faces: IntArray) -> bool:
    """Whether a closed surface is one piece without a handle."""
    mesh = TriangleMesh(points, faces)
    return vertex_components(mesh).max() == 0 and euler_characteristic(mesh) == 2


def _march(
    capsules: tuple[Capsule, ...], spacing: float, shift: float
) -> tuple[FloatArray, IntArray]:
    """Marching cubes at a spacing, evaluated only near each group; the grid is shifted a share."""
    thick = thickened(capsules, spacing)
    boxes = [_box(group) for group in groups(thick)]
    low = np.min([box[0] for box in boxes], axis=0) - (2 + shift) * spacing
    high = np.max([box[1] for box in boxes], axis=0) + 2 * spacing
    shape = tuple(np.ceil((high - low) / spacing).astype(int) + 1)
    total, weighted = np.zeros(shape), np.zeros(shape)
    for group, (lower, upper) in zip(groups(thick), boxes, strict=True):
        first = np.floor((lower - low) / spacing).astype(int)
        last = np.ceil((upper - low) / spacing).astype(int) + 1
        window = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
        axes = [low[i] + spacing * np.arange(first[i], last[i]) for i in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        _add(group, points, total[window], weighted[window])
    distance = _distance(total, weighted)
    near = np.abs(distance) < _AWAY * spacing
    distance[near] = np.where(distance[near] < 0, -_AWAY, _AWAY) * spacing
    points, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        distance, 0.0, spacing=(spacing,) * 3
    )
    return points.astype(np.float64) + low, faces.astype(np.int64)


def _add(group: list[Capsule], points: FloatArray, total: FloatArray, weighted: FloatArray) -> None:
    """Add a group's exp(-d/k), and k exp(-d/k), to running sums over the points, in place."""
    ratio = np.full(points.shape[:-1], np.inf)
    width = np.ones(points.shape[:-1])
    for capsule in group:
        distance, radius = capsule_distance(capsule, points)
        softness = capsule.softness * radius
        own = distance / softness
        nearer = own < ratio
        ratio = np.where(nearer, own, ratio)
        width = np.where(nearer, softness, width)
    felt = np.exp(-np.clip(ratio, -40.0, 40.0))
    total += felt
    weighted += width * felt


def _distance(total: FloatArray, weighted: FloatArray) -> FloatArray:
    """The sums as a distance: -k ln Σ, with k the mean softness."""
    floor = np.exp(-40.0)
    known = np.maximum(total, floor)
    width = np.where(total > floor, weighted / known, weighted.max(initial=0.0) + 1.0)
    distance: FloatArray = -width * np.log(known)
    return distance


def _box(group: list[Capsule]) -> tuple[FloatArray, FloatArray]:
    """Corners of the box outside which a group is not felt, (3,) and (3,)."""
    lows, highs = [], []
    for capsule in group:
        for place, radius in ((capsule.start, capsule.radii[0]), (capsule.end, capsule.radii[1])):
            margin = radius * (capsule.reach + _FAR * capsule.softness)
            lows.append(place - margin)
            highs.append(place + margin)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _rough_area(capsules: tuple[Capsule, ...]) -> float:
    """About the area of the surface, for a first spacing."""
    area = 0.0
    for capsule in capsules:
        length = float(np.linalg.norm(capsule.end - capsule.start))
        mean = (capsule.radii[0] + capsule.radii[1]) / 2.0
        area += 2.0 * np.pi * mean * length * 0.8
        if length == 0.0:
            area += 2.0 * np.pi * mean**2 * float(capsule.reach.mean())
    return area
