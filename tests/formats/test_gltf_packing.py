"""A .gltf and the files beside it become one GLB."""

import json
from typing import Any

import pytest
from numpy.testing import assert_allclose

from tests.formats.gltf_builders import plain
from tests.formats.kinds import BODY
from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats import parse
from workers.geometry.formats.gltf.container import open_gltf
from workers.geometry.formats.gltf.packing import pack_glb, referenced_files

PNG = b"\x89PNG\r\n\x1a\nnot really"


def with_images(buffer: str = "scene.bin", *images: dict[str, Any]) -> bytes:
    builder = plain()
    builder.document["images"] = list(images)
    return builder.gltf(buffer)


def test_files_are_named_once_in_the_order_of_the_document() -> None:
    document = json.loads(plain().gltf("my%20scene.bin"))
    document["buffers"].append({"byteLength": 4, "uri": "data:;base64,AAAA"})
    document["images"] = [{"uri": "./textures/a.png"}, {"uri": "./textures/a.png"}]
    document["images"] += [{"uri": "http://x/y.png"}, {"bufferView": 0}]
    assert referenced_files(json.dumps(document).encode()) == ("my scene.bin", "textures/a.png")
    assert referenced_files(plain().glb()) == ()


@pytest.mark.parametrize("data", [b"{}", b"[1]", b"{", b"[" * 100_000, b'{"asset": 1}'])
def test_what_is_no_gltf_is_refused(data: bytes) -> None:
    for function in (referenced_files, lambda data: pack_glb(data, {})):
        with pytest.raises(InvalidMeshError):
            function(data)


def test_gltf_1_names_no_files_and_is_not_packed() -> None:
    document = json.dumps({"asset": {"version": "1.0"}, "buffers": {"a": {"uri": "a.bin"}}})
    assert referenced_files(document.encode()) == ()
    with pytest.raises(UnsupportedFormatError, match=r"version 1\.0; expected 2\.0"):
        pack_glb(document.encode(), {})


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("scene.bin", "scene.bin"),
        ("my%20scene.bin", "my%20scene.bin"),
        ("my%20scene.bin", "my scene.bin"),
        ("./scene.bin", "scene.bin"),
        ("Scene.BIN", "scene.bin"),
        ("buffers\\scene.bin", "buffers/scene.bin"),
        ("buffers/scene.bin", "scene.bin"),
        ("scene.bin", "model/deep/Scene.bin"),
        ("C:\\models\\scene.bin", "scene.bin"),
        ("file:///home/me/scene.bin", "scene.bin"),
        ("caf%C3%A9.bin", "cafe\u0301.bin"),  # as macOS stores accents
    ],
)
def test_a_buffer_is_found_under_the_names_that_archives_give_it(uri: str, name: str) -> None:
    files = {name: plain().binary, "other/readme.txt": b"hello"}
    mesh = parse(pack_glb(plain().gltf(uri), files)).mesh
    assert_allclose(mesh.vertices, BODY.vertices, rtol=1e-6)


def test_the_exact_name_goes_before_its_likes() -> None:
    files = {"SCENE.bin": b"", "a/scene.bin": b"", "scene.bin": plain().binary}
    assert parse(pack_glb(plain().gltf("scene.bin"), files)).mesh.n_faces == BODY.n_faces


@pytest.mark.parametrize("names", [[], ["other.bin"], ["a/scene.bin", "b/scene.bin"]])
def test_a_missing_or_ambiguous_buffer_is_named(names: list[str]) -> None:
    with pytest.raises(InvalidMeshError, match=r"needs 'scene\.bin'.*send the two together"):
        pack_glb(plain().gltf("scene.bin"), dict.fromkeys(names, plain().binary))


def test_images_are_embedded_and_missing_ones_keep_their_uri() -> None:
    image = {"uri": "textures/a.png", "name": "skin"}
    document = with_images("scene.bin", image, {"uri": "gone.png"}, {"uri": "TEXTURES/A.png"})
    files = {"textures/a.png": PNG, "scene.bin": plain().binary}
    packed = pack_glb(document, files)
    container = open_gltf(packed)
    first, gone, again = container.document["images"]
    assert gone == {"uri": "gone.png"}
    assert (first["name"], first["mimeType"]) == ("skin", "image/png")
    for embedded in (first, again):
        view = container.document["bufferViews"][embedded["bufferView"]]
        start = view["byteOffset"]
        assert container.binary is not None
        assert container.binary[start : start + view["byteLength"]] == PNG
    assert len(packed) < len(document) + len(plain().binary) + 2 * len(PNG) + 400
    assert packed == pack_glb(document, dict(reversed(files.items())))


def test_several_buffers_become_one_and_none_reaches_into_the_next() -> None:
    document = json.loads(plain().gltf("a.bin"))
    document["buffers"].append({"byteLength": 999, "uri": "b.bin"})
    size = document["bufferViews"][0]["byteLength"]
    document["bufferViews"][1] |= {"buffer": 1, "byteOffset": 0}
    binary = plain().binary
    files = {"a.bin": binary[:size], "b.bin": binary[size:]}
    text = json.dumps(document).encode()
    assert_allclose(parse(pack_glb(text, files)).mesh.vertices, BODY.vertices, rtol=1e-6)
    with pytest.raises(InvalidMeshError, match="more than its buffer holds"):
        parse(pack_glb(text, files | {"a.bin": binary[: size // 2]}))


def test_a_file_that_many_buffers_name_is_packed_once() -> None:
    document = json.loads(plain().gltf("a.bin"))
    document["buffers"] *= 1000
    packed = pack_glb(json.dumps(document).encode(), {"a.bin": plain().binary})
    assert len(packed) < 2 * len(plain().binary)
    assert parse(packed).mesh.n_faces == BODY.n_faces


def test_the_data_of_a_glb_stays_its_first_buffer() -> None:
    builder = plain()
    builder.document["images"] = [{"uri": "a.png"}]
    mesh = parse(pack_glb(builder.glb(), {"a.png": PNG})).mesh
    assert_allclose(mesh.vertices, BODY.vertices, rtol=1e-6)


def test_another_reader_reads_what_was_packed() -> None:
    trimesh = pytest.importorskip("trimesh")
    packed = pack_glb(plain().gltf("scene.bin"), {"scene.bin": plain().binary})
    file = trimesh.util.wrap_as_stream(packed)
    other = trimesh.load(file, file_type="glb", process=False, force="mesh")
    assert_allclose(other.vertices, BODY.vertices, rtol=1e-6)
