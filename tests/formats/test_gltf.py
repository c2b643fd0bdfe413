"""glTF: what is counted before it is read, hostile parts, and numbers beside another reader."""

import json
from typing import Any

import DracoPy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.formats.gltf_builders import Builder, chunk, glb_of, plain
from tests.formats.gltf_compressed_files import DRACO, draco_glb, draco_stream, meshopt_glb
from tests.formats.gltf_scene_files import PLACES, instanced
from tests.formats.kinds import BODY
from workers.errors import InvalidMeshError, ProteusError, UploadTooLargeError
from workers.geometry.formats import MeshLimits, parse
from workers.geometry.formats.gltf.corners import FAN, STRIP, TRIANGLES, triangles
from workers.geometry.formats.gltf.draco import Counts, DracoDecoder, declared_counts

FEW = MeshLimits(vertices=1000, faces=2000)


def signed_volume(data: bytes) -> float:
    mesh = parse(data).mesh
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def changed(key: str, index: int, **values: Any) -> bytes:
    builder = plain()
    builder.document[key][index] |= values
    return builder.glb()


def test_a_mirrored_node_keeps_its_outside_outside() -> None:
    volume = signed_volume(plain().glb())
    assert volume > 0
    assert signed_volume(changed("nodes", 0, scale=[1, -1, 1])) == pytest.approx(volume)
    matrix = [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]
    assert signed_volume(changed("nodes", 0, matrix=matrix)) == pytest.approx(2 * volume)


@pytest.mark.parametrize("mode", [TRIANGLES, STRIP, FAN])
@settings(max_examples=50, deadline=None)
@given(runs=st.lists(st.lists(st.integers(0, 9), max_size=7), min_size=1, max_size=5))
def test_corners_between_restarts_are_as_if_alone(mode: int, runs: list[list[int]]) -> None:
    joined = [corner for run in runs for corner in [*run, 255]][:-1]
    alone = [triangles(np.array(run, dtype=np.int64), mode, None) for run in runs]
    together = triangles(np.array(joined, dtype=np.int64), mode, 255)
    assert_array_equal(together, np.concatenate(alone))


def test_instances_stand_where_another_reader_sees_them() -> None:
    trimesh = pytest.importorskip("trimesh")
    half = np.sqrt(0.5)
    turns = np.array([[0, 0, 0, 1], [half, 0, 0, half], [0, 0, -1, 0]], dtype="<f4")
    mesh = parse(instanced(TRANSLATION=PLACES, ROTATION=turns)).mesh
    for k, (place, (x, y, z, w)) in enumerate(zip(PLACES, turns, strict=True)):
        matrix = trimesh.transformations.quaternion_matrix([w, x, y, z])
        expected = BODY.vertices @ matrix[:3, :3].T + place
        found = mesh.vertices[k * BODY.n_vertices : (k + 1) * BODY.n_vertices]
        assert_allclose(found, expected, atol=1e-6)


def test_instances_are_counted_before_they_are_placed() -> None:
    with pytest.raises(UploadTooLargeError, match="1,926 vertices, but at most 1,000"):
        parse(instanced(TRANSLATION=PLACES), limits=FEW)
    builder = plain()
    number = builder.add("accessors", {"componentType": 5126, "type": "VEC3", "count": 10**9})
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": number}}}
    builder.document["nodes"][0]["extensions"] = extension
    with pytest.raises(UploadTooLargeError, match="642,000,000,000 vertices"):
        parse(builder.glb())


def test_instances_of_unequal_lists_are_refused() -> None:
    with pytest.raises(InvalidMeshError, match="attributes of 2 lengths"):
        parse(instanced(TRANSLATION=PLACES, SCALE=PLACES[:2]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 10**6}, "replaces 1,000,000 of 642 elements"),
        ({"indices": {"bufferView": 0, "componentType": 5123}}, "replaces element"),
        ({"indices": {"bufferView": 0, "componentType": 1}}, "replaces 3 of 642"),
        ({"values": {"bufferView": 99}}, "no buffer view 99"),
        ({"values": {"bufferView": 0, "byteOffset": 1 << 30}}, "more than its buffer holds"),
    ],
)
def test_a_sparse_accessor_that_cannot_be_is_refused(change: dict[str, Any], message: str) -> None:
    builder = plain()
    indices = builder.view(np.arange(3, dtype="<u2").tobytes())
    sparse = {
        "count": 3,
        "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": 0},
    }
    builder.document["accessors"][0]["sparse"] = sparse | change
    with pytest.raises(InvalidMeshError, match=message):
        parse(builder.glb())


def test_accessors_of_zeros_count_as_unpacked() -> None:
    builder = plain()
    del builder.document["accessors"][0]["bufferView"]
    with pytest.raises(UploadTooLargeError, match="unpacks to more"):
        parse(builder.glb(), limits=MeshLimits(unpacked=1000))


