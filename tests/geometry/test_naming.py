"""What a file's name says, and what it never does."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.geometry.formats.naming import MAX_NAME, MAX_PATH, Naming, read_name


@pytest.mark.parametrize(
    ("filename", "expected"),
    [
        ("cat.holes.3.off", Naming("cat.holes.3.off", "cat", "holes", 3)),
        ("cat.null.0.off", Naming("cat.null.0.off", "cat", "null", 0)),
        ("big/cat.holes.3.off", Naming("cat.holes.3.off", "cat", "holes", 3)),
        ("cat/17.ply", Naming("17.ply", "cat")),
        ("zoo/cat/17.ply", Naming("17.ply", "cat")),
        ("zoo\\cat\\17.ply", Naming("17.ply", "cat")),
        ("17.ply", Naming("17.ply")),
        ("version.1.2.stl", Naming("version.1.2.stl")),
        ("../../etc/passwd", Naming("passwd", "etc")),
        ("../x.off", Naming("x.off")),
        ("", Naming("unnamed")),
        ("cat.holes.3.off.gz", Naming("cat.holes.3.off.gz", "cat", "holes", 3)),
        ("C:\\cats\\1.off", Naming("1.off", "cats")),
        ("a\u0308/1.off", Naming("1.off", "\u00e4")),
    ],
)
def test_names_are_read_as_the_convention_says(filename: str, expected: Naming) -> None:
    assert replace(read_name(filename), path="") == expected


@pytest.mark.parametrize(
    ("filename", "path"),
    [
        ("zoo/cats/1.off", "zoo/cats/1.off"),
        ("./zoo\\cats//1.off", "zoo/cats/1.off"),
        ("/zoo/../cats/1.off", "zoo/cats/1.off"),
        ("C:/cats/1.off", "cats/1.off"),
        ("a:b/1.off", "a:b/1.off"),
        ("caf\u0065\u0301/1.off", "caf\u00e9/1.off"),
        ("a\nb\x00.off", "ab.off"),
        ("..", "unnamed"),
    ],
)
def test_a_path_is_relative_and_written_in_one_way(filename: str, path: str) -> None:
    assert read_name(filename).path == path


def test_a_folder_may_be_no_label() -> None:
    assert read_name("cat/17.ply", folder_is_label=False) == Naming("17.ply", path="cat/17.ply")
    assert read_name("x/cat.holes.3.off", folder_is_label=False).label == "cat"


def test_of_a_path_that_is_too_long_the_last_folders_stay() -> None:
    path = read_name("/".join(f"{n:09}" for n in range(500)) + "/a.off").path
    assert len(path) <= MAX_PATH
    assert path.endswith("000000498/000000499/a.off")
    assert path[:9].isdecimal()


@given(st.text(max_size=600))
def test_no_name_is_a_path_or_too_long_or_unprintable(filename: str) -> None:
    naming = read_name(filename)
    assert 0 < len(naming.name) <= MAX_NAME
    assert "/" not in naming.name
    assert naming.name.isprintable()
    assert len(naming.path) <= MAX_PATH
    assert naming.path.rpartition("/")[2] == naming.name
    assert not {"", ".", ".."} & set(naming.path.split("/"))
    assert naming.label is None or naming.label not in {"", ".", ".."}
