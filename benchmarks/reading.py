"""What reading costs as files grow: the exponent of time over size, for every kind of file.

``python -m benchmarks.reading`` makes each file in three sizes, each four times the one before,
and prints the processor time of the largest per megabyte and the exponent of the time: 1 is
linear, 2 is the square. Refused files count too. ``--only NAME`` runs those with NAME in theirs.
``benchmarks.reading_kinds`` does the same for every kind of file that the tests build.
"""

import argparse
import base64
import io
import json
import math
import struct
import time
import zipfile
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from rich.console import Console
from rich.table import Table

from tests.geometry.test_polygons import SHAPES
from workers.errors import ProteusError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh

GROWTH = 4
LONGEST_SECONDS = 60.0  # what takes longer is not made larger
FASTEST = 3  # of so many runs counts

Maker = Callable[[int], bytes]


def sheet(n: int) -> TriangleMesh:
    """About n triangles over a square, as rough as noise."""
    side = max(int(math.sqrt(n / 2)), 2)
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0))
    vertices = np.stack([x.ravel(), y.ravel(), rng.normal(size=x.size)], axis=1)
    a = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    b, c, d = a + 1, a + side + 2, a + side + 1
    return TriangleMesh(vertices, np.concatenate([np.stack(t, 1) for t in ((a, b, c), (a, c, d))]))


def written(form: str) -> Maker:
    """Files of a format that we write."""
    return lambda n: write(sheet(n), form)


def stl_text(n: int) -> bytes:
    """STL as text."""
    mesh = sheet(n)
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
        + "endloop\nendfacet\n"
        for corners in mesh.vertices[mesh.faces].tolist()
    )
    return f"solid s\n{''.join(facets)}endsolid s\n".encode()


def ply_text(n: int) -> bytes:
    """PLY as text."""
    mesh = sheet(n)
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces.tolist()]
    return ply(f"element vertex {mesh.n_vertices}\n{XYZ}element face {mesh.n_faces}\n{LIST}", rows)


XYZ = "property double x\nproperty double y\nproperty double z\n"
LIST = "property list uchar int vertex_indices\n"


def ply(header: str, rows: list[str]) -> bytes:
    """PLY as text from its header and rows."""
    return f"ply\nformat ascii 1.0\n{header}end_header\n{chr(10).join(rows)}\n".encode()