def test_meshopt_views_are_counted_before_they_are_unpacked() -> None:
    with pytest.raises(UploadTooLargeError, match="unpacks to more"):
        parse(meshopt_glb(), limits=MeshLimits(unpacked=1000))
    with pytest.raises(InvalidMeshError, match="30,000,000 elements do not fit into"):
        parse(meshopt_glb().replace(b'"count": 3840, "byteS', b'"count": 3e07, "byteS'))


@settings(max_examples=60, deadline=None)
@given(at=st.integers(0, 4000), value=st.integers(0, 255))
def test_damaged_meshopt_data_is_refused_or_read(at: int, value: int) -> None:
    data = bytearray(meshopt_glb())
    data[-1 - at] = value
    try:
        parse(bytes(data))
    except ProteusError:
        return


def sequential_stream(n_points: int, n_faces: int, components: int) -> bytes:
    """A Draco stream whose faces are all of vertex 0, and whose sizes are what they are told."""
    stream = draco_stream(0)
    attributes = bytearray(stream[11 + 2 + 2 + 1 + 2 * BODY.faces.size :])
    assert attributes[:5] == bytes([1, 1, 0, 9, 3])  # one attribute: positions, float, three
    attributes[4] = components
    counts = b"".join(
        bytes([n & 127 | 128, n >> 7 & 127 | 128, n >> 14 & 127]) for n in (n_faces, n_points)
    )
    return stream[:11] + counts + b"\x01" + bytes(3 * n_faces) + bytes(attributes)


def test_draco_counts_are_read_before_the_stream_is_decoded() -> None:
    for level in (0, 5, 10):
        assert declared_counts(draco_stream(level)) == Counts(BODY.n_vertices, BODY.n_faces)
        with pytest.raises(UploadTooLargeError, match="at most 100 are accepted"):
            parse(draco_glb(draco_stream(level)), limits=MeshLimits(faces=100))
    with pytest.raises(InvalidMeshError, match="declares 1,000,000 vertices and 9 faces in"):
        declared_counts(sequential_stream(1_000_000, 9, 3))


def test_a_draco_stream_that_asks_for_gigabytes_is_stopped() -> None:
    """A million points of 255 numbers each; the decoder would take them before reading on."""
    decoder = DracoDecoder(MeshLimits())
    stream = sequential_stream(1_000_000, 340_000, 255)
    try:
        with pytest.raises(InvalidMeshError, match="Draco data of the glTF file is damaged"):
            decoder.decode(stream, 0, Counts(642, 1280))
        points, faces = decoder.decode(draco_stream(), 0, Counts(642, 1280))  # still at work
        assert (points.shape, faces.shape) == ((642, 3), (1280, 3))
    finally:
        decoder.close()


def test_a_decoder_that_dies_is_said_to_have_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workers.geometry.formats.gltf.draco.CHILD", "/nonexistent.py")
    with pytest.raises(InvalidMeshError, match="decoding it crashed, or took more"):
        parse(draco_glb(draco_stream()))


def test_a_decoder_gets_no_more_memory_than_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workers.geometry.formats.gltf.draco.MEMORY", 0)
    monkeypatch.setattr("workers.geometry.formats.gltf.draco.MEMORY_A_FACE", 0)
    with pytest.raises(InvalidMeshError, match="Draco data of the glTF file is damaged"):
        parse(
            draco_glb(
                DracoPy.encode(
                    np.random.default_rng(1).random((9000, 3)), np.arange(9000).reshape(-1, 3)
                )
            )
        )


@pytest.mark.parametrize(
    ("stream", "message"),
    [
        (b"", "no header"),
        (b"DRACO" + bytes(20), "holds points; expected a mesh"),
        (b"DRACO\x02\x03\x01" + bytes(20), r"Draco 2\.3 is not read"),
        (b"DRACO\x02\x02\x01\x01\0\0" + b"\xff" * 20, "no counts"),
        (DracoPy.encode(BODY.vertices), "holds points"),
    ],
)
def test_what_is_no_draco_mesh_is_refused(stream: bytes, message: str) -> None:
    with pytest.raises(ProteusError, match=message):
        parse(draco_glb(stream))


def test_draco_counts_other_than_declared_are_said() -> None:
    data = draco_glb(draco_stream()).replace(b'"count": 642', b'"count": 640')
    parsed = parse(data)
    assert parsed.mesh.n_vertices == BODY.n_vertices
    assert any("declares 640 vertices and 1,280 faces, but its Draco" in x for x in parsed.repairs)


def test_meshes_that_are_shown_often_are_decoded_once() -> None:
    builder = plain()
    nodes = [{"mesh": 0, "translation": [9 * i, 0, 0]} for i in range(300)]
    builder.document |= {"nodes": nodes, "scenes": [{"nodes": list(range(300))}]}
    extension = {DRACO: {"bufferView": builder.view(draco_stream()), "attributes": {"POSITION": 0}}}
    builder.document["meshes"][0]["primitives"][0]["extensions"] = extension
    builder.document["extensionsRequired"] = [DRACO]
    assert parse(builder.glb()).mesh.n_faces == 300 * BODY.n_faces


