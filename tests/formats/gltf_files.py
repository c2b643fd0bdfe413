"""Kinds of GLB and glTF files: containers, accessors, scenes."""

import json
from typing import Any

import numpy as np

from tests.formats.gltf_builders import Builder, chunk, glb_of, plain, split_positions
from tests.formats.kinds import BODY, Facts, kind, refused

POSITIONS = BODY.vertices.astype("<f4")
INDICES = BODY.faces.astype("<u4").ravel()


def parts(builder: Builder) -> tuple[bytes, bytes]:
    """JSON and binary data of a document."""
    buffers = [{"byteLength": len(builder.binary)}]
    return json.dumps(builder.document | {"buffers": buffers}).encode(), builder.binary


@kind("glTF", "GLB: one file, as the format's text says", "Read.")
def as_glb() -> bytes:
    return plain().glb()


@kind("glTF", ".gltf with its buffer embedded", "Read.", filename="scene.gltf")
def as_gltf() -> bytes:
    return plain().gltf()


@kind(
    "glTF",
    ".gltf whose Base64 is URL-safe, without padding, or percent-encoded",
    "Read.",
    filename="scene.gltf",
)
def url_safe() -> bytes:
    document = json.loads(plain().gltf())
    uri = document["buffers"][0]["uri"]
    document["buffers"][0]["uri"] = "DATA:;Base64," + uri.partition(",")[2].rstrip("=").replace(
        "+", "-"
    ).replace("/", "_")
    return json.dumps(document).encode()


@kind("glTF", ".gltf with a byte order mark, ending in zeros", "Read.", filename="scene.gltf")
def marked() -> bytes:
    return b"\xef\xbb\xbf" + plain().gltf() + b"\0\0\0 \n"


@kind(
    "glTF",
    "JSON that is Latin-1 instead of UTF-8",
    "Read; names may look odd.",
    repairs=("not UTF-8",),
)
def latin() -> bytes:
    text, binary = parts(plain())
    text = text.replace(b'"asset"', b'"x": "caf\xe9", "asset"')
    return glb_of(chunk(b"JSON", text, b" "), chunk(b"BIN\0", binary))


@kind("glTF", "NaN among the numbers of its JSON", "Read; JSON has none, but some writers do.")
def not_a_number() -> bytes:
    builder = plain()
    builder.document["accessors"][0]["min"] = [float("nan")] * 3
    return builder.glb()


@refused(
    "glTF",
    ".gltf without the .bin that it refers to",
    "Refused, naming the file: send both together, in a zip or in one upload.",
    reason="needs 'my scene.bin', which did not come with it: send the two together, in a zip",
    filename="scene.gltf",
)
def without_buffer() -> bytes:
    return plain().gltf("my%20scene.bin")


@refused(
    "glTF",
    "glTF 1.0",
    "Refused: export it again as glTF 2.0 (GLB).",
    reason="glTF version 1.0; expected 2.0: open it in Blender",
    filename="old.gltf",
)
def version_1() -> bytes:
    content: dict[str, Any] = {"asset": {"version": "1.0"}, "meshes": {}, "accessors": {}}
    return json.dumps(content).encode()


@refused("glTF", "GLB of glTF 1.0", "Refused as glTF 1.0 is.", reason="GLB version 1")
def binary_version_1() -> bytes:
    return b"glTF\1\0\0\0" + plain().glb()[8:]


for difference, words in ((8, "more"), (-8, "fewer"), (-(1 << 31), "many fewer")):

    @kind(
        "glTF",
        f"GLB whose header declares {words} bytes than there are",
        "Read: all chunks that are there.",
        repairs=("the GLB header declares",),
    )
    def wrong_length(difference: int = difference) -> bytes:
        data = plain().glb()
        length = max(len(data) + difference, 0)
        return data[:8] + length.to_bytes(4, "little") + data[12:]


@kind(
    "glTF",
    "GLB cut short behind its geometry",
    "Read, and said.",
    repairs=("the last chunk of the GLB file is truncated",),
)
def cut_behind() -> bytes:
    builder = plain()
    builder.view(b"\0" * 5000)
    return builder.glb()[:-4000]


@refused(
    "glTF",
    "GLB cut short within its geometry",
    "Refused: it is truncated.",
    reason="more than its buffer holds: it is truncated",
)
def cut_within() -> bytes:
    return plain().glb()[:-400]


@kind("glTF", "GLB with unknown chunks", "Read; unknown chunks are passed over.")
def unknown_chunks() -> bytes:
    text, binary = parts(plain())
    other = chunk(b"XYZ\0", b"what is this")
    return glb_of(other, chunk(b"JSON", text, b" "), other, chunk(b"BIN\0", binary), other)


@kind(
    "glTF",
    "GLB whose binary data come before its JSON",
    "Read, and said.",
    repairs=("the JSON of the GLB file does not come first",),
)
def binary_first() -> bytes:
    text, binary = parts(plain())
    return glb_of(chunk(b"BIN\0", binary), chunk(b"JSON", text, b" "))


@kind("glTF", "GLB whose JSON is padded with zeros", "Read.")
def padded_with_zeros() -> bytes:
    text, binary = parts(plain())
    return glb_of(chunk(b"JSON", text + b"\0" * 5), chunk(b"BIN\0", binary))


@kind("glTF", "GLB whose chunks are padded, but the padding is not counted", "Read.")
def padding_not_counted() -> bytes:
    text, binary = parts(plain())
    text += b" " * (-len(text) % 4 + 1)
    first = len(text).to_bytes(4, "little") + b"JSON" + text + b"   "
    return glb_of(first, chunk(b"BIN\0", binary))


