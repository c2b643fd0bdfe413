"""What is refused is told from meshes by a look at its beginning and its end."""

import time

import pytest

from tests.formats.every_kind import every_kind
from tests.formats.kinds import BODY
from tests.formats.refused_files import FILES, PLACEHOLDERS
from workers.geometry.formats import WRITTEN_FORMATS, parse, write
from workers.geometry.formats.refusals.refusal import refusal


@pytest.mark.parametrize("file", [*FILES, *PLACEHOLDERS], ids=lambda file: file[0])
def test_the_refusal_names_the_file(file: tuple[str, str, str, str, bytes]) -> None:
    _, _, name, reason, data = file
    assert reason in (refusal(data, name) or "")


@pytest.mark.parametrize("ending", [*WRITTEN_FORMATS, "max", "xyz", "step", "png", "fbx", ""])
@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_a_mesh_is_no_refusal_whatever_its_name(format: str, ending: str) -> None:
    data = write(BODY, format)
    assert refusal(data, f"thing.{ending}") is None
    assert parse(data, filename=f"thing.{ending}").format == format


@pytest.mark.parametrize(
    "kind", [kind for kind in every_kind() if kind.facts], ids=lambda kind: kind.name
)
def test_no_kind_that_is_read_is_a_refusal(kind) -> None:  # type: ignore[no-untyped-def]
    assert refusal(kind.build(), kind.filename) is None


@pytest.mark.parametrize(
    "head", [b"PK\3\4", b"MZ", b"# .PCD v.7", b"II*\0", b"BM", b"\xff\xd8\xff", b'{"a": 1}']
)
def test_a_whole_binary_stl_is_a_mesh_whatever_its_header_says(head: bytes) -> None:
    stl = write(BODY, "stl")
    data = head.ljust(80, b"\0") + stl[80:]
    if not head.startswith(b"PK"):
        assert refusal(data, "thing.stl") is None
        assert parse(data).format == "stl"


@pytest.mark.parametrize(
    "unit",
    [
        b"N1  ",
        b"<!--",
        b"<?x?>",
        b"#\n \n",
        b"999\n\n",
        b"; \n",
        b" ",
        b"[",
        b"annex/",
        b"<!DOCTYPE ",
    ],
)
def test_the_look_is_short_however_long_the_file(unit: bytes) -> None:
    data = unit * (4_000_000 // len(unit))
    start = time.perf_counter()
    refusal(data, "thing.xyz")
    assert time.perf_counter() - start < 2.0
