"""GLB, glTF and 3MF: scenes of several meshes, their transforms, and what is refused."""

import base64
import io
import json
import zipfile
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import box, octahedron
from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats import MeshLimits, parse, write
from workers.geometry.mesh import TriangleMesh

CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'


def gltf_document(mesh: TriangleMesh, **changes: Any) -> dict[str, Any]:
    """Document with positions, byte indices and an embedded buffer."""
    positions = mesh.vertices.astype("<f4").tobytes()
    indices = mesh.faces.astype("<u1").tobytes()
    data = base64.b64encode(positions + indices).decode()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": mesh.n_vertices},
            {"bufferView": 1, "componentType": 5121, "type": "SCALAR", "count": mesh.faces.size},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(positions)},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "buffers": [
            {
                "byteLength": len(positions) + len(indices),
                "uri": f"data:application/octet-stream;base64,{data}",
            }
        ],
    }
    return document | changes


def as_bytes(document: dict[str, Any]) -> bytes:
    return json.dumps(document).encode()


def archive_3mf(model: str, *, extra: dict[str, str] | None = None) -> bytes:
    """3MF archive of one model part, and others by name."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("3D/3dmodel.model", model)
        for name, text in (extra or {}).items():
            archive.writestr(name, text)
    return file.getvalue()


def mesh_xml(mesh: TriangleMesh) -> str:
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh>"


def model_xml(resources: str, build: str) -> str:
    return f"<model {CORE}><resources>{resources}</resources><build>{build}</build></model>"


def test_embedded_gltf_is_read() -> None:
    parsed = parse(as_bytes(gltf_document(box())), filename="box.obj")
    assert parsed.format == "gltf"
    assert_allclose(parsed.mesh.vertices, box().vertices)
    assert_array_equal(parsed.mesh.faces, box().faces)


def test_nodes_are_placed_by_matrix_and_by_translation_rotation_scale() -> None:
    half = np.sqrt(0.5)
    nodes = [
        {"children": [1, 2], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1]},
        {"mesh": 0},
        {"mesh": 0, "translation": [0, 5, 0], "rotation": [0, 0, half, half], "scale": [1, 2, 3]},
    ]
    mesh = parse(as_bytes(gltf_document(box(), nodes=nodes))).mesh
    assert (mesh.n_vertices, mesh.n_faces) == (16, 24)
    x, y, z = box().vertices.T
    assert_allclose(mesh.vertices[:8], np.stack([2 * x + 10, 2 * y, 2 * z], axis=1), atol=1e-6)
    turned = np.stack([-2 * y, x + 5, 3 * z], axis=1)  # a quarter turn about z
    assert_allclose(mesh.vertices[8:], 2 * turned + [10, 0, 0], atol=1e-6)


def test_another_reader_sees_the_same_scene() -> None:
    trimesh = pytest.importorskip("trimesh")
    nodes = [{"mesh": 0, "rotation": [0.1, 0.2, 0.3, np.sqrt(0.86)], "scale": [1, 2, 3]}]
    document = gltf_document(octahedron(), nodes=nodes)
    file = trimesh.util.wrap_as_stream(as_bytes(document))
    other = trimesh.load(file, file_type="gltf", process=False, force="mesh")
    assert_allclose(parse(as_bytes(document)).mesh.vertices, other.vertices, atol=1e-6)


@pytest.mark.parametrize(
    ("mode", "expected"), [(5, [[0, 1, 2], [2, 1, 3]]), (6, [[0, 1, 2], [0, 2, 3]])]
)
def test_strips_and_fans_become_triangles(mode: int, expected: list[list[int]]) -> None:
    corners = np.array([[0, 1, 2]])
    document = gltf_document(TriangleMesh(np.eye(4)[:, :3], corners))
    del document["meshes"][0]["primitives"][0]["indices"]
    document["meshes"][0]["primitives"][0]["mode"] = mode
    assert_array_equal(parse(as_bytes(document)).mesh.faces, expected)


def test_primitives_that_share_positions_share_vertices() -> None:
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    document = gltf_document(box(), meshes=[{"primitives": [primitive, primitive]}])
    mesh = parse(as_bytes(document)).mesh
    assert (mesh.n_vertices, mesh.n_faces) == (8, 24)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"buffers": [{"byteLength": 4, "uri": "a%20b.bin"}]}, InvalidMeshError, "'a b.bin'.*zip"),
        ({"buffers": [{"byteLength": 4, "uri": "http://x/y"}]}, InvalidMeshError, "is fetched"),
        ({"asset": {"version": "1.0"}}, UnsupportedFormatError, "version 1.0"),
        ({"accessors": [{"count": 10**12}] * 2}, UploadTooLargeError, "1,000,000,000,000 vertices"),
        ({"accessors": []}, InvalidMeshError, "no accessor 0"),
        ({"nodes": "x"}, InvalidMeshError, "damaged: 'nodes'"),
        ({"nodes": [{"mesh": 7}]}, InvalidMeshError, "no mesh 7"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1]}]}, InvalidMeshError, "scale.*3 numbers"),
    ],
)
def test_bad_gltf_is_refused_with_its_reason(
    changes: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        parse(as_bytes(gltf_document(box(), **changes)))


def test_a_gltf_accessor_beyond_its_buffer_is_refused_before_it_is_read() -> None:
    document = gltf_document(box())
    document["accessors"][0]["count"] = 1_000_000
    with pytest.raises(InvalidMeshError, match="1,000,000 elements, more than its buffer"):
        parse(as_bytes(document))


def test_a_gltf_of_points_has_no_faces() -> None:
    document = gltf_document(box())
    document["meshes"][0]["primitives"][0]["mode"] = 0
    with pytest.raises(InvalidMeshError, match="points but no faces"):
        parse(as_bytes(document))


def test_3mf_places_components_by_their_transforms() -> None:
    resources = (
        f'<object id="1" type="model">{mesh_xml(box())}</object>'
        '<object id="2"><components><component objectid="1" '
        'transform="0 1 0 -1 0 0 0 0 1 5 0 0"/><component objectid="1"/></components></object>'
    )
    build = '<item objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 1"/>'
    parsed = parse(archive_3mf(model_xml(resources, build)))
    assert (parsed.format, parsed.up, parsed.mesh.n_faces) == ("3mf", "z", 24)
    x, y, z = box().vertices.T
    assert_allclose(parsed.mesh.vertices[:8], np.stack([10 - 2 * y, 2 * x, 2 * z + 1], axis=1))
    assert_allclose(parsed.mesh.vertices[8:], np.stack([2 * x, 2 * y, 2 * z + 1], axis=1))


def test_3mf_without_a_build_holds_its_objects() -> None:
    model = model_xml(f'<object id="1">{mesh_xml(octahedron())}</object>', "")
    assert_allclose(parse(archive_3mf(model)).mesh.vertices, octahedron().vertices)


def test_3mf_parts_refer_to_each_other() -> None:
    main = model_xml(
        '<object id="9"><components><component xmlns:p="prod" p:path="/3D/Objects/a.model" '
        'objectid="1"/></components></object>',
        '<item objectid="9"/>',
    )
    other = model_xml(f'<object id="1">{mesh_xml(box())}</object>', "")
    parsed = parse(archive_3mf(main, extra={"3D/Objects/a.model": other}))
    assert parsed.mesh.n_faces == 12


CIRCLE = model_xml(
    '<object id="1"><components><component objectid="1"/><component objectid="1"/>'
    "</components></object>",
    '<item objectid="1"/>',
)
ENTITIES = (
    '<!DOCTYPE model [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>'
    f"<model {CORE}><metadata>&b;</metadata></model>"
)


@pytest.mark.parametrize(
    ("model", "error", "message"),
    [
        (CIRCLE, InvalidMeshError, "circle"),
        (ENTITIES, InvalidMeshError, "document type"),
        (model_xml("", '<item objectid="7"/>'), InvalidMeshError, "no object '7'"),
        ("<model>", InvalidMeshError, "XML of the 3MF file is damaged"),
        (model_xml('<object id="1"><vertex x="1"/></object>', ""), InvalidMeshError, "lacks"),
        (model_xml("", ""), InvalidMeshError, "neither vertices nor faces"),
        (f"<model>{' ' * 3_000_000}</model>", UploadTooLargeError, "200 times"),
    ],
)
def test_bad_3mf_is_refused_with_its_reason(
    model: str, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        parse(archive_3mf(model))


def test_instances_count_against_the_limits() -> None:
    items = '<item objectid="1"/>' * 20
    model = model_xml(f'<object id="1">{mesh_xml(box())}</object>', items)
    with pytest.raises(UploadTooLargeError, match="at most 100 are accepted"):
        parse(archive_3mf(model), limits=MeshLimits(vertices=100))
    nodes = [{"mesh": 0} for _ in range(20)]
    document = gltf_document(box(), nodes=nodes, scenes=[{"nodes": list(range(20))}])
    with pytest.raises(UploadTooLargeError, match="at most 100 are accepted"):
        parse(as_bytes(document), limits=MeshLimits(vertices=100))


def test_a_zip_of_something_else_says_what_is_in_it() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(InvalidMeshError, match="the archive holds no mesh, only 1 text"):
        parse(file.getvalue(), filename="thing.3mf")


def test_a_glb_chunk_of_odd_length_is_padded() -> None:
    data = write(octahedron(), "glb")
    assert len(data) % 4 == 0
    assert int.from_bytes(data[8:12], "little") == len(data)


def test_a_glb_of_very_many_empty_chunks_is_read() -> None:
    """Each chunk once copied the rest of the file: this one took ten minutes."""
    glb = write(box(), "glb")
    longer = glb + (b"\0\0\0\0none" * 500_000)
    data = longer[:8] + len(longer).to_bytes(4, "little") + longer[12:]
    assert parse(data).mesh.n_faces == 12


def test_3mf_parts_count_together_however_they_lie_in_the_archive() -> None:
    """Entries may share their bytes, so that each alone unpacks to little enough."""
    model = f"<model>{' ' * 150_000}</model>"
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for i in range(40):
            archive.writestr(f"3D/{i}.model", model)
    assert len(file.getvalue()) < 20_000
    with pytest.raises(UploadTooLargeError, match="200 times the file's size"):
        parse(file.getvalue())


def test_a_tag_longer_than_a_piece_is_read() -> None:
    """expat once read an unfinished tag from its beginning for every piece."""
    comment = "".join(f"{i} " for i in range(300_000))
    long = f'<object id="1" name="{comment}">{mesh_xml(box())}</object><!--{comment}-->'
    assert parse(archive_3mf(model_xml(long, '<item objectid="1"/>'))).mesh.n_faces == 12
