"""Compressed files: nothing is unpacked past its limit, however the limit is attacked."""

import bz2
import contextlib
import gzip
import io
import lzma
import tracemalloc
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.errors import InvalidMeshError, UploadTooLargeError
from workers.geometry.formats import MeshLimits, parse
from workers.geometry.formats.containers.compression import (
    compression_of,
    unpack,
    unpacked_head,
    unpacked_pieces,
)

PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
}


@pytest.mark.parametrize("compression", PACKERS)
@given(parts=st.lists(st.binary(max_size=300), min_size=1, max_size=4), rubbish=st.binary())
def test_what_was_packed_comes_out_whatever_follows(
    compression: str, parts: list[bytes], rubbish: bytes
) -> None:
    packed = b"".join(PACKERS[compression](part) for part in parts) + b"\x01" + rubbish
    assert compression_of(packed[:16]) == compression
    assert unpack(packed, compression, 2000) == b"".join(parts)
    assert unpacked_head(io.BytesIO(packed), compression, 5) == parts[0][:5]


@pytest.mark.parametrize("compression", PACKERS)
@given(
    data=st.binary(min_size=200, max_size=400), cut=st.integers(0, 200), flip=st.integers(0, 400)
)
def test_what_is_cut_or_damaged_is_refused(
    compression: str, data: bytes, cut: int, flip: int
) -> None:
    """A changed bit that is found by no check sum changes no byte of the content."""
    packed = bytearray(PACKERS[compression](data))
    with pytest.raises(InvalidMeshError, match=r"cut off|damaged"):
        unpack(bytes(packed[: len(packed) - 1 - cut % (len(packed) - 20)]), compression, 2000)
    packed[20 + flip % (len(packed) - 20)] ^= 1
    with contextlib.suppress(InvalidMeshError):
        assert unpack(bytes(packed), compression, 2000) == data


@pytest.mark.parametrize("compression", PACKERS)
def test_a_bomb_takes_no_memory_beyond_its_limit(compression: str) -> None:
    packed = PACKERS[compression](bytes(64 << 20))
    tracemalloc.start()
    with pytest.raises(UploadTooLargeError, match="unpacks to more than 1,000,000 bytes"):
        for _ in unpacked_pieces(io.BytesIO(packed), compression, 1_000_000):
            pass
    assert tracemalloc.get_traced_memory()[1] < 16 << 20
    tracemalloc.stop()


def test_a_file_of_nothing_but_members_is_refused() -> None:
    with pytest.raises(UploadTooLargeError, match="over 100,000 members"):
        unpack(gzip.compress(b"") * 100_001, "gzip", 100)


def test_a_dictionary_that_takes_too_much_memory_is_refused() -> None:
    filters = [{"id": lzma.FILTER_LZMA2, "dict_size": 1 << 30}]
    with pytest.raises(UploadTooLargeError, match="bytes of memory"):
        unpack(lzma.compress(b"x", filters=filters), "xz", 100)


def test_the_limit_is_that_of_the_caller_and_the_name_is_that_within() -> None:
    points = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    faces = gzip.compress(b"f 1 2 3\n" + points)
    assert parse(faces, filename="a.obj.gz").format == "obj"
    with pytest.raises(UploadTooLargeError, match="more than 20 bytes"):
        parse(faces, limits=MeshLimits(unpacked=20))
    counted = gzip.compress(b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")  # only its ending says OFF
    assert parse(counted, filename="a.off.gz").format == "off"
