"""Kinds of GLB files under Draco or meshopt compression."""

from typing import Any

import DracoPy
import meshopt
import numpy as np

from tests.formats.gltf_builders import Builder
from tests.formats.kinds import BODY, Facts, kind, refused

POSITIONS = BODY.vertices.astype("<f4")
INDICES = BODY.faces.astype("<u4").ravel()
ROUNDED = Facts(tolerance=1e-3)
DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"


def draco_stream(level: int = 7, **more: Any) -> bytes:
    """The body as a Draco stream."""
    faces = BODY.faces.astype("<u4")
    return bytes(DracoPy.encode(POSITIONS, faces, compression_level=level, **more))


def draco_glb(stream: bytes, *, attribute: int = 0) -> bytes:
    """A GLB of one Draco stream that declares the body's counts."""
    builder = Builder()
    view = builder.view(stream)
    positions = builder.add("accessors", Builder.describe(POSITIONS))
    indices = builder.add("accessors", Builder.describe(INDICES))
    extension = {DRACO: {"bufferView": view, "attributes": {"POSITION": attribute}}}
    builder.primitive(positions, indices, extensions=extension)
    builder.document["extensionsRequired"] = [DRACO]
    return builder.glb()


for level, words in ((0, "in sequence"), (5, "by edgebreaker"), (10, "by edgebreaker, hardest")):

    @kind("glTF", f"Draco compression, {words}", "Decompressed.", facts=ROUNDED)
    def draco(level: int = level) -> bytes:
        return draco_glb(draco_stream(level))


@kind(
    "glTF", "Draco compression with normals, colours and metadata", "Decompressed.", facts=ROUNDED
)
def draco_with_more() -> bytes:
    more: dict[str, Any] = {
        "normals": BODY.vertices,
        "colors": np.zeros((BODY.n_vertices, 3), dtype=np.uint8),
    }
    stream = draco_stream(create_metadata=True, **more)
    attributes = DracoPy.decode(stream).attributes
    number = next(item["unique_id"] for item in attributes if item["attribute_type"] == 0)
    assert number != 0  # the file says which attribute holds the positions
    return draco_glb(stream, attribute=number)


@kind(
    "glTF",
    "Draco compression beside plain data",
    "The plain data are read, if the file allows it.",
)
def draco_as_an_option() -> bytes:
    builder = Builder().body()
    extension = {DRACO: {"bufferView": builder.view(b"nothing"), "attributes": {"POSITION": 0}}}
    builder.document["meshes"][0]["primitives"][0]["extensions"] = extension
    return builder.glb()


@refused("glTF", "damaged Draco data", "Refused.", reason="the Draco data of the glTF file")
def damaged_draco() -> bytes:
    stream = draco_stream()
    return draco_glb(stream[:300] + bytes(300) + stream[600:])


def meshopt_glb(name: str = MESHOPT, *, version: int = 0, filtered: bool = False) -> bytes:
    """A GLB as gltfpack writes it: views that fall back to a buffer without data."""
    builder = Builder()

    def view(data: bytes, count: int, stride: int, mode: str, **more: Any) -> int:
        number = builder.view(data)
        item = builder.document["bufferViews"][number]
        extension = item | {"count": count, "byteStride": stride, "mode": mode} | more
        plain = {"buffer": 1, "byteLength": count * stride, "extensions": {name: extension}}
        if mode == "ATTRIBUTES":
            plain["byteStride"] = stride
        builder.document["bufferViews"][number] = plain
        return number

    values = meshopt.encode_filter_exp(POSITIONS, 20) if filtered else POSITIONS
    more = {"filter": "EXPONENTIAL"} if filtered else {}
    encoded = meshopt.encode_gltf_buffer(values, "ATTRIBUTES", version)
    positions = view(encoded, len(POSITIONS), 12, "ATTRIBUTES", **more)
    indices = view(meshopt.encode_gltf_buffer(INDICES, "TRIANGLES"), len(INDICES), 4, "TRIANGLES")
    describe = Builder.describe
    builder.primitive(
        builder.add("accessors", describe(POSITIONS) | {"bufferView": positions}),
        builder.add("accessors", describe(INDICES) | {"bufferView": indices}),
    )
    builder.document["extensionsRequired"] = [name]
    data = builder.glb()
    return data


@kind("glTF", "EXT_meshopt_compression (gltfpack -c)", "Decompressed.")
def meshopt_compressed() -> bytes:
    return meshopt_glb()


@kind("glTF", "KHR_meshopt_compression", "Decompressed.")
def meshopt_khr() -> bytes:
    return meshopt_glb("KHR_meshopt_compression", version=1)


@kind("glTF", "meshopt compression with a filter", "Decompressed.", facts=Facts(tolerance=1e-4))
def meshopt_filtered() -> bytes:
    return meshopt_glb(filtered=True)
