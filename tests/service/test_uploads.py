"""Uploads: streamed, limited, idempotent by content; one bad file does not stop the rest."""

import hashlib
import io
import json
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import func, select

from tests.meshes import tetrahedron
from tests.service.conftest import Start
from tests.service.running import DIE, EGG, GEM, SOLVED, Api, Json
from workers.geometry.formats.containers import archive_kind
from workers.storage.models import Part, Shape

PATH = "/v1/collections/zoo/shapes"


@pytest.fixture
def park(api: Api) -> Api:
    """A service with the empty collection "zoo"."""
    api.post("/v1/collections", 201, json={"name": "zoo"})
    return api


def zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def nothing_is_left(api: Api) -> bool:
    """Whether neither rows nor files of an upload are there."""
    with api.services.database.read() as session:
        rows = session.scalar(select(func.count()).select_from(Shape))
    data = api.settings.data_path
    files = [path for path in (*data.glob("uploads/**/*"), *data.glob("blobs/**/*"))]
    solved = data / SOLVED
    return not rows and not [f for f in files if f.is_file() and solved not in f.parents]


def test_an_upload_becomes_shapes_that_can_be_found(park: Api) -> None:
    answer = park.client.post(PATH, files=[("files", ("egg.off", EGG)), ("files", ("g.off", GEM))])
    accepted = answer.json()
    assert answer.status_code == 202
    assert answer.headers["Location"] == f"/v1/jobs/{accepted['job']['id']}"
    assert int(answer.headers["Retry-After"]) > 0
    assert accepted["job"]["progress"] == {"done": 0, "total": 2, "unit": "shapes"}
    assert [shape["name"] for shape in accepted["shapes"]] == ["egg.off", "g.off"]
    assert accepted["shapes"][0]["sha256"] == hashlib.sha256(EGG).hexdigest()
    assert len(park.services.dispatcher.sent) == 2  # type: ignore[attr-defined]
    park.work()
    assert park.get(f"/v1/jobs/{accepted['job']['id']}")["state"] == "succeeded"
    assert park.ask("zoo", shape_id=accepted["shapes"][0]["id"])["searched"] == 1
    assert not list((park.settings.data_path / "uploads").iterdir())


def test_names_folders_and_form_fields_say_what_a_shape_is(park: Api) -> None:
    files = {"cat.holes.3.off": EGG, "dogs/17.off": GEM, "plain.off": DIE}
    shapes = park.upload("zoo", files)["shapes"]
    said = [(s["name"], s["label"], s["transformation"], s["strength"]) for s in shapes]
    assert said == [
        ("cat.holes.3.off", "cat", "holes", 3),
        ("17.off", "dogs", None, None),
        ("plain.off", None, None, None),
    ]
    park.post("/v1/collections", 201, json={"name": "other"})
    data = {"label": "owl", "metadata": '{"year": 2024}'}
    shapes = park.upload("other", files, data=data)["shapes"]
    assert [shape["label"] for shape in shapes] == ["owl"] * 3
    assert [shape["metadata"] for shape in shapes] == [{"year": 2024}] * 3
    assert shapes[0]["transformation"] == "holes"


def test_the_same_bytes_are_one_shape_within_a_request_and_across(park: Api) -> None:
    first = park.upload("zoo", {"a.off": EGG, "b.off": EGG, "c.off": GEM})
    assert [shape["name"] for shape in first["shapes"]] == ["a.off", "c.off"]
    assert first["job"]["progress"]["total"] == 2
    again = park.upload("zoo", {"x.off": GEM, "y.off": EGG})
    assert again["job"]["id"] == first["job"]["id"]  # it is at work on them
    assert [shape["name"] for shape in again["shapes"]] == ["c.off", "a.off"]
    assert park.work() == 2
    ended = park.upload("zoo", {"x.off": GEM}, 200)
    assert ended["job"]["state"] == "succeeded"
    assert ended["job"]["progress"] == {"done": 1, "total": 1, "unit": "shapes"}
    assert ended["shapes"][0]["state"] == "ready"
    mixed = park.upload("zoo", {"x.off": GEM, "d.off": DIE})["job"]
    assert mixed["progress"] == {"done": 1, "total": 2, "unit": "shapes"}
    assert park.work() == 1


