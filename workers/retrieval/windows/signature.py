"""The signature of a shape: windows around farthest points, and how far these are apart.

A stored shape has windows of seven radii. A query may be a part, so that its area says little about
its scale: it has the windows of several scales (hypotheses), and is compared in each.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.edges import edge_lengths, single_edges
from workers.geometry.elements import lumped_areas
from workers.geometry.geodesics import (
    distances_from,
    farthest_points,
    mutual_distances,
    surface_graph,
)
from workers.geometry.mesh import TriangleMesh
from workers.geometry.smoothing import median_angle
from workers.retrieval.windows.moments import NUMBERS, EdgeMasses, Windows, windows

WINDOWS_VERSION = "1"
"""Part of what a signature depends on: raised when the same mesh gives another one."""

RADII: FloatArray = read_only(np.array([0.12, 0.18, 0.27]), np.float64)
"""Of windows of all that is near, in units of √A."""

FACING_RADII: FloatArray = read_only(np.array([0.053, 0.08, 0.12, 0.18]), np.float64)
"""Of windows of what faces the same way."""

KINDS = len(RADII) + len(FACING_RADII)
"""Windows a point: those of `RADII`, then those of `FACING_RADII`."""

STORED_POINTS = 256
QUERY_POINTS = 128
SHEET_POINTS = 160
FAR_POINTS = 112
"""The first so many points of a stored shape have their distances kept: 20 kB in all."""

STEP = 1.07
"""Factor between the scales of two hypotheses; 1.14 in the area."""

PART_SCALES, SHEET_SCALES = 8, 12
"""Hypotheses: of what may be a part, though it looks closed, and of a sheet."""

SHEET = 7.0
"""Length of the open boundary, in √A, from which a surface counts as a sheet."""

WHOLE, CUT, LOST = range(3)
CUT_FROM, LOST_FROM = 0.1, 0.6
"""Largest weight on the boundary from which a window counts as cut, and as lost."""

_LOWEST: FloatArray = read_only(np.array([-5.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), np.float64)
_HIGHEST: FloatArray = read_only(np.array([2.0, 1.0, 0.6, 0.6, 0.6, 1.0, 0.6]), np.float64)
_LEVELS = 255
_REACHES = 3
_PLACES = _REACHES ** np.arange(KINDS)
_FARTHEST_CODE = 254  # of a distance; 255 is a point of another component


@dataclass(frozen=True, eq=False)
class WindowSurface:
    """A working mesh at area 1, with what its windows are taken from.

    Attributes
    ----------
    mesh : TriangleMesh
        Of n vertices.
    points : (s,) int64
        Farthest points.
    distances : (s, n) float64
        Along the surface, up to the reach that was asked for.
    areas : (s,) float64
        Area of the cell of each point.
    mutual : (s, s) float64
        Distances of the points; infinite between components.
    boundary : float
        Length of the open boundary.
    n_vertices : int
        Of the cleaned mesh.
    """

    mesh: TriangleMesh
    points: IntArray
    distances: FloatArray
    areas: FloatArray
    mutual: FloatArray
    boundary: float
    n_vertices: int

    @property
    def is_sheet(self) -> bool:
        """Whether the boundary is long."""
        return self.boundary > SHEET


@dataclass(frozen=True, eq=False)
class Signature:
    """Windows of a shape at one scale or several.

    Attributes
    ----------
    numbers : (h, s, 7, 7) float32
        By hypothesis, point, window and number.
    reaches : (h, s, 7) uint8
        How far the open boundary reaches into a window: `WHOLE`, `CUT` or `LOST`.
    areas : (s,) float32
        Area of the cell of each point; they sum to 1.
    mutual : (f, f) float32
        Distances of the first f points, infinite between components.
    boundary : float
        Length of the open boundary, in √A.
    roughness : float
        Median angle between adjacent faces, in degrees.
    n_vertices : int
        Of the cleaned mesh, before it was made finer or coarser.
    """

    numbers: NDArray[np.float32]
    reaches: NDArray[np.uint8]
    areas: NDArray[np.float32]
    mutual: NDArray[np.float32]
    boundary: float
    roughness: float
    n_vertices: int

    @property
    def n_points(self) -> int:
        """Points."""
        return len(self.areas)

    @property
    def n_scales(self) -> int:
        """Hypotheses."""
        return len(self.numbers)

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Codes of 8 bits, as they are stored.

        Returns
        -------
        dict
            `from_arrays` reads it.
        """
        share = (self.numbers - _LOWEST) / (_HIGHEST - _LOWEST)
        top = float(np.max(self.mutual[np.isfinite(self.mutual)], initial=0.0)) or 1.0
        upper = self.mutual[np.triu_indices(len(self.mutual), 1)]
        codes = np.where(np.isfinite(upper), np.rint(upper / top * _FARTHEST_CODE), _LEVELS)
        return {
            "numbers": np.rint(np.clip(share, 0.0, 1.0) * _LEVELS).astype(np.uint8),
            "reaches": (self.reaches * _PLACES).sum(axis=2).astype(np.uint16),
            "areas": self.areas.astype(np.float16),
            "mutual": codes.astype(np.uint8),
            "scalars": np.array([top, self.boundary, self.roughness, self.n_vertices], "<f4"),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[Any]]) -> "Signature":
        """Return the signature that `to_arrays` wrote, rounded as it was stored.

        Parameters
        ----------
        arrays : dict
            Codes.

        Returns
        -------
        Signature
        """
        top, boundary, roughness, n_vertices = (float(value) for value in arrays["scalars"])
        codes = arrays["mutual"]
        n_far = (1 + math.isqrt(1 + 8 * len(codes))) // 2
        mutual = np.zeros((n_far, n_far), dtype=np.float32)
        far = codes.astype(np.float32) * np.float32(top / _FARTHEST_CODE)
        mutual[np.triu_indices(n_far, 1)] = np.where(codes == _LEVELS, np.float32(np.inf), far)
        areas = arrays["areas"].astype(np.float32)
        return cls(
            decoded(arrays["numbers"]),
            (arrays["reaches"][..., None] // _PLACES % _REACHES).astype(np.uint8),
            areas / areas.sum(),
            mutual + mutual.T,
            boundary,
            roughness,
            int(n_vertices),
        )


def decoded(codes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Numbers of windows from their codes.

    Parameters
    ----------
    codes : (..., 7) uint8
        As in `Signature.to_arrays`.

    Returns
    -------
    (..., 7) float32
    """
    low, width = _LOWEST.astype(np.float32), (_HIGHEST - _LOWEST).astype(np.float32)
    numbers: NDArray[np.float32] = low + codes.astype(np.float32) * (width / np.float32(_LEVELS))
    return numbers


def window_surface(mesh: TriangleMesh, *, n_vertices: int, for_query: bool) -> WindowSurface:
    """Take farthest points of a working mesh, and distances from them.

    Parameters
    ----------
    mesh : TriangleMesh
        Working mesh under the view "windows", in any unit.
    n_vertices : int
        Of the cleaned mesh that it was made of.
    for_query : bool
        Whether it is searched with: then there are fewer points, and all distances.

    Returns
    -------
    WindowSurface
        At area 1.
    """
    unit = TriangleMesh(
        (mesh.vertices - mesh.vertices.mean(axis=0)) / np.sqrt(mesh.area), mesh.faces
    )
    boundary = boundary_length(unit)
    graph = surface_graph(unit)
    n_points = STORED_POINTS
    reach = float(RADII[-1]) + _margin(unit)
    if for_query:
        n_points = SHEET_POINTS if boundary > SHEET else QUERY_POINTS
        reach = math.inf
    start = int(np.argmax(np.square(unit.vertices).sum(axis=1)))
    taken = farthest_points(graph, min(n_points, unit.n_vertices), start=start, reach=reach)
    of_vertices = lumped_areas(unit.faces, unit.face_areas, unit.n_vertices)
    areas = np.asarray(np.bincount(taken.cells, of_vertices, len(taken.vertices)), np.float64)
    if for_query:
        mutual = taken.distances[:, taken.vertices]
        mutual = np.minimum(mutual, mutual.T)
    else:
        mutual = mutual_distances(taken.distances[:, taken.vertices], FAR_POINTS)
    return WindowSurface(unit, taken.vertices, taken.distances, areas, mutual, boundary, n_vertices)


def stored_signature(surface: WindowSurface) -> Signature:
    """Signature of a shape that is searched for.

    Parameters
    ----------
    surface : WindowSurface
        Not for a query.

    Returns
    -------
    Signature
        Of one scale: the shape's own.
    """
    return _signature(surface, range(1))


def query_signature(surface: WindowSurface) -> Signature:
    """Signature of a shape that is searched with.

    Parameters
    ----------
    surface : WindowSurface
        For a query.

    Returns
    -------
    Signature
        Hypothesis j takes the shape for a part that has the share 1.07^(-2j) of a whole's area.
    """
    return _signature(surface, range(SHEET_SCALES if surface.is_sheet else PART_SCALES))


def signature_at(mesh: TriangleMesh, points: IntArray) -> Signature:
    """Signature of chosen points, in the mesh's own unit.

    Parameters
    ----------
    mesh : TriangleMesh
        Working mesh, in the unit that radii are meant in.
    points : (s,) int64
        Its vertices.

    Returns
    -------
    Signature
        Of one scale; all points have the same area.
    """
    distances = distances_from(surface_graph(mesh), points, float(RADII[-1]) + _margin(mesh))
    areas = np.ones(len(points)) / max(len(points), 1)
    mutual = np.minimum(distances[:, points], distances[:, points].T)
    n = mesh.n_vertices
    surface = WindowSurface(mesh, points, distances, areas, mutual, boundary_length(mesh), n)
    return _signature(surface, range(1))


def signature_of(surface: WindowSurface, scales: Sequence[int], *, facing: bool) -> Signature:
    """Signature of chosen points at chosen scales.

    Parameters
    ----------
    surface : WindowSurface
        With all distances up to the largest radius.
    scales : sequence of int
        Hypotheses j, as in `query_signature`.
    facing : bool
        Whether windows of what faces the same way are taken, too. Those that are not are lost.

    Returns
    -------
    Signature
        Of these scales.
    """
    return _signature(surface, scales, kinds=2 if facing else 1)


def _signature(surface: WindowSurface, scales: Sequence[int], *, kinds: int = 2) -> Signature:
    """Windows at some scales, of both kinds or of the first alone."""
    masses = EdgeMasses.of(surface.mesh)
    steps = STEP ** np.asarray(scales)
    found = [
        _windows(surface, masses, np.outer(steps, radii), facing=facing)
        for radii, facing in ((RADII, False), (FACING_RADII, True))[:kinds]
    ]
    if kinds == 1:
        shape = (len(scales), len(surface.points), len(FACING_RADII))
        found.append(Windows(np.zeros((*shape, NUMBERS)), np.ones(shape)))
    truncation = np.concatenate([one.truncation for one in found], axis=2)
    areas = surface.areas.astype(np.float32)
    return Signature(
        np.concatenate([one.numbers for one in found], axis=2).astype(np.float32),
        np.digitize(truncation, (CUT_FROM, LOST_FROM)).astype(np.uint8),
        areas / areas.sum(),
        surface.mutual.astype(np.float32),
        surface.boundary,
        median_angle(surface.mesh),
        surface.n_vertices,
    )


def _windows(
    surface: WindowSurface, masses: EdgeMasses, radii: FloatArray, *, facing: bool
) -> Windows:
    """Windows (h, s, r, …) of radii (h, r) in any order."""
    order = np.argsort(radii, axis=None, kind="stable")
    back = np.argsort(order)
    found = windows(
        surface.mesh,
        masses,
        surface.points,
        surface.distances,
        radii.ravel()[order],
        facing=facing,
    )
    shape = (len(surface.points), *radii.shape)
    numbers = found.numbers[:, back].reshape(*shape, NUMBERS)
    truncation = found.truncation[:, back].reshape(shape)
    return Windows(numbers.swapaxes(0, 1), truncation.swapaxes(0, 1))


def _margin(mesh: TriangleMesh) -> float:
    """How much farther than a window the ends of an edge may be whose middle is in it."""
    ends = mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]
    return 0.5 * max(float(edge_lengths(mesh.vertices, edges).max()) for edges in ends)


def boundary_length(mesh: TriangleMesh) -> float:
    """Length of all edges that only one face has.

    Parameters
    ----------
    mesh : TriangleMesh
        In any unit.

    Returns
    -------
    float
        In the mesh's unit; 0 for a closed mesh.
    """
    corners, faces = single_edges(mesh.faces, mesh.n_vertices)
    ends = np.stack([mesh.faces[faces, corners], mesh.faces[faces, (corners + 1) % 3]], axis=1)
    return float(edge_lengths(mesh.vertices, ends).sum())
