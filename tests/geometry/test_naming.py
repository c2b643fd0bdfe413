"""What a file's name says, and what it never does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.geometry.formats.naming import MAX_NAME, Naming, read_name


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
    ],
)
def test_names_are_read_as_the_convention_says(filename: str, expected: Naming) -> None:
    assert read_name(filename) == expected


@given(st.text(max_size=600))
def test_no_name_is_a_path_or_too_long_or_unprintable(filename: str) -> None:
    naming = read_name(filename)
    assert 0 < len(naming.name) <= MAX_NAME
    assert "/" not in naming.name
    assert naming.name.isprintable()
    assert naming.label is None or naming.label not in {"", ".", ".."}