def test_of_many_that_upload_the_same_one_computes(park: Api) -> None:
    def send(_: int) -> set[str]:
        answer = park.client.post(PATH, files=[("files", ("a.off", EGG)), ("files", ("g", GEM))])
        assert answer.status_code == 202, answer.text
        return {shape["id"] for shape in answer.json()["shapes"]}

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(send, range(8)))
    assert all(ids == found[0] for ids in found)
    assert park.work() == 2


def test_a_client_may_hold_on_until_the_shapes_are_ready(park: Api) -> None:
    with park.worker():
        made = park.upload("zoo", {"egg.off": EGG}, 201, params={"wait": 30})
    assert made["job"]["state"] == "succeeded"
    assert made["shapes"][0]["state"] == "ready"
    assert park.upload("zoo", {"egg.off": EGG}, 200)["shapes"] == made["shapes"]
    for wait in ("-1", "61", "nan", "x"):
        park.upload("zoo", {"egg.off": EGG}, 422, params={"wait": wait})


def test_one_bad_file_fails_and_the_rest_goes_on(park: Api) -> None:
    bad = {"empty.off": b"", "text.obj": b"hello", "cut.off": EGG[:300]}
    job = park.upload("zoo", {"egg.off": EGG, **bad})["job"]
    park.work()
    ended = park.get(f"/v1/jobs/{job['id']}")
    assert (ended["state"], ended["progress"]["done"]) == ("succeeded", 4)
    reasons = {error["item"]: error for error in ended["errors"]}
    assert reasons.keys() == bad.keys()
    for shape in park.get(PATH)["items"]:
        error = reasons.get(shape["name"])
        assert shape["state"] == ("failed" if error else "ready")
        if error:
            assert shape["error"] == {"type": error["type"], "detail": error["detail"]}
    again = park.upload("zoo", {"empty.off": b""}, 200)["job"]
    assert (again["state"], again["errors"]) == ("failed", [reasons["empty.off"]])


def test_what_was_cancelled_is_computed_when_it_is_uploaded_again(park: Api) -> None:
    first = park.upload("zoo", {"egg.off": EGG})
    park.post(f"/v1/jobs/{first['job']['id']}/cancel")
    assert park.get(PATH)["items"][0]["error"]["type"] == "cancelled"
    again = park.upload("zoo", {"egg.off": EGG})
    assert again["job"]["id"] != first["job"]["id"]
    assert again["shapes"][0]["id"] == first["shapes"][0]["id"]
    park.work()
    assert park.get(PATH)["items"][0]["state"] == "ready"


def test_the_shapes_of_a_zip_appear_as_its_job_goes_on(park: Api) -> None:
    archive = zipped(
        {"cat/1.off": EGG, "cat/2.off": GEM, "readme.txt": b"x", "../out.off": DIE, "bad.off": b"x"}
    )
    accepted = park.upload("zoo", {"all.bin": archive, "egg.off": EGG})
    assert [shape["name"] for shape in accepted["shapes"]] == ["egg.off"]
    park.work()
    job = park.get(f"/v1/jobs/{accepted['job']['id']}")
    assert job["state"] == "succeeded"
    assert {error["item"] for error in job["errors"]} == {"../out.off", "bad.off"}
    shapes = {shape["name"]: shape for shape in park.get(PATH)["items"]}
    assert shapes.keys() == {"egg.off", "2.off", "bad.off"}
    assert (shapes["2.off"]["label"], shapes["2.off"]["state"]) == ("cat", "ready")


def test_a_label_of_the_form_wins_over_folders_of_a_zip(park: Api) -> None:
    archive = zipped({"cat/1.off": EGG})
    with park.worker():
        made = park.upload(
            "zoo", {"a.zip": archive}, 201, data={"label": "owl"}, params={"wait": 30}
        )
    assert [shape["label"] for shape in made["shapes"]] == ["owl"]
    assert park.get(PATH)["items"] == made["shapes"]


