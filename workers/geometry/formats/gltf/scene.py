"""GLB and glTF 2.0: triangles of the scene, every node's transform applied."""

import base64
import binascii
import json
import struct
from collections import deque
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.gltf.accessors import Accessors
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.polygons import require_faces, require_indices
from workers.geometry.formats.reading import Reading
from workers.geometry.mesh import TriangleMesh

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
TRIANGLES, STRIP, FAN = 4, 5, 6
MOST_PRIMITIVES = 100_000  # all nodes together


def read_glb(data: bytes, limits: MeshLimits) -> Reading:
    """Read a GLB file (glTF 2.0 in one binary file).

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Triangles of the scene, each node placed by its transforms.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    version, length = (int.from_bytes(data[i : i + 4], "little") for i in (4, 8))
    if version != 2:
        raise UnsupportedFormatError(f"the file is GLB version {version}; expected version 2")
    if length > len(data):
        raise InvalidMeshError(
            f"the GLB file declares {length:,} bytes, but has {len(data):,}: it is truncated"
        )
    chunks: dict[int, bytes] = {}
    position = 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<II", data, position)
        if position + 8 + size > length:
            raise InvalidMeshError("a chunk of the GLB file ends after the file: it is truncated")
        chunks.setdefault(kind, data[position + 8 : position + 8 + size])
        position += 8 + size
    if JSON_CHUNK not in chunks:
        raise InvalidMeshError("the GLB file has no JSON chunk")
    return _read(chunks[JSON_CHUNK], chunks.get(BINARY_CHUNK), limits)


def read_gltf(data: bytes, limits: MeshLimits) -> Reading:
    """Read a glTF 2.0 file whose buffers are embedded as ``data:`` URIs.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Triangles of the scene, each node placed by its transforms.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    return _read(data, None, limits)


def _read(text: bytes, binary: bytes | None, limits: MeshLimits) -> Reading:
    """Mesh of the JSON part and the binary chunk."""
    document = json.loads(text)
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise InvalidMeshError("the file is JSON, but no glTF: it has no 'asset'")
    version = str(document["asset"].get("version"))
    if not version.startswith("2"):
        raise UnsupportedFormatError(f"the file is glTF version {version[:8]}; expected 2.0")
    for extension in document.get("extensionsRequired", []):
        if extension in COMPRESSIONS:
            raise UnsupportedFormatError(f"the glTF file needs {extension}, which is not read")
    buffers = [_buffer(item, binary) for item in document.get("buffers", [])]
    return Reading(_Scene(document, Accessors(document, buffers), limits).mesh())


def _buffer(item: dict[str, Any], binary: bytes | None) -> bytes:
    """Return the bytes of one buffer."""
    uri = item.get("uri")
    if uri is None:
        if binary is None:
            raise InvalidMeshError("a buffer of the glTF file has no data")
        return binary
    if not (isinstance(uri, str) and uri.startswith("data:") and "," in uri):
        raise InvalidMeshError(
            f"the glTF file refers to another file ({str(uri)[:60]!r}); only embedded data is "
            "accepted: send it as GLB"
        )
    head, _, body = uri.partition(",")
    try:
        return (
            base64.b64decode(body, validate=False)
            if head.endswith(";base64")
            else unquote_to_bytes(body)
        )
    except binascii.Error as error:
        raise InvalidMeshError(f"an embedded buffer of the glTF file is damaged: {error}") from None


