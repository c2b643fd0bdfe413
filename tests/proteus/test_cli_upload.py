import json
from pathlib import Path

import httpx
import pytest
from typer.testing import Result

from proteus.cli.query import parse_filters
from proteus.files import CountingFile, UploadFile, find_files, make_batches
from proteus.terminal.output import CommandError
from tests.proteus.fake_service import FakeService, Run


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Meshes in folders, as people have them."""
    names = [
        "poses/cat/cat-01.ply", "poses/cat/cat-02.OFF", "poses/dog/old/dog-01.obj",
        "poses/.hidden/x.ply", "poses/cat/readme.txt", "poses/cat/.x.ply",
        "objects/boat.stl", "objects/all.zip", "objects/holes/cat.holes.3.off",
        "objects/more/some.zip",
    ]  # fmt: skip
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(f"content of {name}".encode())
    return tmp_path


def _labels(files: list[UploadFile]) -> dict[str, str]:
    return {file.path.name: file.label for file in files}


def test_labels_are_the_parent_folders(tree: Path) -> None:
    assert _labels(find_files([tree / "poses", tree / "objects"])) == {
        "cat-01.ply": "cat",
        "cat-02.OFF": "cat",
        "dog-01.obj": "old",
        "boat.stl": "",  # directly in a given folder
        "all.zip": "",
        "some.zip": "",  # its own folders are labels
        "cat.holes.3.off": "",  # its name says it
    }


def test_given_label_wins_and_folders_can_be_ignored(tree: Path) -> None:
    assert set(_labels(find_files([tree], label="thing")).values()) == {"thing"}
    assert set(_labels(find_files([tree], labels_from_folders=False)).values()) == {""}


def test_named_file_is_taken_whatever_its_ending_and_once(tree: Path) -> None:
    readme = tree / "poses/cat/readme.txt"
    cat = tree / "poses/cat/cat-01.ply"
    found = find_files([readme, cat, cat, tree / "poses/cat"])
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


def test_upload_makes_the_collection_and_waits(run: Run, fake: FakeService, tree: Path) -> None:
    result = run("upload", str(tree / "poses"), "-c", "animals", "--json")
    assert result.exit_code == 0, result.output
    assert fake.uploads == [("cat", ["cat-01.ply", "cat-02.OFF"]), ("old", ["dog-01.obj"])]
    document = json.loads(result.stdout)
    assert (document["collection"], document["files"], document["shapes"]) == ("animals", 3, 3)
    assert all(job["state"] == "succeeded" for job in fake.jobs.values())


def test_upload_names_what_failed(run: Run, fake: FakeService, tree: Path) -> None:
    (tree / "poses/cat/cat-03.ply").write_bytes(b"bad mesh")
    result = run("upload", str(tree / "poses"))
    assert result.exit_code == 1
    assert "cat-03.ply" in result.stdout
    assert "it has no faces" in result.stdout
    assert "3 ready" in result.stdout


def test_refused_file_does_not_keep_back_the_others(
    run: Run, fake: FakeService, tree: Path
) -> None:  # fmt: skip
    (tree / "poses/cat/cat-00.ply").write_bytes(b"huge mesh")
    result = run("upload", str(tree / "poses"), "--json")
    assert result.exit_code == 1
    sent = sorted(name for _, names in fake.uploads for name in names)
    assert sent == ["cat-01.ply", "cat-02.OFF", "dog-01.obj"]
    errors = json.loads(result.stdout)["errors"]
    assert [error["item"] for error in errors] == ["cat-00.ply"]
    assert "more than the limit" in errors[0]["detail"]


def test_upload_is_repeated_after_a_broken_connection(
    run: Run, fake: FakeService, tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    handle = fake.handle
    broken: list[httpx.Request] = []

    def unreliable(request: httpx.Request) -> httpx.Response:
        answer = handle(request)
        if request.method == "POST" and request.url.path.endswith("/shapes") and not broken:
            broken.append(request)
            raise httpx.ReadError("reset by peer")
        return answer

    monkeypatch.setattr(fake, "transport", lambda: httpx.MockTransport(unreliable))
    monkeypatch.setattr("proteus.cli.connection.Client", _patched(fake))
    result = run("upload", str(tree / "objects/boat.stl"), "--json")
    assert result.exit_code == 0, result.output
    bodies = [r.content.partition(b"\r\n\r\n")[2].partition(b"\r\n--")[0] for r in broken]
    assert bodies == [b"content of objects/boat.stl"]
    assert fake.uploads == [("", ["boat.stl"]), ("", ["boat.stl"])]


def _patched(fake: FakeService) -> object:
    from functools import partial

    from proteus.client import Client

    return partial(Client, transport=fake.transport())


def test_folder_without_meshes_is_said_clearly(run: Run, tmp_path: Path) -> None:
    result = run("upload", str(tmp_path))
    assert result.exit_code == 1
    assert "no mesh" in result.stderr


# -- query ---------------------------------------------------------------------------------


def test_query_by_shape_sends_its_options(run: Run, fake: FakeService) -> None:
    fake.add_shape("default", "cat-01.ply", "cat", b"1")
    result = run(
        "query", "--shape", "shape-0", "-n", "3", "--model", "commute-time",
        "--dissimilarity", "l2", "--filter", "label=cat", "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert fake.queries == [
        {
            "shape_id": "shape-0", "limit": 3, "model": "commute-time", "dissimilarity": "l2",
            "filter": {"must": [{"field": "label", "equals": "cat"}]}, "include_self": False,
        }
    ]  # fmt: skip
    assert json.loads(result.stdout)["matches"][0]["shape"]["name"] == "cat-01.ply"


@pytest.mark.parametrize("slow", [False, True])
def test_query_by_mesh_prints_the_ranked_answer(
    run: Run, fake: FakeService, tree: Path, slow: bool
) -> None:  # fmt: skip
    fake.query_is_slow = slow
    fake.add_shape("default", "cat-01.ply", "cat", b"1")
    fake.add_shape("default", "dog-01.ply", "dog", b"2")
    result: Result = run("query", str(tree / "objects/boat.stl"), "-f", "label!=cow")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert [line.split()[:3] for line in lines[-2:]] == [
        ["1", "cat-01.ply", "cat"],
        ["2", "dog-01.ply", "dog"],
    ]
    assert fake.queries[0]["mesh"] == b"content of objects/boat.stl"
    assert json.loads(fake.queries[0]["filter"]) == {
        "must_not": [{"field": "label", "equals": "cow"}]
    }


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
