"""Files that fuzzing found, or that were thought of meanwhile: each took too long, or worse."""

import contextlib
import io
import time
import zipfile

import pytest

from workers.errors import ProteusError
from workers.geometry.formats import parse
from workers.geometry.formats.text.encodings import readable

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
SLOW = {
    "byte order marks alone": BYTE_ORDER_MARK * (1 << 20),  # grew with the square
    "a line of number signs": b"# " * 30 + b"\n",  # doubled with each of them
}
REPEATED = (
    *(b"#", b"# ", b"##\n", b" ", b"\n", b"\r", b"<!--", b"<?", b"<a>", b"<a ", b"P 1", b"1"),
    *(b"1 ", b"1.", b"-", b"e", b"a ", b"OFF", b"N", b"solid ", b"facet ", b"end ", b'"', b"{"),
    *(b"[", b"//", b";", b"(", b"G1 X1 ", b"v 1 1 1\n", b"f 1 1 1\n", b"\\\n", b"\\ ", b"/", b"&"),
    *(b"comment ", b"property ", b"<!DOCTYPE ", b",", b"=", b"\0", b"\xff", b"$", b"nan ", b"1#"),
    *(b"Vertices\n", b"$Comments\n", b"element vertex 1\n", b"vertex 1 1 1 "),
)


@pytest.mark.parametrize("data", SLOW.values(), ids=SLOW.keys())
def test_what_took_too_long_is_fast(data: bytes) -> None:
    start = time.process_time()
    with pytest.raises(ProteusError):
        parse(data)
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize("head", [b"", b"ply\n", b"OFF\n", b"solid a\n", b"<?xml ?>", b"#"])
@pytest.mark.parametrize("piece", REPEATED)
def test_one_piece_repeated_is_read_or_refused_fast(head: bytes, piece: bytes) -> None:
    data = head + piece * ((1 << 15) // len(piece))
    start = time.process_time()
    with contextlib.suppress(ProteusError):
        parse(data)
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize("count", [1, 2, 7])
@pytest.mark.parametrize("text", [b"OFF\n", b"", b"\xef", b"\xef\xbb", b"\xbb\xef\xbf\xef"])
def test_byte_order_marks_are_left_out(count: int, text: bytes) -> None:
    rest = readable(BYTE_ORDER_MARK * count + text).data
    assert rest == text or (count > 1 and rest == BYTE_ORDER_MARK * (count - 1) + text)


def test_an_archive_whose_relationships_do_not_unpack_is_refused() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("_rels/.rels", "<Relationships/>" * 9)
    data = bytearray(file.getvalue())
    data[30 + len("_rels/.rels")] = 0x07  # a block of a type that does not exist
    with pytest.raises(ProteusError):
        parse(bytes(data))