def ply_of_properties(n: int) -> bytes:
    """PLY of a few rows with very many properties."""
    names = "".join(f"property double p{i}\n" for i in range(n // 8))
    row = "0 0 0" + " 1" * (n // 8)
    return ply(f"element vertex 3\n{XYZ}{names}element face 1\n{LIST}", [row, row, row, "3 0 1 2"])


def ply_of_elements(n: int) -> bytes:
    """PLY with very many elements that nobody needs."""
    names = "".join(f"element e{i} 1\nproperty int p\n" for i in range(n // 8))
    rows = ["0"] * (n // 8)
    return ply(
        f"{names}element vertex 3\n{XYZ}element face 1\n{LIST}",
        [*rows, "0 0 0", "1 0 0", "0 1 0", "3 0 1 2"],
    )


def ply_of_unequal_lists(n: int) -> bytes:
    """Binary PLY whose lists are long and short by turns, behind other lists."""
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex 4\n{XYZ}element face {n}\n"
        f"property list uchar uchar flags\n{LIST}end_header\n"
    )
    rows = (
        struct.pack("<BB3i", 0, 3, 0, 1, 2) + struct.pack("<B2BB4i", 2, 0, 0, 4, 0, 1, 2, 3)
    ) * (n // 2)
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    return head.encode() + square.tobytes() + rows


def polygon(shape: str) -> Maker:
    """OBJ of one polygon."""

    def make(n: int) -> bytes:
        corners = SHAPES[shape](n)
        rows = [f"v {x!r} {y!r} 0" for x, y in corners.tolist()]
        return "\n".join([*rows, "f " + " ".join(map(str, range(1, len(corners) + 1)))]).encode()

    return make


def going_round(n: int) -> bytes:
    """OBJ of one polygon that goes round a triangle many times."""
    return b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * (n // 3)


def crossing(n: int) -> bytes:
    """OBJ of one polygon of random corners."""
    corners = np.random.default_rng(1).normal(size=(n, 2)).tolist()
    rows = [f"v {x!r} {y!r} 0" for x, y in corners]
    return "\n".join([*rows, "f " + " ".join(map(str, range(1, n + 1)))]).encode()


def every_size(n: int) -> bytes:
    """OBJ with one star of each number of corners, and as many triangles."""
    sizes = range(5, 5 + int(math.sqrt(2 * n)))
    rows: list[str] = []
    first = 1
    for size in sizes:
        rows += [f"v {x!r} {y!r} 0" for x, y in SHAPES["star"](size).tolist()]
        rows.append("f " + " ".join(map(str, range(first, first + size))))
        rows.append(f"f {first} {first + 1} {first + 2}\n" * size)
        first += size
    return "\n".join(rows).encode()


def small_stars(n: int) -> bytes:
    """OBJ of many concave polygons of eight corners."""
    star = "".join(f"v {x!r} {y!r} 0\n" for x, y in SHAPES["star"](8).tolist())
    return (star + "f -8 -7 -6 -5 -4 -3 -2 -1\n").encode() * (n // 8)


def repeated(piece: bytes, before: bytes = b"", after: bytes = b"") -> Maker:
    """One piece again and again, between a beginning and an end."""
    return lambda n: before + piece * n + after


TRIANGLE_OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2"


def off_stream(n: int) -> bytes:
    """OFF that does not put each row on its own line."""
    first, _, rest = write(sheet(n), "off").partition(b"\n")
    counts, _, body = rest.partition(b"\n")
    return first + b"\n" + counts + b"\n" + body.replace(b"\n", b" ")


def off_of_unequal_rows(n: int) -> bytes:
    """OFF whose rows have colours now and then."""
    lines = write(sheet(n), "off").split(b"\n")
    lines[2::7] = [line + b" 0.5 0.5 0.5" for line in lines[2::7]]
    return b"\n".join(lines)


def gltf(document: dict[str, object], payload: bytes) -> bytes:
    """GLB of a document and its binary part."""
    text = json.dumps({"asset": {"version": "2.0"}, **document}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(payload), b"BIN\0") + payload
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
ONE_TRIANGLE: dict[str, object] = {
    "buffers": [{"byteLength": len(POINTS)}],
    "bufferViews": [{"buffer": 0, "byteLength": len(POINTS)}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
}


def deep_nodes(n: int) -> bytes:
    """Nodes of which each is the child of the one before."""
    nodes: list[dict[str, object]] = [{"children": [i + 1]} for i in range(n // 8)]
    scene = {"nodes": [*nodes, {"mesh": 0}], "scenes": [{"nodes": [0]}]}
    return gltf({**ONE_TRIANGLE, **scene}, POINTS)


def many_nodes(n: int) -> bytes:
    """Nodes without a scene that all show one mesh."""
    return gltf({**ONE_TRIANGLE, "nodes": [{"mesh": 0}] * (n // 8)}, POINTS)


def many_primitives(n: int) -> bytes:
    """A mesh of very many primitives, and as many materials."""
    primitives = [{"attributes": {"POSITION": 0}, "material": i} for i in range(n // 8)]
    scene = {
        "meshes": [{"primitives": primitives}],
        "materials": [{"name": str(i)} for i in range(n // 8)],
        "nodes": [{"mesh": 0}],
    }
    return gltf({**ONE_TRIANGLE, **scene}, POINTS)


def many_chunks(n: int) -> bytes:
    """GLB with very many empty chunks."""
    glb = gltf({**ONE_TRIANGLE, "nodes": [{"mesh": 0}]}, POINTS)
    return _with_length(glb + struct.pack("<I4s", 0, b"none") * n)


def _with_length(glb: bytes) -> bytes:
    """GLB that declares the length it has."""
    return glb[:8] + struct.pack("<I", len(glb)) + glb[12:]


def gltf_text(n: int) -> bytes:
    """GlTF with its buffer within the text."""
    mesh = sheet(n)
    payload = mesh.vertices.astype("<f4").tobytes() + mesh.faces.astype("<u4").tobytes()
    split = 12 * mesh.n_vertices
    uri = f"data:;base64,{base64.b64encode(payload).decode()}"
    document = {
        "asset": {"version": "2.0"},
        "buffers": [
            {"uri": uri, "byteLength": len(payload)}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": split},
            {"buffer": 0, "byteOffset": split, "byteLength": len(payload) - split},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": mesh.n_vertices},
            {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * mesh.n_faces},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
    }  # fmt: skip
    return json.dumps(document).encode()


def threemf(body: str, parts: int = 1, entries: int = 0) -> bytes:
    """3MF archive of so many equal model parts and other entries."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for i in range(parts):
            archive.writestr(f"3D/{i}.model", f"<model>{body}</model>")
        for i in range(entries):
            archive.writestr(f"{i}.txt", "")
    return file.getvalue()


def xml_of(vertices: FloatArray, faces: IntArray) -> str:
    """Vertices and triangles of an object."""
    rows = [f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in vertices.tolist()]
    rows += [f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist()]
    return f"<mesh>{''.join(rows)}</mesh>"


def threemf_mesh(n: int) -> bytes:
    """3MF of one object."""
    mesh = sheet(n)
    item = '<build><item objectid="1"/></build>'
    return threemf(f'<object id="1">{xml_of(mesh.vertices, mesh.faces)}</object>{item}')


SMALL = xml_of(np.eye(3), np.array([[0, 1, 2]]))


def threemf_objects(n: int) -> bytes:
    """3MF of very many objects."""
    return threemf("".join(f'<object id="{i}">{SMALL}</object>' for i in range(n // 8)))


def threemf_components(n: int) -> bytes:
    """3MF of an object of very many components."""
    parts = '<component objectid="1"/>' * (n // 8)
    item = '<build><item objectid="2"/></build>'
    return threemf(f'<object id="1">{SMALL}</object><object id="2">{parts}</object>{item}')


def threemf_comment(n: int) -> bytes:
    """3MF with a comment as long as the file."""
    return threemf(f'<!--{"-a" * (8 * n)}--><object id="1">{SMALL}</object>')


def threemf_attribute(n: int) -> bytes:
    """3MF with an attribute as long as the file."""
    return threemf(f'<object id="1" name="{"a" * (16 * n)}">{SMALL}</object>')


FILES: dict[str, Maker] = {
    "off": written("off"),
    "obj": written("obj"),
    "ply": written("ply"),
    "stl": written("stl"),
    "glb": written("glb"),
    "off, no lines": off_stream,
    "off, rows of unequal length": off_of_unequal_rows,
    "off, a long line": repeated(b" 0", OFF),
    "off, a long number": repeated(b"0", b"OFF\n3 1 0\n0.1", b" 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
    "off, a long comment": repeated(b"#a", OFF.replace(b"3 1 0", b"3 1 0 # ")),
    "off, empty lines": repeated(b"\n", b"OFF\n", OFF[4:]),
    "obj, many groups": repeated(b"g a\nusemtl m\n", TRIANGLE_OBJ),
    "obj, continued lines": repeated(b"\\\n 1 2 3", TRIANGLE_OBJ + b"f 1 2 3"),
    "obj, backslashes": repeated(b"\\  ", TRIANGLE_OBJ),
    "obj, blanks": repeated(b" \t", TRIANGLE_OBJ),
    "obj, blank lines": repeated(b"  \n", TRIANGLE_OBJ),
    "obj, slashes": repeated(b" 1/1/1", TRIANGLE_OBJ + b"f"),
    "obj, relative": repeated(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"),
    "obj, a long token": repeated(b"1", TRIANGLE_OBJ + b"f 1 2 "),
    "ply, text": ply_text,
    "ply, many properties": ply_of_properties,
    "ply, many elements": ply_of_elements,
    "ply, unequal lists": ply_of_unequal_lists,
    "stl, text": stl_text,
    "stl, blanks": repeated(b"vertex \n", b"solid facet\n"),
    "gltf": gltf_text,
    "glb, deep nodes": deep_nodes,
    "glb, many nodes": many_nodes,
    "glb, many primitives": many_primitives,
    "glb, many chunks": many_chunks,
    "gltf, nested lists": repeated(b"[", b'{"asset": {"version": "2.0"}, "nodes": '),
    "3mf": threemf_mesh,
    "3mf, many objects": threemf_objects,
    "3mf, many components": threemf_components,
    "3mf, a long comment": threemf_comment,
    "3mf, a long attribute": threemf_attribute,
    "3mf, many entries": lambda n: threemf(SMALL, entries=n // 64),
    "3mf, many parts": lambda n: threemf(f'<object id="1">{SMALL}</object>', parts=n // 1024),
    **{f"polygon: {shape}": polygon(shape) for shape in SHAPES},
    "polygon: going round": going_round,
    "polygon: crossing": crossing,
    "polygons: every size": every_size,
    "polygons: small stars": small_stars,
}


def seconds(data: bytes, filename: str = "") -> tuple[float, str]:
    """Processor time of reading, the least of three runs, and what came of it."""
    times = []
    outcome = ""
    for _ in range(FASTEST):
        start = time.process_time()
        try:
            outcome = f"{parse(data, filename=filename).mesh.n_faces:,} faces"
        except ProteusError as error:
            outcome = type(error).__name__
        times.append(time.process_time() - start)
        if times[-1] > 2.0:
            break
    return min(times), outcome


def main() -> None:
    """Make, read, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run those with this in their name")
    parser.add_argument("--size", type=int, default=8192, help="triangles of the smallest file")
    asked = parser.parse_args()
    table = Table(title="reading, three sizes each")
    for column in ("file", "largest (MB)", "ms a MB", "exponents", "outcome"):
        table.add_column(column, justify="left" if column in ("file", "outcome") else "right")
    for name, make in FILES.items():
        if asked.only not in name:
            continue
        points: list[tuple[int, float]] = []
        outcome = ""
        for size in (asked.size * GROWTH**i for i in range(3)):
            data = make(size)
            taken, outcome = seconds(data)
            points.append((len(data), taken))
            if taken > LONGEST_SECONDS:
                break
        exponents = [
            f"{math.log(max(t, 1e-4) / max(s, 1e-4)) / math.log(b / a):.2f}"
            for (a, s), (b, t) in pairwise(points)
        ]
        length, taken = points[-1]
        table.add_row(
            name, f"{length / 1e6:.2f}", f"{1e9 * taken / length:.0f}", " ".join(exponents), outcome
        )
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
