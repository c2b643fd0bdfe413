from pathlib import Path

import pytest

from proteus.benchmark.folders import (
    clean_label,
    find_distractors,
    find_nulls,
    find_poses,
    unique_label,
)
from tests.meshes import icosphere, scaled
from workers.errors import InvalidRequestError
from workers.geometry.formats import write


def put(path: Path, size: float = 1.0, ending: str = "ply") -> Path:
    """Write a small sphere; another size is another content."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(write(scaled(icosphere(1), size), ending))
    return path


def test_nulls_are_labelled_by_their_stem_or_their_folder(tmp_path: Path) -> None:
    put(tmp_path / "cat.ply")
    put(tmp_path / "dog.null.0.off", ending="off")
    put(tmp_path / "lion" / "whatever.obj", ending="obj")
    put(tmp_path / "horse" / "horse-01.ply", 2.0)
    put(tmp_path / "horse" / "horse-reference.ply")
    put(tmp_path / "deep" / "cow" / "Null.ply")
    (tmp_path / "readme.txt").write_text("no mesh")
    nulls = find_nulls(tmp_path)
    assert {label: null.name for label, null in nulls.items()} == {
        "cat": "cat.ply",
        "dog": "dog.null.0.off",
        "cow": "deep/cow/Null.ply",
        "horse": "horse/horse-reference.ply",
        "lion": "lion/whatever.obj",
    }


def test_a_folder_that_does_not_say_which_mesh_is_the_null_is_named(tmp_path: Path) -> None:
    put(tmp_path / "horse" / "1.ply")
    put(tmp_path / "horse" / "2.ply")
    with pytest.raises(InvalidRequestError, match=r"horse holds 2 meshes, 0 of which"):
        find_nulls(tmp_path)
    put(tmp_path / "horse" / "null-1.ply")
    assert find_nulls(tmp_path)["horse"].name == "horse/null-1.ply"
    put(tmp_path / "horse" / "null-2.ply")
    with pytest.raises(InvalidRequestError, match=r"holds 4 meshes, 2 of which"):
        find_nulls(tmp_path)


def test_two_nulls_of_one_label_and_an_empty_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequestError, match="there is no mesh below"):
        find_nulls(tmp_path)
    put(tmp_path / "cat.ply")
    put(tmp_path / "cat" / "a.ply")
    with pytest.raises(InvalidRequestError, match=r"'cat': cat.ply and cat/a.ply"):
        find_nulls(tmp_path)


def test_labels_hold_nothing_that_a_name_could_be_misread_by() -> None:
    assert clean_label("cat v1.2 (final)") == "cat-v1-2-final"
    assert clean_label("Lässig_01") == "Lässig_01"
    assert clean_label("...") == "unnamed"
    assert unique_label("cat", []) == "cat"
    assert unique_label("cat", ["cat", "cat-2"]) == "cat-3"


def test_poses_are_those_of_the_label_without_the_null_itself(tmp_path: Path) -> None:
    null = put(tmp_path / "nulls" / "cat" / "cat-reference.ply")
    put(tmp_path / "poses" / "cat" / "copy.ply")
    put(tmp_path / "poses" / "cat" / "02.ply", 2.0)
    put(tmp_path / "poses" / "cat" / "01.ply", 3.0)
    put(tmp_path / "poses" / "dog" / "01.ply", 4.0)
    found = find_nulls(tmp_path / "nulls")["cat"]
    assert found.path == null
    poses = find_poses(tmp_path / "poses", "cat", found)
    assert [pose.name for pose in poses] == ["cat/01.ply", "cat/02.ply"]
    assert find_poses(tmp_path / "poses", "lion", found) == ()


def test_distractors_keep_their_stems_and_archives_are_not_opened(tmp_path: Path) -> None:
    put(tmp_path / "a" / "boat.ply")
    put(tmp_path / "b" / "boat.ply")
    (tmp_path / "more.zip").write_bytes(b"PK")
    assert [label for label, _ in find_distractors(tmp_path)] == ["boat", "boat"]
    with pytest.raises(InvalidRequestError, match="there is no mesh below"):
        find_distractors(tmp_path / "a" / "none")