@pytest.mark.parametrize("content", [b"PK\x03\x04garbage", b"PK\x05\x06", zipped({})])
def test_a_broken_zip_is_named_with_its_reason_and_the_rest_goes_on(
    park: Api, content: bytes
) -> None:
    job = park.upload("zoo", {"a.zip": content, "egg.off": EGG})["job"]
    park.work()
    ended = park.get(f"/v1/jobs/{job['id']}")
    assert (ended["state"], ended["progress"]["total"]) == ("succeeded", 2)
    (error,) = ended["errors"]
    assert error["item"] == "a.zip"
    assert error["detail"]
    assert park.get(PATH)["items"][0]["state"] == "ready"
    alone = park.upload("zoo", {"b.zip": content + b"b"})["job"]
    park.work()
    assert park.get(f"/v1/jobs/{alone['id']}")["state"] == "failed"


def test_a_3mf_is_a_mesh_although_it_is_a_zip(park: Api) -> None:
    namespace = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    mesh = tetrahedron()
    points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    model = (
        f'<model xmlns="{namespace}" unit="millimeter"><resources><object id="1"><mesh>'
        f"<vertices>{points}</vertices><triangles>{faces}</triangles></mesh></object></resources>"
        '<build><item objectid="1"/></build></model>'
    )
    content = zipped({"[Content_Types].xml": b"<Types/>", "3D/3dmodel.model": model.encode()})
    shape = park.upload("zoo", {"thing.zip": content})["shapes"][0]
    park.work()
    found = park.get(f"/v1/shapes/{shape['id']}")
    assert (found["state"], found["format"]) == ("ready", "3mf")


def test_archives_are_told_by_their_directory(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("zips") / "file"
    cases = {
        b"": False,
        EGG: False,
        b"PK\x03\x04": True,
        zipped({"a.off": EGG}): True,
        zipped({"3D/Thing.MODEL": b"x"}): False,
        zipped({f"{n}.off": b"" for n in range(70_000)}) + b"comment": True,
        zipped({"a.model": b""})[:-10]: True,
    }
    for content, expected in cases.items():
        path.write_bytes(content)
        with path.open("rb") as file:
            assert (archive_kind(file, "file") is not None) is expected


@pytest.mark.parametrize(
    "metadata",
    [
        "[1]",
        "{",
        '{"a": NaN}',
        '{"a": 1e999}',
        '{"a": "\\u0000"}',
        '{"\\u0000": 1}',
        '{"a": "\\ud800"}',
        json.dumps({"a": "x" * 17_000}),
        '{"a":' * 40 + "1" + "}" * 40,
        "[" * 60_000,
        '{"a": ' + "9" * 5000 + "}",
    ],
)
def test_metadata_that_cannot_be_kept_is_refused(park: Api, metadata: str) -> None:
    problem = park.upload("zoo", {"egg.off": EGG}, 422, data={"metadata": metadata})
    assert "metadata" in problem["detail"]
    assert nothing_is_left(park)


def test_a_form_with_strange_parts_is_refused_and_leaves_nothing(park: Api) -> None:
    egg = ("egg.off", EGG)
    for files, data in (
        ([("file", egg)], {}),
        ([("files", egg), ("mesh", egg)], {}),
        ([("files", egg)], {"lable": "cat"}),
        ([("files", egg)], {"label": "x" * 256}),
        ([("files", egg)], {"label": "a\x00b"}),
        ([("files", egg)], {"files": "text"}),
    ):
        park.post(PATH, 422, files=files, data=data)
        assert nothing_is_left(park)
    park.post(PATH, 413, files=[("files", egg)], data={"label": "x" * 70_000})
    park.post("/v1/collections/none/shapes", 404, files=[("files", egg)])
    assert nothing_is_left(park)


def form(*parts: bytes, end: bytes = b"--b--\r\n") -> Json:
    body = b"".join(b"--b\r\n" + part + b"\r\n" for part in parts) + end
    return {"content": body, "headers": {"Content-Type": "multipart/form-data; boundary=b"}}


def file_part(name: bytes, content: bytes) -> bytes:
    return b'Content-Disposition: form-data; name="files"; ' + name + b"\r\n\r\n" + content


def test_multipart_bodies_that_are_damaged_are_refused(park: Api) -> None:
    whole = file_part(b'filename="a.off"', GEM)
    park.post(PATH, 422, **form(whole, end=b""))
    park.post(PATH, 422, **form(whole, end=b"--b"))
    park.post(PATH, 422, **form(b"no header"))
    park.post(PATH, 422, **form(b"Content-Disposition: form-data\r\n\r\nx"))
    park.post(PATH, 422, **form(b"A: " + b"x" * 100_000 + b"\r\n\r\nx"))
    park.post(PATH, 422, **form())
    park.post(PATH, 422, content=b"--c\r\n", headers=form()["headers"])
    lacking = {"Content-Type": "multipart/form-data"}
    assert "boundary" in park.post(PATH, 422, content=b"", headers=lacking)["detail"]
    for kind in ("text/plain", "application/json", ""):
        park.post(PATH, 415, content=GEM, headers={"Content-Type": kind})
    assert nothing_is_left(park)


def test_a_file_without_a_name_is_kept_and_an_empty_field_is_passed_over(park: Api) -> None:
    nameless, blank = file_part(b'filename=""', GEM), file_part(b'filename=""', b"")
    shapes = park.post(PATH, 202, **form(nameless, blank))["shapes"]
    assert [shape["name"] for shape in shapes] == ["unnamed"]


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (b'filename="../../etc/passwd"', "passwd"),
        (b'filename="C:\\\\temp\\\\a.off"', "a.off"),
        (b'filename="a%22b.off"', 'a"b.off'),
        (b'filename="\xc3\xa4.off"', "ä.off"),
        (b'filename="\xe4.off"', "ä.off"),
        (b'filename="a\x00\x01b.off"', "ab.off"),
        (b'filename="' + b"x" * 1000 + b'.off"', "x" * 251 + ".off"),
    ],
)
def test_a_file_name_is_a_name_and_never_a_path(park: Api, given: bytes, kept: str) -> None:
    shapes = park.post(PATH, 202, **form(file_part(given, GEM)))["shapes"]
    assert shapes[0]["name"] == kept
    stored = [path for path in park.settings.data_path.rglob("*") if path.is_file()]
    assert not [path for path in stored if "passwd" in path.name or path.name.endswith(".off")]


