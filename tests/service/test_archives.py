"""Uploads of archives, folders and compressed files: what becomes a shape, and what is skipped."""

import gzip
import io
import tarfile
import zipfile

import pytest

from tests.meshes import bumpy_sphere, gltf_with_buffer
from tests.service.conftest import Start
from tests.service.running import DIE, EGG, GEM, Api, Json

PATH = "/v1/collections/zoo/shapes"
CLUTTER = {
    "models/LICENSE": b"free",
    "models/README.md": b"v 1 2 3\nv 4 5 6\nv 7 8 9\nf 1 2 3\n",
    "models/preview.jpg": b"\xff\xd8\xff\xe0",
    "models/cat.gcode": b"G1 X0\n",
    "models/cat.step": b"ISO-10303-21;\nHEADER;\n",
    "models/cat.mtl": b"newmtl a\n",
    "__MACOSX/models/._cat.off": b"\0\5\x16\7",
    "models/.DS_Store": b"\0\0\0\1Bud1",
}
MESHES = {"models/animals/egg.off": EGG, "models/gem.off": GEM, "cat.holes.3.off": DIE}


@pytest.fixture
def park(api: Api) -> Api:
    api.post("/v1/collections", 201, json={"name": "zoo"})
    return api


def zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def tarred(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    return buffer.getvalue()


def ended(api: Api, upload: Json) -> Json:
    api.work()
    job: Json = api.get(f"/v1/jobs/{upload['job']['id']}")
    return job


@pytest.mark.parametrize("way", ["zip", "tar.gz", "files"])
def test_clutter_is_skipped_and_named_however_it_comes(park: Api, way: str) -> None:
    files = {**CLUTTER, **MESHES}
    pack = {"zip": zipped, "tar.gz": tarred}.get(way)
    job = ended(park, park.upload("zoo", {f"all.{way}": pack(files)} if pack else files))
    assert (job["state"], job["errors"]) == ("succeeded", [])
    assert job["progress"] == {"done": 3, "total": 3, "unit": "shapes"}
    assert job["skipped_count"] == len(CLUTTER)
    skipped = {one["item"]: one["detail"] for one in job["skipped"]}
    assert skipped.keys() == CLUTTER.keys()
    assert skipped["models/preview.jpg"] == "picture"
    assert "STEP" in skipped["models/cat.step"]
    shapes = park.get(PATH)["items"]
    assert {(s["path"], s["name"], s["label"]) for s in shapes} == {
        ("models/animals/egg.off", "egg.off", "animals"),
        ("models/gem.off", "gem.off", "models"),
        ("cat.holes.3.off", "cat.holes.3.off", "cat"),
    }
    assert {s["state"] for s in shapes} == {"ready"}


def test_files_without_any_mesh_among_them_fail_with_their_reasons(park: Api) -> None:
    job = ended(park, park.upload("zoo", {"a.png": b"\x89PNG\r\n\x1a\n", "b.txt": b"hello"}))
    assert job["skipped_count"] == 0
    assert {error["item"] for error in job["errors"]} == {"a.png", "b.txt"}
    alone = ended(park, park.upload("zoo", {"c.step": b"ISO-10303-21;\nHEADER;\n"}))
    assert "STEP" in alone["errors"][0]["detail"]


def test_an_archive_without_any_mesh_says_what_was_there(park: Api) -> None:
    job = ended(park, park.upload("zoo", {"a.zip": zipped({"a.png": b"", "b.txt": b"", "c": b""})}))
    assert job["state"] == "failed"
    (error,) = job["errors"]
    assert error["item"] == "a.zip"
    assert "no mesh, only 1 picture, 1 text, 1 other" in error["detail"]
    assert job["skipped_count"] == 3
    assert park.get(PATH)["items"] == []


def test_folders_are_no_labels_where_the_client_says_so(park: Api) -> None:
    files = {"cats/egg.off": EGG, "a.zip": zipped({"dogs/gem.off": GEM})}
    park.upload("zoo", files, data={"labels_from_folders": "false"})
    park.work()
    shapes = park.get(PATH)["items"]
    assert {(s["path"], s["label"]) for s in shapes} == {
        ("cats/egg.off", None),
        ("dogs/gem.off", None),
    }


def test_compressed_meshes_are_shapes_of_the_format_within(park: Api) -> None:
    packed = gzip.compress(EGG)
    (shape,) = park.upload("zoo", {"cats/egg.off.gz": packed})["shapes"]
    park.work()
    found = park.get(f"/v1/shapes/{shape['id']}")
    assert (found["state"], found["format"], found["name"]) == ("ready", "off", "egg.off.gz")
    answer = park.client.get(f"/v1/shapes/{shape['id']}/mesh")
    assert (answer.content, answer.headers["content-type"]) == (packed, "application/octet-stream")
    assert "egg.off.gz" in answer.headers["content-disposition"]
    ply = park.client.get(f"/v1/shapes/{shape['id']}/mesh?format=ply")
    assert "egg.ply" in ply.headers["content-disposition"]


@pytest.mark.parametrize("way", ["zip", "files"])
def test_a_gltf_file_and_what_it_refers_to_are_one_shape(park: Api, way: str) -> None:
    document, binary = gltf_with_buffer(bumpy_sphere(2, seed=5))
    files = {
        "model/scene.gltf": document,
        "model/scene.bin": binary,
        "model/skin.png": b"\x89PNG",
    }
    sent = {"a.zip": zipped(files)} if way == "zip" else files
    job = ended(park, park.upload("zoo", sent))
    assert job["errors"] == []
    assert {one["item"] for one in job["skipped"]} <= {"model/scene.bin", "model/skin.png"}
    (shape,) = park.get(PATH)["items"]
    assert (shape["name"], shape["path"]) == ("scene.gltf", "model/scene.gltf")
    assert (shape["format"], shape["state"]) == ("glb", "ready")
    answer = park.client.get(f"/v1/shapes/{shape['id']}/mesh")
    assert answer.content.startswith(b"glTF")
    assert answer.headers["content-type"] == "model/gltf-binary"
    assert "scene.glb" in answer.headers["content-disposition"]
    assert park.ask_mesh("zoo", zipped(files), 202)["query_id"]


def test_a_query_may_be_an_archive_of_one_mesh(park: Api) -> None:
    park.upload("zoo", {"egg.off": EGG})
    with park.worker():
        for content in (
            zipped({"egg.off": EGG, "a.png": b""}),
            tarred({"x/egg.off": EGG}),
            gzip.compress(EGG),
        ):
            found = park.ask_mesh("zoo", content, wait=30)
            assert found["matches"][0]["distance"] == pytest.approx(0, abs=1e-6)
        several = park.ask_mesh("zoo", zipped({"a.off": EGG, "b.off": GEM}), 422, wait=30)
        assert "several meshes" in several["detail"]
        none = park.ask_mesh("zoo", zipped({"a.png": b""}), 422, wait=30)
        assert "no mesh, only 1 picture" in none["detail"]


def test_bombs_fail_alone(start: Start) -> None:
    api = start(max_upload_bytes=1 << 20, max_zip_bytes=8 << 20)
    api.post("/v1/collections", 201, json={"name": "zoo"})
    zeros = bytes(20 << 20)
    bombs = {
        "bomb.off.gz": gzip.compress(zeros),
        "bomb.tar.gz": tarred({"a.off": zeros}),
        "bomb.zip": zipped({"a.off": zeros}),
        "inner.zip": zipped({f"{n}.zip": zipped({"a.off": bytes(1 << 19)}) for n in range(20)}),
    }
    job = ended(api, api.upload("zoo", {**bombs, "egg.off": EGG}))
    assert job["state"] == "succeeded"
    errors = {error["item"].partition("/")[0]: error["type"] for error in job["errors"]}
    assert errors == dict.fromkeys(bombs, "upload-too-large")
    ready = [shape["name"] for shape in api.get(PATH)["items"] if shape["state"] == "ready"]
    assert ready == ["egg.off"]


def test_what_reading_found_is_said(park: Api) -> None:
    document, binary = gltf_with_buffer(bumpy_sphere(1))
    document = document.replace(b'"images"', b'"textures": [{"source": 0}], "images"')
    park.upload("zoo", {"a.zip": zipped({"scene.gltf": document, "scene.bin": binary})})
    park.work()
    (found,) = park.get(PATH)["items"]
    assert found["found"] == ["1 texture"]
