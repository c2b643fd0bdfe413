"""The same surface twice: front and back of a wall that has no thickness."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.transfer import closest_points

THICKNESS = 1e-3  # of a component's diagonal: a wall as thick as that is one
AREA_RATIO = 1.02  # between both sides of a wall
MOST_NEAR = 4  # components with nearly the same box that each is compared with
MOST_COMPARED = 1_000  # pairs: more walls than these are a pattern, and stay
FIRST_LOOK = 64  # points of a component that are looked at before all


@dataclass(frozen=True, eq=False)
class _Part:
    """A component: its mesh, the points to compare, and its size."""

    mesh: TriangleMesh
    points: FloatArray
    size: float


def doubled_faces(mesh: TriangleMesh, labels: IntArray) -> tuple[BoolArray, int]:
    """Find the components that lie on another one everywhere.

    Two components are one wall if their areas differ by less than 2 %, and no vertex and no middle
    of a face of either is farther from the other than a thousandth of the size. The one with more
    faces stays; of two alike, the one that is wound outward.

    Parameters
    ----------
    mesh : TriangleMesh
        Without degenerate faces, in a unit of about its extent.
    labels : (m,) int64
        Component of each face, from 0 without gaps.

    Returns
    -------
    doubled : (m,) bool
        The faces to leave out.
    n_shells : int
        How many components they are.
    """
    none = np.zeros(mesh.n_faces, dtype=np.bool_)
    if labels.max(initial=0) == 0:
        return none, 0
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(labels.max() + 1))
    boxes = _boxes(mesh, order, starts)
    areas: FloatArray = np.bincount(labels, weights=mesh.face_areas).astype(np.float64)
    candidates = _alike(boxes, areas)
    if not 0 < len(candidates) <= MOST_COMPARED:
        return none, 0
    ends = np.append(starts[1:], len(labels))
    gone: set[int] = set()
    for pair in candidates.tolist():
        if gone.isdisjoint(pair):
            parts = [_part(mesh, order[starts[i] : ends[i]]) for i in pair]
            if _lies_on(parts[0], parts[1]) and _lies_on(parts[1], parts[0]):
                gone.add(pair[int(_rank(parts[0]) >= _rank(parts[1]))])
    doubled: BoolArray = np.isin(labels, list(gone))
    return doubled, len(gone)


def _boxes(mesh: TriangleMesh, order: IntArray, starts: IntArray) -> FloatArray:
    """Smallest and largest coordinates (c, 6) of the components."""
    corners = mesh.vertices[mesh.faces[order]]  # (m, 3, 3)
    low = np.minimum.reduceat(corners.min(axis=1), starts, axis=0)
    high = np.maximum.reduceat(corners.max(axis=1), starts, axis=0)
    return np.concatenate([low, high], axis=1)


def _alike(boxes: FloatArray, areas: FloatArray) -> IntArray:
    """Pairs (q, 2) of components with nearly the same box and area."""
    count = min(MOST_NEAR, len(boxes))
    _, near = cKDTree(boxes).query(boxes, k=count)
    pairs = np.stack([np.repeat(np.arange(len(boxes)), count), np.ravel(near)], axis=1)
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    sizes = np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)  # (c,)
    apart = np.abs(boxes[pairs[:, 0]] - boxes[pairs[:, 1]]).max(axis=1)
    close = apart <= THICKNESS * sizes[pairs].min(axis=1)
    similar = areas[pairs].max(axis=1) <= AREA_RATIO * areas[pairs].min(axis=1)
    alike: IntArray = pairs[close & similar]
    return alike


def _part(mesh: TriangleMesh, faces: IntArray) -> _Part:
    """A component by its faces."""
    corners = mesh.faces[faces]
    used = np.unique(corners)
    points = np.concatenate([mesh.vertices[used], mesh.vertices[corners].mean(axis=1)])
    size = float(np.linalg.norm(np.ptp(points[: len(used)], axis=0)))
    return _Part(TriangleMesh(mesh.vertices, corners), points, size)


def _lies_on(one: _Part, other: _Part) -> bool:
    """Whether all points of a component are within the thickness of another one."""
    limit = (THICKNESS * min(one.size, other.size)) ** 2
    step = max(1, len(one.points) // FIRST_LOOK)
    return all(
        bool((closest_points(other.mesh, points).squared_distances <= limit).all())
        for points in (one.points[::step], one.points)
    )


def _rank(part: _Part) -> tuple[int, bool, float]:
    """What makes one of two components the one that stays."""
    corners = part.mesh.vertices[part.mesh.faces] - part.points.mean(axis=0)
    volume = float(np.einsum("mi,mi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))
    return part.mesh.n_faces, volume > 0.0, part.mesh.area