def test_limits_on_bytes_and_files_leave_nothing_behind(start: Start) -> None:
    api = start(max_upload_bytes=2000, max_request_bytes=6000, max_files=3)
    api.post("/v1/collections", 201, json={"name": "zoo"})
    small = b"x" * 900
    too_large = api.upload("zoo", {"a": small, "big.off": b"x" * 2001}, 413)
    assert "'big.off' has more than 2000 bytes" in too_large["detail"]
    too_many = api.upload("zoo", {str(n): b"%d" % n for n in range(4)}, 413)
    assert too_many["type"] == "/problems/upload-too-large"
    api.upload("zoo", {str(n): b"x" * 1999 + b"%d" % n for n in range(3)}, 413)
    assert nothing_is_left(api)
    assert len(api.upload("zoo", {str(n): small + b"%d" % n for n in range(3)})["shapes"]) == 3


def test_a_chunked_body_is_counted_while_it_comes(start: Start) -> None:
    api = start(max_upload_bytes=100_000, max_request_bytes=100_000)
    api.post("/v1/collections", 201, json={"name": "zoo"})
    sent = 0

    def endless() -> Iterator[bytes]:
        nonlocal sent
        yield b"--b\r\n" + file_part(b'filename="a.off"', b"")
        for _ in range(50):
            sent += 20_000
            yield b"x" * 20_000

    api.post(PATH, 413, content=endless(), headers=form()["headers"])
    assert nothing_is_left(api)


def test_a_json_body_has_a_limit_of_its_own(api: Api) -> None:
    api.post("/v1/collections", 413, json={"name": "zoo", "description": "x" * (5 << 20)})


def test_a_job_of_an_upload_names_as_many_parts_as_are_new(park: Api) -> None:
    park.upload("zoo", {f"{n}.off": EGG + b"\n" * n for n in range(60)})
    with park.services.database.read() as session:
        assert session.scalar(select(func.count()).select_from(Part)) == 60
