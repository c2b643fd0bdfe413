import io
import json
import zipfile
from pathlib import Path

import pytest

from proteus.cli.query import parse_filters
from proteus.cli.regions import read_vertices
from proteus.files import CountingFile, UploadFile, find_files, make_batches
from proteus.terminal.output import CommandError
from tests.meshes import bumpy_sphere, gltf_with_buffer, scaled
from tests.proteus.conftest import MOST_BYTES, Run
from tests.proteus.real_service import Fault, RealService
from tests.service.running import off, zoo_files
from workers.geometry.formats import write

FORMATS = ("off", "obj", "ply", "stl")


def zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def content_of(name: str) -> bytes:
    """A mesh of the format that the name has, unlike any other's; a text where it has none."""
    form = name.rpartition(".")[2].lower()
    if form == "zip":
        return zipped({"cats/1.off": off(bumpy_sphere(1, seed=3))})
    if form not in FORMATS:
        return f"content of {name}".encode()
    return write(bumpy_sphere(2, seed=len(name)), form)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Meshes in folders, as people have them."""
    names = [
        "poses/cat/cat-01.ply", "poses/cat/cat-02.OFF", "poses/dog/old/dog-01.obj",
        "poses/.hidden/x.ply", "poses/cat/readme.txt", "poses/cat/.x.ply",
        "objects/boat.stl", "objects/holes/cat.holes.3.off", "objects/zips/all.zip",
    ]  # fmt: skip
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content_of(name))
    return tmp_path


def _labels(files: list[UploadFile]) -> dict[str, str]:
    return {file.path.name: file.label for file in files}


def test_names_have_the_folders_from_the_given_one_on(tree: Path) -> None:
    found = find_files([tree / "poses", tree / "objects"])
    assert [file.sent_name for file in found.files] == [
        "poses/cat/cat-01.ply",
        "poses/cat/cat-02.OFF",
        "poses/dog/old/dog-01.obj",
        "objects/boat.stl",
        "objects/holes/cat.holes.3.off",
        "objects/zips/all.zip",
    ]
    assert found.skipped == [("poses/cat/readme.txt", "text")]


def test_only_a_given_label_is_sent(tree: Path) -> None:
    assert set(_labels(find_files([tree], label="thing").files).values()) == {"thing"}
    assert set(_labels(find_files([tree]).files).values()) == {""}


def test_named_file_is_taken_whatever_its_ending_and_once(tree: Path) -> None:
    readme = tree / "poses/cat/readme.txt"
    cat = tree / "poses/cat/cat-01.ply"
    found = find_files([readme, cat, cat, tree / "poses/cat"]).files
    assert [file.path.name for file in found] == ["readme.txt", "cat-01.ply", "cat-02.OFF"]
    assert {file.label for file in found} == {""}


def test_batches_have_one_label_and_bounded_size() -> None:
    small = [UploadFile(Path(f"{i}.ply"), "ab"[i % 2], 10) for i in range(130)]
    large = [UploadFile(Path(f"l{i}.ply"), "c", 40 << 20) for i in range(3)]
    giant = [UploadFile(Path("g.ply"), "c", 900 << 20)]
    batches = make_batches([*small, *large, *giant])
    assert sorted(f.path.name for b in batches for f in b) == sorted(
        f.path.name for f in [*small, *large, *giant]
    )
    assert all(len({file.label for file in batch}) == 1 for batch in batches)
    assert all(len(batch) <= 50 for batch in batches)
    assert all(len(b) == 1 or sum(f.size for f in b) <= 64 << 20 for b in batches)
    assert len(batches) == 4 + 4


def test_counting_file_tells_every_byte_once(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"x" * 1000)
    told: list[int] = []
    with CountingFile(path, told.append) as file:
        file.read(300)
        file.seek(0)  # a request that is repeated
        while file.read(256):
            pass
    assert sum(told) == 1000
    assert all(count > 0 for count in told)


def test_upload_makes_the_collection_and_waits(run: Run, service: RealService, tree: Path) -> None:
    result = run("upload", tree / "poses", "-c", "uploaded", "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert (document["collection"], document["files"], document["shapes"]) == ("uploaded", 3, 3)
    shapes = json.loads(run("shapes", "list", "-c", "uploaded", "--json").stdout)
    labels = {shape["name"]: shape["label"] for shape in shapes}
    assert labels == {"cat-01.ply": "cat", "cat-02.OFF": "cat", "dog-01.obj": "old"}
    assert {shape["state"] for shape in shapes} == {"ready"}
    again = json.loads(run("upload", tree / "poses", "-c", "uploaded", "--json").stdout)
    assert again["errors"] == []
    assert len(json.loads(run("shapes", "list", "-c", "uploaded", "--json").stdout)) == 3


def test_upload_names_what_failed(run: Run, tree: Path) -> None:
    (tree / "poses/cat/cat-03.off").write_bytes(b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n")
    result = run("upload", tree / "poses", "-c", "failing")
    assert result.exit_code == 1
    assert "cat-03.off" in result.stdout
    assert "faces" in result.stdout
    assert "3 ready" in result.stdout


def test_refused_file_does_not_keep_back_the_others(
    run: Run, service: RealService, tree: Path
) -> None:
    (tree / "poses/cat/cat-00.ply").write_bytes(b"x" * (MOST_BYTES + 1))
    result = run("upload", tree / "poses", "-c", "partly", "--json")
    assert result.exit_code == 1
    shapes = json.loads(run("shapes", "list", "-c", "partly", "--json").stdout)
    sent = sorted(shape["name"] for shape in shapes)
    assert sent == ["cat-01.ply", "cat-02.OFF", "dog-01.obj"]
    errors = json.loads(result.stdout)["errors"]
    assert [error["item"] for error in errors] == ["poses/cat/cat-00.ply"]
    assert str(MOST_BYTES) in errors[0]["detail"].replace(",", "")


def test_upload_is_repeated_after_a_broken_connection_and_counts_once(
    run: Run, service: RealService, tree: Path
) -> None:
    """The service had taken the file; only its answer was lost."""
    service.faults.append(Fault(method="POST", path="/shapes", after=True))
    result = run("upload", tree / "objects/boat.stl", "-c", "broken", "--json")
    assert result.exit_code == 0, result.output
    first, second = service.sent("POST", "/shapes")
    content = (tree / "objects/boat.stl").read_bytes()
    assert content in first.body
    assert content in second.body
    assert json.loads(run("collections", "show", "broken", "--json").stdout)["shape_count"] == 1


def test_a_folder_its_archive_and_its_files_give_the_same_paths_and_labels(
    run: Run, tree: Path
) -> None:
    files = {
        str(path.relative_to(tree)): path.read_bytes()
        for path in sorted((tree / "poses").rglob("*"))
        if path.is_file()
    }
    archive = tree / "poses.zip"
    archive.write_bytes(zipped(files))
    found = []
    for collection, path in (("folder", tree / "poses"), ("archive", archive)):
        result = run("upload", path, "-c", collection)
        assert result.exit_code == 0, result.output
        assert "skipped (" in result.stderr
        listed = run("shapes", "list", "-c", collection, "--path", "poses", "--json")
        shapes = json.loads(listed.stdout)
        found.append(sorted((shape["path"], shape["name"], shape["label"]) for shape in shapes))
    assert found[0] == found[1]
    assert [shape[0] for shape in found[0]] == [
        "poses/cat/cat-01.ply", "poses/cat/cat-02.OFF", "poses/dog/old/dog-01.obj",
    ]  # fmt: skip
    assert [shape[2] for shape in found[0]] == ["cat", "cat", "old"]
    some = run("shapes", "list", "-c", "archive", "--path", "poses/cat")
    assert "poses/cat/cat-01.ply" in some.stdout
    assert "dog-01" not in some.stdout
    plain = run("upload", tree / "poses", "-c", "plain", "--no-labels-from-folders", "-v")
    assert "readme.txt" in plain.stdout
    assert "1 file skipped (1 text)" in plain.stderr
    shapes = json.loads(run("shapes", "list", "-c", "plain", "--json").stdout)
    assert {shape["label"] for shape in shapes} == {None}


def test_a_gltf_file_goes_with_the_files_that_it_refers_to(
    run: Run, service: RealService, tmp_path: Path
) -> None:
    document, binary = gltf_with_buffer(bumpy_sphere(2, seed=17))
    folder = tmp_path / "model"
    (folder / "textures").mkdir(parents=True)
    (folder / "scene.gltf").write_bytes(document)
    (folder / "scene.bin").write_bytes(binary)
    (folder / "textures/skin.png").write_bytes(b"\x89PNG")
    result = run("upload", folder, "-c", "scenes", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["skipped"] == [
        {"item": "model/textures/skin.png", "detail": "picture"}
    ]
    (shape,) = json.loads(run("shapes", "list", "-c", "scenes", "--json").stdout)
    assert (shape["path"], shape["format"]) == ("model/scene.gltf", "glb")
    asked = run("query", folder / "scene.gltf", "-c", "scenes", "--path", "model", "--json")
    (match,) = json.loads(asked.stdout)["matches"]
    assert match["distance"] == 0


def test_folder_without_meshes_is_named(run: Run, tmp_path: Path) -> None:
    result = run("upload", tmp_path)
    assert result.exit_code == 1
    assert "no mesh" in result.stderr


# -- query ---------------------------------------------------------------------------------


def test_query_by_shape_sends_its_options(run: Run, service: RealService) -> None:
    ring = json.loads(run("shapes", "list", "-c", "zoo", "--label", "ring", "--json").stdout)[0]
    result = run(
        "query", "-c", "zoo", "--shape", ring["id"], "-n", "3", "--model", "heat",
        "--dissimilarity", "chi-squared", "--filter", "label=ball", "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert service.sent("POST", "/query")[-1].json == {
        "shape_id": ring["id"], "limit": 3, "model": "heat",
        "dissimilarity": "chi-squared", "include_self": False,
        "filter": {"must": [{"field": "label", "equals": "ball"}]},
    }  # fmt: skip
    found = json.loads(result.stdout)
    assert (found["model"], found["dissimilarity"]) == ("heat", "chi-squared")
    assert {match["shape"]["label"] for match in found["matches"]} == {"ball"}


def test_query_says_whether_it_is_a_part_or_a_whole(
    run: Run, service: RealService, tmp_path: Path
) -> None:
    mesh = tmp_path / "ring.ply"
    mesh.write_bytes(zoo_files()["ring.null.0.ply"])
    ring = json.loads(run("shapes", "list", "-c", "zoo", "--label", "ring", "--json").stdout)[0]
    for match in ("part", "whole"):
        assert run("query", "-c", "zoo", "--shape", ring["id"], f"--{match}").exit_code == 0
        assert service.sent("POST", "/query")[-1].json["match"] == match
        assert run("query", mesh, "-c", "zoo", f"--{match}").exit_code == 0
        assert f'name="match"\r\n\r\n{match}'.encode() in service.sent("POST", "/mesh")[-1].body
    assert run("query", mesh, "-c", "zoo", "--part", "--whole").exit_code == 2


@pytest.mark.parametrize("slow", [False, True])
def test_query_by_mesh_prints_the_ranked_answer(
    run: Run, service: RealService, tmp_path: Path, slow: bool
) -> None:
    """A slow answer is 202 with a job, which is followed."""
    mesh = tmp_path / "unknown.off"
    mesh.write_bytes(off(scaled(bumpy_sphere(2, seed=1), 2.0 + 0.5 * slow)))
    service.front.answers_at_once = slow
    try:
        result = run("query", mesh, "-c", "zoo", "-f", "label!=ring")
    finally:
        service.front.answers_at_once = False
    assert result.exit_code == 0, result.output
    rows = [line.split()[:3] for line in result.stdout.splitlines()[-4:]]
    assert sorted(row[1] for row in rows[:2]) == ["ball.null.0.off", "ball.scale.2.off"]
    assert [row[0] for row in rows] == ["1", "2", "3", "4"]
    assert "ring" not in {row[2] for row in rows}
    asked = any("/v1/queries/" in request.path for request in service.requests)
    assert asked == slow


@pytest.mark.parametrize("slow", [False, True])
def test_query_by_region_finds_the_shape_that_it_is_part_of(
    run: Run, service: RealService, tmp_path: Path, slow: bool
) -> None:
    """A region that is not described yet is 202 with a job, which is followed."""
    ring = json.loads(run("shapes", "list", "-c", "zoo", "--label", "ring", "--json").stdout)[0]
    command = ["query", "-c", "zoo", "--shape", ring["id"], "--json"]
    service.front.answers_at_once = slow
    try:
        radius = 1.0 + 0.5 * slow
        result = run(*command, "--region-center", "0", "--region-radius", radius)
    finally:
        service.front.answers_at_once = False
    assert result.exit_code == 0, result.output
    body = service.sent("POST", "/query")[-1].json
    assert body == {
        "shape_id": ring["id"], "limit": 10, "region": {"center": 0, "radius": radius},
    }  # fmt: skip
    found = json.loads(result.stdout)
    assert ring["id"] in {match["shape"]["id"] for match in found["matches"]}
    assert any("/v1/queries/" in request.path for request in service.requests) == slow
    without = run(*command, "--region-center", "0", "--region-radius", radius, "--no-include-self")
    others = json.loads(without.stdout)
    assert others["searched"] == found["searched"] - 1


@pytest.mark.parametrize(
    "text", ["[0, 1, 12, 13, 24, 25]", '{"vertices": [0, 1, 12, 13, 24, 25]}', "0 1\n12,13;24\n25 "]
)
def test_region_is_read_from_a_file(
    run: Run, service: RealService, tmp_path: Path, text: str
) -> None:
    ring = json.loads(run("shapes", "list", "-c", "zoo", "--label", "ring", "--json").stdout)[0]
    file = tmp_path / "region.txt"
    file.write_text(text)
    result = run("query", "-c", "zoo", "--shape", ring["id"], "--region", file, "--json")
    assert result.exit_code == 0, result.output
    asked = service.sent("POST", "/query")[-1].json["region"]
    assert asked == {"vertices": [0, 1, 12, 13, 24, 25]}
    assert json.loads(result.stdout)["query"]["region"] == {"n_vertices": 6, "n_faces": 4}


@pytest.mark.parametrize("text", ["", "[]", "[0.5]", "[true]", "0 x", '{"faces": [1]}', "1.5"])
def test_file_of_a_region_that_has_no_vertices_says_so(tmp_path: Path, text: str) -> None:
    file = tmp_path / "region.txt"
    file.write_text(text)
    with pytest.raises(CommandError, match="vertex indices"):
        read_vertices(file)
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CommandError, match="no text"):
        read_vertices(file)


def test_region_is_given_in_one_way_and_of_a_stored_shape(run: Run, tmp_path: Path) -> None:
    mesh, file = tmp_path / "gem.off", tmp_path / "region.txt"
    mesh.write_bytes(off(bumpy_sphere(2, seed=1)))
    file.write_text("7")
    assert read_vertices(file) == [7]
    disc = ["--region-center", "0", "--region-radius", "1"]
    for wrong in (
        ["--shape", "x", *disc[:2]],
        ["--shape", "x", *disc[2:]],
        ["--shape", "x", *disc, "--region", file],
        [mesh, *disc],
        [mesh, "--region", file],
    ):
        assert run("query", "-c", "zoo", *wrong).exit_code == 2


def test_query_that_cannot_be_read_says_why(run: Run, tmp_path: Path) -> None:
    mesh = tmp_path / "broken.off"
    mesh.write_bytes(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99\n")
    result = run("query", mesh, "-c", "zoo")
    assert result.exit_code == 1
    assert "99" in result.stderr


def test_filters_are_those_of_the_contract() -> None:
    assert parse_filters(["label=cat,dog", "metadata.age>=3", "metadata.wild!=true"]) == {
        "must": [
            {"field": "label", "in": ["cat", "dog"]},
            {"field": "metadata.age", "range": {"gte": 3}},
        ],
        "must_not": [{"field": "metadata.wild", "equals": True}],
    }
    assert parse_filters(["strength<3"]) == {"must": [{"field": "strength", "range": {"lt": 3}}]}
    assert parse_filters(["label=17"]) == {"must": [{"field": "label", "equals": "17"}]}


@pytest.mark.parametrize("text", ["cat", "colour=x", "metadata.=3", "=x", ""])
def test_filter_that_is_not_understood_is_refused(text: str) -> None:
    with pytest.raises(CommandError, match="not understood"):
        parse_filters([text])
