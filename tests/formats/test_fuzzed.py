"""Files that fuzzing found, or that were thought of meanwhile: each took too long, or worse."""

import io
import time
import zipfile

import pytest

from workers.errors import ProteusError
from workers.geometry.formats import parse
from workers.geometry.formats.encodings import readable

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@pytest.mark.parametrize("data", [BYTE_ORDER_MARK * (1 << 20)], ids=["byte order marks alone"])
def test_what_took_too_long_is_fast(data: bytes) -> None:
    start = time.process_time()
    with pytest.raises(ProteusError):
        parse(data)
    assert time.process_time() - start < 2.0  # it was minutes, and grew with the square


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
