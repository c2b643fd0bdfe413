"""Builds glTF documents and GLB files piece by piece, for tests."""

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.formats.kinds import BODY
from workers.geometry.mesh import TriangleMesh

COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Builder:
    """A document of one buffer that grows with every array."""

    def __init__(self) -> None:
        self.binary = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, data: bytes, **more: Any) -> int:
        """Append a buffer view of these bytes."""
        item = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.document["bufferViews"].append(item | more)
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: NDArray[Any], **more: Any) -> int:
        """Append an accessor of these values, and its buffer view."""
        item = self.describe(values) | {"bufferView": self.view(values.tobytes())} | more
        return self.add("accessors", {key: v for key, v in item.items() if v is not None})

    @staticmethod
    def describe(values: NDArray[Any]) -> dict[str, Any]:
        """Count and type of an accessor of these values."""
        kind = KINDS[1 if values.ndim == 1 else values.shape[1]]
        component = COMPONENT_TYPES[values.dtype.str[1:]]
        return {"componentType": component, "count": len(values), "type": kind}

    def add(self, key: str, item: Any) -> int:
        """Append to a list of the document."""
        self.document.setdefault(key, []).append(item)
        return len(self.document[key]) - 1

    def primitive(self, positions: int, indices: int | None = None, **more: Any) -> int:
        """Append a mesh of one primitive."""
        item: dict[str, Any] = {"attributes": {"POSITION": positions}} | more
        if indices is not None:
            item["indices"] = indices
        return self.add("meshes", {"primitives": [item]})

    def body(self, mesh: TriangleMesh = BODY) -> "Builder":
        """Append a mesh of plain positions and indices."""
        positions = self.accessor(mesh.vertices.astype("<f4"))
        self.primitive(positions, self.accessor(mesh.faces.astype("<u4").ravel()))
        return self

    def glb(self) -> bytes:
        """Return the file as GLB."""
        document = self.document | {"buffers": [{"byteLength": len(self.binary)}]}
        return glb(json.dumps(document).encode(), self.binary)

    def gltf(self, uri: str | None = None) -> bytes:
        """Return the file as .gltf, its buffer embedded or under a name."""
        data = base64.b64encode(self.binary).decode()
        buffer = {
            "byteLength": len(self.binary),
            "uri": uri or f"data:application/octet-stream;base64,{data}",
        }
        return json.dumps(self.document | {"buffers": [buffer]}).encode()


def chunk(kind: bytes, data: bytes, filler: bytes = b"\0") -> bytes:
    """One chunk of a GLB, padded to four bytes."""
    data += filler * (-len(data) % 4)
    return struct.pack("<I", len(data)) + kind + data


def glb_of(*chunks: bytes, length: int | None = None) -> bytes:
    """A GLB of these chunks."""
    body = b"".join(chunks)
    return b"glTF" + struct.pack("<II", 2, 12 + len(body) if length is None else length) + body


def glb(text: bytes, binary: bytes) -> bytes:
    """A GLB of JSON and binary data."""
    return glb_of(chunk(b"JSON", text, b" "), chunk(b"BIN\0", binary))


def plain() -> Builder:
    """A document of the body."""
    return Builder().body()


def split_positions() -> NDArray[Any]:
    """Corners of the body's triangles, one after the other, as float32."""
    return np.ascontiguousarray(BODY.vertices[BODY.faces.ravel()].astype("<f4"))