@pytest.mark.parametrize(
    "text",
    [
        b'{"asset": {"version": "2.0"}, "nodes": ' + b"[" * 5000 + b"]" * 5000 + b"}",
        b'{"asset": {"version": "2.0"}, "scene": ' + b"9" * 5000 + b"}",
        b'{"asset": {"version": 2}, "scene": 1e999, "nodes": [{"mesh": -1}]}',
        b'{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": '
        b'{"POSITION": 0}}]}], "accessors": [{"count": 1e300, "type": "VEC3"}]}',
        b'{"asset": {"version": "2.0"}, "nodes": [' + b"{}," * 1_000_001 + b"{}]}",
        b'{"asset": {"version": "2.0"}, "nodes": [NaN]}',
        b'{"asset": {"version": "2.0"}, "scenes": [{"nodes": [NaN, Infinity]}]}',
        b'{"asset": {"version": "2.0"}',
        b"[]",
        b"{}",
    ],
)
def test_hostile_json_is_refused(text: bytes) -> None:
    for data in (text, glb_of(chunk(b"JSON", text, b" "))):
        with pytest.raises(ProteusError):
            parse(data, filename="a.gltf")


def test_transforms_of_huge_numbers_are_refused_and_infinite_ones_passed_on() -> None:
    with pytest.raises(InvalidMeshError, match="scale that is no list of 3 numbers"):
        parse(changed("nodes", 0, scale=[10**400, 1, 1]))
    mesh = parse(changed("nodes", 0, translation=[float("inf"), 0, 0])).mesh
    assert not np.isfinite(mesh.vertices[:, 0]).any()


def test_a_deep_chain_of_nodes_is_no_recursion() -> None:
    builder = plain()
    n = 20_000
    nodes: list[dict[str, Any]] = [{"children": [i + 1]} for i in range(n)]
    builder.document["nodes"] = [*nodes, {"mesh": 0}]
    assert parse(builder.glb()).mesh.n_faces == BODY.n_faces


def test_counts_written_with_a_decimal_point_are_counts() -> None:
    data = json.loads(plain().gltf())
    data["accessors"][0] |= {"count": 642.0, "bufferView": 0.0}
    data["bufferViews"][0]["byteLength"] += 0.0
    assert parse(json.dumps(data).encode()).mesh.n_faces == BODY.n_faces


def test_integers_of_32_bits_and_doubles_are_read_though_no_core_file_has_them() -> None:
    builder = Builder()
    positions = builder.accessor(BODY.vertices.astype("<f4"), componentType=5130)
    builder.document["bufferViews"][0]["byteLength"] *= 2
    builder.binary = BODY.vertices.astype("<f8").tobytes()
    indices = builder.accessor(BODY.faces.astype("<u4").ravel(), componentType=5124)
    builder.primitive(positions, indices)
    assert_array_equal(parse(builder.glb()).mesh.vertices, BODY.vertices)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damaged_files_are_refused_or_read(data: st.DataObject) -> None:
    content = bytearray(draw_file(data))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, min(len(content) - 1, 3000)))
        content[at] = data.draw(st.integers(0, 255))
    try:
        parse(bytes(content), filename="a.glb")
    except ProteusError:
        return


def draw_file(data: st.DataObject) -> bytes:
    files = [plain().glb(), plain().gltf(), instanced(TRANSLATION=PLACES), meshopt_glb()]
    return data.draw(st.sampled_from(files))


def test_damage_to_what_is_left_alone_does_not_matter() -> None:
    builder = plain()
    builder.document |= {"textures": 7, "materials": [3], "animations": {}, "cameras": None}
    builder.document["extensions"] = {"KHR_lights_punctual": {"lights": "x"}}
    assert parse(builder.glb()).mesh.n_faces == BODY.n_faces


def test_signalling_nans_are_passed_on_without_a_warning() -> None:
    builder = plain()
    builder.binary = b"\x01\x00\xa0\x7f" + builder.binary[4:]
    assert np.isnan(parse(builder.glb()).mesh.vertices[0, 0])


def test_streams_and_nodes_count_together() -> None:
    builder = Builder()
    view = builder.view(draco_stream())
    positions = builder.add("accessors", {"componentType": 5126, "count": 3, "type": "VEC3"})
    extension = {DRACO: {"bufferView": view, "attributes": {"POSITION": 0}}}
    one = {"attributes": {"POSITION": positions}, "extensions": extension}
    builder.add("meshes", {"primitives": [one] * 9})
    with pytest.raises(UploadTooLargeError, match="1,284 vertices, but at most 1,000"):
        parse(builder.glb(), limits=FEW)
    with pytest.raises(UploadTooLargeError, match="unpacks to more"):
        parse(builder.glb(), limits=MeshLimits(unpacked=10_000))
    scenes = [{"nodes": list(range(100_001))}]
    builder.document |= {"nodes": [{} for _ in range(100_001)], "scenes": scenes}
    with pytest.raises(UploadTooLargeError, match="over 100,000 nodes"):
        parse(builder.glb())
