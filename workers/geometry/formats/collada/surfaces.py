"""Geometries of a COLLADA file as vertices and triangles."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.collada.content import Content, Geometry, Input, Primitive, Source
from workers.geometry.formats.collada.holes import cut_with_holes
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.surfaces.polygons import require_indices
from workers.geometry.formats.surfaces.triangulation import triangulate
from workers.geometry.formats.text.tokens import Polygons, floats, integers

Surface = tuple[FloatArray, IntArray]


class Surfaces:
    """Makes meshes of geometries, each once.

    Parameters
    ----------
    content : Content
        Of the file.
    limits : MeshLimits
        Most vertices and faces.
    """

    def __init__(self, content: Content, limits: MeshLimits) -> None:
        self._content = content
        self._limits = limits
        self._positions: dict[int, FloatArray] = {}
        self._made: dict[str, list[Surface]] = {}

    def of(self, name: str) -> list[Surface]:
        """Make the meshes of a geometry.

        Parameters
        ----------
        name : str
            Its id.

        Returns
        -------
        list of (vertices (n, 3) float64, faces (m, 3) int64)
            One for each source of positions; empty for one without faces.
        """
        if name not in self._made:
            self._made[name] = self._make(self._content.geometries[name])
        return self._made[name]

    def _make(self, geometry: Geometry) -> list[Surface]:
        """Meshes of a geometry."""
        faces: dict[str, list[IntArray]] = {}
        for primitive in geometry.primitives:
            if primitive.indices or primitive.holed:
                place, source = _positions_of(primitive, geometry)
                width = 1 + max(one.offset for one in primitive.inputs)
                corners = _Corners(primitive, place, width)
                triangles = self._triangles(corners, self._vertices(source))
                faces.setdefault(source, []).append(triangles)
        return [(self._vertices(name), np.concatenate(parts)) for name, parts in faces.items()]

    def _triangles(self, corners: "_Corners", vertices: FloatArray) -> IntArray:
        """Triangles (m, 3) of a primitive."""
        polygons = corners.polygons()
        self._limits.check(faces=int(np.maximum(polygons.counts - 2, 0).sum()))
        faces_of_corners = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
        require_indices(polygons.corners, faces_of_corners, len(vertices))
        parts = [np.zeros((0, 3), dtype=np.int64)]
        if (polygons.counts >= 3).any():
            parts.append(triangulate(vertices, polygons))
        for rings in corners.holed():
            require_indices(
                np.concatenate(rings), np.repeat(0, sum(map(len, rings))), len(vertices)
            )
            parts.append(cut_with_holes(vertices, rings))
        return np.concatenate(parts)

    def _vertices(self, name: str) -> FloatArray:
        """Positions (n, 3) of a source."""
        source = self._content.sources.get(name)
        if source is None:
            raise InvalidMeshError(f"the COLLADA file has no source {name[:20]!r}")
        array = self._content.arrays.get(source.array_of_accessor, source)
        if id(source) not in self._positions:
            self._positions[id(source)] = _rows(source, floats(array.text.encode()))
            self._limits.check(vertices=len(self._positions[id(source)]))
        return self._positions[id(source)]


def _positions_of(primitive: Primitive, geometry: Geometry) -> tuple[int, str]:
    """Offset of a corner's position among its indices, and the source of positions."""
    for one in primitive.inputs:
        if one.semantic == "POSITION":
            return one.offset, one.source
        if one.semantic == "VERTEX":
            inputs: list[Input] = geometry.vertices.get(one.source, [])
            for inner in inputs:
                if inner.semantic == "POSITION":
                    return one.offset, inner.source
    raise InvalidMeshError(f"<{primitive.kind}> of the COLLADA file have no positions")


def _rows(source: Source, numbers: FloatArray) -> FloatArray:
    """Numbers of an array as positions (n, 3)."""
    named = [place for place, name in enumerate(source.names) if name]
    columns = (named if len(named) >= 2 else [0, 1, 2])[:3]
    stride = max(source.stride, columns[-1] + 1)
    rest = numbers[source.offset :]
    table = rest[: len(rest) // stride * stride].reshape(-1, stride)
    rows = np.zeros((len(table), 3))
    rows[:, : len(columns)] = table[:, columns]
    return rows


class _Corners:
    """Indices of the positions of a primitive's corners."""

    def __init__(self, primitive: Primitive, place: int, width: int) -> None:
        self._primitive = primitive
        self._place = place
        self._width = width

    def polygons(self) -> Polygons:
        """Polygons without holes."""
        kind = self._primitive.kind
        if kind == "polygons":
            return self._joined()
        if kind in ("tristrips", "trifans"):
            parts = [_cut(kind, self._corners(text)) for text in self._primitive.indices]
            triangles = np.concatenate([np.zeros((0, 3), dtype=np.int64), *parts])
            return Polygons(np.full(len(triangles), 3), triangles.ravel())
        corners = self._corners(" ".join(self._primitive.indices))
        if kind == "polylist" and self._primitive.counts.strip():
            counts = integers(self._primitive.counts.encode())
            if (counts < 0).any() or counts.sum() > len(corners):
                raise InvalidMeshError(
                    f"a polylist of the COLLADA file counts {counts.sum():,} corners, "
                    f"but has {len(corners):,}"
                )
            return Polygons(counts, corners[: int(counts.sum())])
        whole = len(corners) // 3
        return Polygons(np.full(whole, 3), corners[: 3 * whole])

    def holed(self) -> list[list[IntArray]]:
        """Rings of the polygons with holes, the outer one first."""
        return [[self._corners(text) for text in rings] for rings in self._primitive.holed if rings]

    def _joined(self) -> Polygons:
        """Polygons that stand each in its own ``p``."""
        texts = self._primitive.indices
        lengths = [len(text.split()) for text in texts]
        if any(length % self._width for length in lengths):
            raise InvalidMeshError("a polygon of the COLLADA file lacks indices")
        counts = np.array(lengths, dtype=np.int64) // self._width
        return Polygons(counts, self._corners(" ".join(texts)))

    def _corners(self, text: str) -> IntArray:
        """Indices (c,) of positions, of all indices of a text."""
        numbers = integers(text.encode())
        whole = len(numbers) // self._width * self._width
        return numbers[:whole].reshape(-1, self._width)[:, self._place]


def _cut(kind: str, corners: IntArray) -> IntArray:
    """Triangles (t, 3) of a strip or fan."""
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if kind == "trifans":
        first = np.full(len(corners) - 2, corners[0])
        return np.stack([first, corners[1:-1], corners[2:]], axis=1)
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]  # every second one winds the other way
    return triangles