@kind("glTF", "triangles without indices", "Read; equal corners are joined.")
def unindexed() -> bytes:
    builder = Builder()
    builder.primitive(builder.accessor(split_positions()))
    return builder.glb()


def strip_of(separator: int | None, indices: str) -> bytes:
    """The body's triangles as strips of three corners, joined one way or the other."""
    builder = Builder()
    restart = np.iinfo(indices).max
    if separator is None:  # degenerate triangles join the strips
        a, b, c = BODY.faces.T
        corners = np.stack([a, a, b, c, c, c], axis=1)
    else:
        corners = np.concatenate([BODY.faces, np.full((len(BODY.faces), 1), restart)], axis=1)
    array = corners.astype(indices).ravel()
    builder.primitive(builder.accessor(POSITIONS), builder.accessor(array), mode=separator or 5)
    return builder.glb()


@kind("glTF", "triangle strips joined by degenerate triangles", "Cut into triangles.")
def joined_strips() -> bytes:
    return strip_of(None, "<u2")


for mode, name in ((4, "lists"), (5, "strips"), (6, "fans")):
    for indices, value in (("<u2", "0xFFFF"), ("<u4", "0xFFFFFFFF")):

        @kind(
            "glTF",
            f"triangle {name} with the restart index {value}",
            "Read; a new one begins behind the restart index.",
        )
        def restarted(mode: int = mode, indices: str = indices) -> bytes:
            return strip_of(mode, indices)


@refused(
    "glTF",
    "an index that is no vertex",
    "Refused, naming the face.",
    reason="face 7 refers to vertex 4000000000, but the mesh has 642 vertices",
)
def beyond_range() -> bytes:
    builder, indices = Builder(), INDICES.copy()
    indices[22] = 4_000_000_000
    builder.primitive(builder.accessor(POSITIONS), builder.accessor(indices))
    return builder.glb()


@kind("glTF", "positions and normals side by side (byteStride)", "Read.")
def interleaved() -> bytes:
    builder = Builder()
    rows = np.concatenate([POSITIONS, POSITIONS], axis=1)
    view = builder.view(rows.tobytes(), byteStride=24)
    positions = builder.add("accessors", Builder.describe(POSITIONS) | {"bufferView": view})
    builder.primitive(positions, builder.accessor(INDICES))
    return builder.glb()


@kind(
    "glTF",
    "many meshes that share one accessor of positions",
    "Read; each mesh has the vertices that it uses.",
    facts=Facts(vertices=None, tolerance=1e-5),
)
def one_pool() -> bytes:
    builder = Builder()
    positions = builder.accessor(POSITIONS)
    for faces in np.array_split(BODY.faces.astype("<u4"), 40):
        builder.primitive(positions, builder.accessor(faces.ravel()))
    builder.document["nodes"] = [{"mesh": i} for i in range(40)]
    builder.document["scenes"] = [{"nodes": list(range(40))}]
    return builder.glb()


def quantized(values: np.ndarray, scale: float, **more: Any) -> bytes:
    """Integer positions; a node brings them to their size."""
    builder = Builder()
    padded = np.zeros((len(values), 4), dtype=values.dtype)
    padded[:, :3] = values
    view = builder.view(padded.tobytes(), byteStride=padded.strides[0])
    item = Builder.describe(values) | {"bufferView": view} | more
    builder.primitive(builder.add("accessors", item), builder.accessor(INDICES))
    builder.document["nodes"] = [{"mesh": 0, "scale": [scale] * 3}]
    builder.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    return builder.glb()


REACH = float(np.abs(BODY.vertices).max())
SHORTS = np.round(BODY.vertices / REACH * 32767).astype("<i2")
BYTES = np.round((BODY.vertices / REACH + 1) * 127.5).astype("<u1")


@kind(
    "glTF",
    "KHR_mesh_quantization: normalized 16-bit positions",
    "Read as the fractions that they stand for.",
    facts=Facts(tolerance=1e-3),
)
def normalized() -> bytes:
    return quantized(SHORTS, REACH, normalized=True)


@kind(
    "glTF",
    "KHR_mesh_quantization: plain 16-bit positions",
    "Read as the integers that they are.",
    facts=Facts(tolerance=1e-3),
)
def plain_shorts() -> bytes:
    return quantized(SHORTS, REACH / 32767)


@kind(
    "glTF",
    "KHR_mesh_quantization: 8-bit positions",
    "Read; they are as rough as that.",
    facts=Facts(vertices=None, tolerance=0.05),
)
def rough_bytes() -> bytes:
    return quantized(BYTES, REACH / 127.5)


def sparse(builder: Builder, replaced: np.ndarray, **more: Any) -> int:
    """Accessor whose listed positions are replaced."""
    return builder.add(
        "accessors",
        Builder.describe(POSITIONS)
        | {
            "sparse": {
                "count": len(replaced),
                "indices": {
                    "bufferView": builder.view(replaced.astype("<u2").tobytes()),
                    "componentType": 5123,
                },
                "values": {"bufferView": builder.view(POSITIONS[replaced].tobytes())},
            }
        }
        | more,
    )


@kind("glTF", "sparse accessor over a base", "Read; the listed vertices are replaced.")
def sparse_over_base() -> bytes:
    builder, base = Builder(), POSITIONS.copy()
    replaced = np.arange(3, 600, 7)
    base[replaced] = 99
    view = builder.view(base.tobytes())
    builder.primitive(sparse(builder, replaced, bufferView=view), builder.accessor(INDICES))
    return builder.glb()


@kind("glTF", "sparse accessor without a base", "Read; the base is zeros, as the text says.")
def sparse_alone() -> bytes:
    builder = Builder()
    replaced = np.arange(BODY.n_vertices)
    builder.primitive(sparse(builder, replaced), builder.accessor(INDICES))
    return builder.glb()
