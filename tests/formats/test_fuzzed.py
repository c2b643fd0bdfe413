"""Files that fuzzing found, or that were thought of meanwhile: each took too long, or worse."""

import time

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