class _Scene:
    """Collects the triangles of the nodes of one scene, counting before it allocates."""

    def __init__(self, document: dict[str, Any], accessors: Accessors, limits: MeshLimits) -> None:
        self._document = document
        self._accessors = accessors
        self._limits = limits
        self._vertices: list[FloatArray] = []
        self._faces: list[IntArray] = []
        self._n_vertices = 0
        self._n_faces = 0
        self._n_points = 0
        self._n_primitives = 0

    def mesh(self) -> TriangleMesh:
        """Mesh of all nodes; a node that is reached twice is an error, as the standard says."""
        nodes = self._document.get("nodes", [])
        waiting = deque((index, np.eye(4)) for index in self._roots(nodes))
        seen: set[int] = set()
        while waiting:
            index, parent = waiting.popleft()
            if index in seen or not 0 <= index < len(nodes):
                raise InvalidMeshError(f"node {index} of the glTF file is missing or used twice")
            seen.add(index)
            node = nodes[index]
            transform = parent @ _local_transform(node)
            if "mesh" in node:
                self._add_mesh(node["mesh"], np.eye(4) if "skin" in node else transform)
            waiting.extend((child, transform) for child in node.get("children", []))
        require_faces(self._n_points, self._n_faces)
        return TriangleMesh(np.concatenate(self._vertices), np.concatenate(self._faces))

    def _roots(self, nodes: list[dict[str, Any]]) -> list[int]:
        """Nodes of the default scene, or those that are nobody's children."""
        scenes = self._document.get("scenes", [])
        chosen = self._document.get("scene", 0)
        if scenes:
            if not 0 <= chosen < len(scenes):
                raise InvalidMeshError(f"the glTF file has no scene {chosen}")
            return list(scenes[chosen].get("nodes", []))
        children = {child for node in nodes for child in node.get("children", [])}
        return [index for index in range(len(nodes)) if index not in children]

    def _add_mesh(self, index: int, transform: FloatArray) -> None:
        """Add all triangles of one mesh; primitives that share positions share vertices."""
        meshes = self._document.get("meshes", [])
        if not 0 <= index < len(meshes):
            raise InvalidMeshError(f"the glTF file has no mesh {index}")
        offsets: dict[int, int] = {}
        for primitive in meshes[index]["primitives"]:
            self._n_primitives += 1
            if self._n_primitives > MOST_PRIMITIVES:
                raise UploadTooLargeError(f"the scene has over {MOST_PRIMITIVES:,} primitives")
            if any(name in primitive.get("extensions", {}) for name in COMPRESSIONS):
                raise UnsupportedFormatError("the glTF file is compressed, which is not read")
            position = primitive["attributes"].get("POSITION")
            if position is None:
                continue
            count = self._accessors.count(position)
            mode = primitive.get("mode", TRIANGLES)
            if mode not in (TRIANGLES, STRIP, FAN):
                self._n_points += count
                continue
            n_corners = self._accessors.count(primitive.get("indices", position))
            n_faces = n_corners // 3 if mode == TRIANGLES else max(n_corners - 2, 0)
            self._n_faces += n_faces
            self._n_vertices += 0 if position in offsets else count
            self._limits.check(vertices=self._n_vertices, faces=self._n_faces)
            if position not in offsets:
                offsets[position] = self._n_vertices - count
                points = self._accessors.values(position, "VEC3").astype(np.float64)
                with np.errstate(all="ignore"):  # infinite coordinates are cleaning's to report
                    self._vertices.append(points @ transform[:3, :3].T + transform[:3, 3])
            if "indices" in primitive:
                corners = self._accessors.values(primitive["indices"], "SCALAR").astype(np.int64)
            else:
                corners = np.arange(count)
            faces = _triangles(corners, mode)
            require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), count)
            self._faces.append(faces + offsets[position])


def _triangles(corners: IntArray, mode: int) -> IntArray:
    """Triangles (m, 3) of a list, strip or fan of corners."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode == FAN:
        return np.stack([np.repeat(corners[:1], len(corners[2:])), corners[1:-1], corners[2:]], 1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)  # (m, 3)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip


def _local_transform(node: dict[str, Any]) -> FloatArray:
    """Matrix (4, 4) of a node: given as such, or as translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    transform[:3, 3] = np.array(node.get("translation", [0, 0, 0]), dtype=np.float64)
    return transform
