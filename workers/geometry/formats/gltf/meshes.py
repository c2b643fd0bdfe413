"""The meshes of a glTF file: their triangles, before any node places them."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError, UploadTooLargeError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.gltf import draco
from workers.geometry.formats.gltf.accessors import Accessors
from workers.geometry.formats.gltf.buffers import Buffers
from workers.geometry.formats.gltf.corners import MODES, TRIANGLES, count_triangles, triangles
from workers.geometry.formats.gltf.document import Json, entries, entry, part
from workers.geometry.formats.gltf.notes import Notes
from workers.geometry.formats.surfaces.polygons import require_indices

MOST_PRIMITIVES = 100_000  # all meshes together, each as often as it is shown


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles in the coordinates of a mesh.

    Attributes
    ----------
    vertices : (n, 3) float64
        Those of primitives that share positions stand here once.
    faces : (m, 3) int64
        Indices lie in range.
    """

    vertices: FloatArray
    faces: IntArray


@dataclass(frozen=True, eq=False)
class _Primitive:
    """What a primitive of triangles declares."""

    content: Json
    positions: int
    mode: int
    n_vertices: int
    n_corners: int
    is_draco: bool

    @property
    def n_faces(self) -> int:
        """At most so many triangles."""
        mode = TRIANGLES if self.is_draco else self.mode
        return count_triangles(self.n_corners, mode)


class Meshes:
    """The meshes of one document; each is read once, however often it is shown.

    Parameters
    ----------
    document : dict
        Content of the JSON.
    buffers : Buffers
        Of the same file.
    decoder : DracoDecoder
        Closed by who made it.
    notes : Notes
        Takes what is left out.
    """

    def __init__(
        self, document: Json, buffers: Buffers, decoder: draco.DracoDecoder, notes: Notes
    ) -> None:
        self.accessors = Accessors(document, buffers)
        self._meshes = entries(document, "meshes")
        self._buffers = buffers
        self._decoder = decoder
        self._notes = notes
        self._pooled = _used_by_several(self._meshes)
        self._primitives: dict[int, list[_Primitive]] = {}
        self._surfaces: dict[int, Surface] = {}
        self._n_primitives = 0
        self.n_points = 0

    def declared(self, index: int) -> draco.Counts:
        """How many vertices and faces a mesh has at most, as its accessors declare.

        Parameters
        ----------
        index : int
            Its number.

        Returns
        -------
        Counts
            Not checked against the limits, or against the bytes that are there.

        Raises
        ------
        InvalidMeshError
            No such mesh, or it is damaged.
        UploadTooLargeError
            Too many primitives.
        """
        if index not in self._primitives:
            content = entry(self._meshes, index, "mesh")
            found = [self._described(item) for item in entries(content, "primitives")]
            self._primitives[index] = [item for item in found if item is not None]
        primitives = self._primitives[index]
        self._n_primitives += len(primitives)
        if self._n_primitives > MOST_PRIMITIVES:
            raise UploadTooLargeError(f"the scene has over {MOST_PRIMITIVES:,} primitives")
        vertices: dict[int, int] = {}
        corners: dict[int, int] = {}
        for number, item in enumerate(primitives):
            key = -1 - number if item.is_draco else item.positions
            vertices[key] = item.n_vertices
            corners[key] = corners.get(key, 0) + item.n_corners
        return draco.Counts(
            vertices=sum(
                min(count, corners[key]) if key in self._pooled else count
                for key, count in vertices.items()
            ),
            faces=sum(item.n_faces for item in primitives),
        )

    def surface(self, index: int) -> Surface:
        """Triangles of a mesh whose declared counts were checked against the limits.

        Parameters
        ----------
        index : int
            Its number.

        Returns
        -------
        Surface
            Empty where the mesh has points and lines alone.

        Raises
        ------
        InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
            See `workers.geometry.formats.parse`.
        """
        if index not in self._surfaces:
            self._surfaces[index] = self._read(self._primitives[index])
        return self._surfaces[index]

    def _described(self, content: Json) -> _Primitive | None:
        """What a primitive declares; None for one without triangles."""
        positions = part(content, "attributes").get("POSITION")
        if positions is None:
            self._notes.found["primitive without positions"] += 1
            return None
        count = self.accessors.count(positions)
        mode = content.get("mode", TRIANGLES)
        if mode not in MODES:
            self.n_points += count
            self._notes.found["primitive of points or lines"] += 1
            return None
        indices = content.get("indices")
        n_corners = count if indices is None else self.accessors.count(indices)
        return _Primitive(
            content, positions, mode, count, n_corners, self._needs_draco(content, positions)
        )

    def _needs_draco(self, content: Json, positions: int) -> bool:
        """Whether a primitive is under Draco and has no plain data as well."""
        if not part(content, "extensions", draco.NAME):
            if not self.accessors.is_plain(positions):
                self._buffers.require_known(content, "primitive")
            return False
        indices = content.get("indices")
        plain = self.accessors.is_plain(positions) and (
            indices is None or self.accessors.is_plain(indices)
        )
        return self._buffers.is_required(draco.NAME) or not plain

    def _read(self, primitives: list[_Primitive]) -> Surface:
        """Triangles of some primitives; those that share positions share vertices."""
        shared: dict[int, list[_Primitive]] = {}
        for number, item in enumerate(primitives):
            key = -1 - number if item.is_draco else item.positions
            shared.setdefault(key, []).append(item)
        parts = [
            self._decoded(items[0]) if key < 0 else self._plain(items)
            for key, items in shared.items()
        ]
        if not parts:
            return Surface(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
        if len(parts) == 1:
            return parts[0]
        sizes = [len(part.vertices) for part in parts]
        offsets = np.cumsum([0, *sizes[:-1]])
        faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=True)]
        return Surface(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))

    def _plain(self, primitives: list[_Primitive]) -> Surface:
        """Triangles of primitives that share an accessor of positions."""
        positions = primitives[0].positions
        values = self.accessors.values(positions, "VEC3")
        faces = np.concatenate([self._faces(item) for item in primitives])
        if positions in self._pooled:  # a mesh has only the vertices that it uses
            used, places = np.unique(faces, return_inverse=True)
            values, faces = values[used], places.reshape(-1, 3)
        return Surface(self._coordinates(positions, values), faces)

    def _faces(self, item: _Primitive) -> IntArray:
        """Triangles of one primitive, checked against the number of its vertices."""
        indices, restart = item.content.get("indices"), None
        if indices is None:
            corners = np.arange(item.n_vertices)
        else:
            stored = self.accessors.values(indices, "SCALAR")
            if stored.dtype.kind == "f":
                raise InvalidMeshError("the indices of a primitive of the glTF file are floats")
            largest = int(np.iinfo(stored.dtype).max)
            restart = largest if largest >= item.n_vertices else None
            corners = stored.astype(np.int64)
        faces = triangles(corners, item.mode, restart)
        require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), item.n_vertices)
        if item.mode == TRIANGLES and len(corners) % 3:
            self._notes.repairs.append(
                "the corners of a primitive of the glTF file are no multiple of 3; the last ones "
                "were left out"
            )
        return faces

    def _decoded(self, item: _Primitive) -> Surface:
        """Triangles of a primitive under Draco."""
        extension = part(item.content, "extensions", draco.NAME)
        number = part(extension, "attributes").get("POSITION", -1)
        attribute = number if isinstance(number, int) and 0 <= number < 1 << 32 else -1
        view = self._buffers.view(extension.get("bufferView"))
        self._buffers.budget.take(len(view.data))  # many primitives may name one long stream
        stream = bytes(view.data)
        declared = draco.Counts(item.n_vertices, item.n_faces)
        points, faces = self._decoder.decode(stream, attribute, declared)
        if (len(points), len(faces)) != (declared.vertices, declared.faces):
            self._notes.repairs.append(
                f"the glTF file declares {declared.vertices:,} vertices and {declared.faces:,} "
                f"faces, but its Draco data has {len(points):,} and {len(faces):,}"
            )
        require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), len(points))
        return Surface(self._coordinates(item.positions, points), faces)

    def _coordinates(self, positions: int, values: NDArray[Any]) -> FloatArray:
        """Positions as float64; integers of a normalized accessor are fractions."""
        with np.errstate(invalid="ignore"):  # what is not a number is cleaning's to report
            return self.accessors.scaled(positions, values).astype(np.float64)


def _used_by_several(meshes: list[Json]) -> set[int]:
    """Accessors of positions of several meshes: some writers keep all vertices in one."""
    uses: Counter[int] = Counter()
    for mesh in meshes:
        used = {
            part(primitive, "attributes").get("POSITION")
            for primitive in entries(mesh, "primitives")
        }
        uses.update(position for position in used if isinstance(position, int))
    return {position for position, count in uses.items() if count > 1}
