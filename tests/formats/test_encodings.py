"""Wide characters become UTF-8; binary data stays as it is."""

import codecs
import struct

import numpy as np
import pytest

from tests.meshes import bumpy_sphere
from workers.geometry.formats import WRITTEN_FORMATS, detect_format, parse, write
from workers.geometry.formats.text.encodings import readable

WIDE = ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be"]


@pytest.mark.parametrize("format", WRITTEN_FORMATS)
def test_binary_files_and_plain_text_are_left_alone(format: str) -> None:
    data = write(bumpy_sphere(2), format)
    assert readable(data).data is data
    assert readable(data).repairs == ()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff",
        b"\xff\xfe",
        b"\xff\xfe\0\0",
        b"\xff\xfe" + bytes(range(256)) * 4,
        b"\xff\xff\xfe created by FreeSurfer\n\n" + bytes(100),
        b"\xfe\xff" + np.random.default_rng(0).bytes(5000),
        np.random.default_rng(1).bytes(5000),
        bytes(200),
        np.arange(2000, dtype="<u2").tobytes(),
        np.arange(32, 126, dtype="<u2").tobytes()[:20],
        b"\xff\xfe\xff\x0e" + "SketchUp Model".encode("utf-16-le") + bytes(50),
        b"\xff\xfe\xff\x0e" + "SketchUp Model, no zero unit".encode("utf-16-le"),
        b"\xff\xfe" + struct.pack("<100f", *range(100)),
    ],
)
def test_binary_data_is_not_taken_for_text(data: bytes) -> None:
    assert readable(data).data == data


@pytest.mark.parametrize("encoding", WIDE)
def test_every_wide_encoding_is_the_same_text(encoding: str) -> None:
    text = "OFF\r\n# Größe in mm, 長さ, 𝛑\r\n3 1 0\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2\r\n"
    data = text.encode(encoding)
    assert readable(data).data == text.encode()
    assert detect_format(data) == "off"
    assert parse(data).mesh.n_faces == 1


def test_half_a_pair_of_surrogates_is_no_obstacle() -> None:
    data = codecs.BOM_UTF16_LE + "OFF # ".encode("utf-16-le") + b"\x3d\xd8" + b"\n\0"
    assert readable(data).data.startswith(b"OFF # ")


def test_the_encoding_that_xml_declares_is_that_of_the_bytes() -> None:
    text = '<?xml version="1.0" encoding="UTF-16"?>\n<VTKFile type="PolyData"></VTKFile>'
    assert b'encoding="utf-8"' in readable(text.encode("utf-16")).data
    assert b'encoding="utf-8"' in readable(text.encode("utf-16-be")).data


def test_two_byte_order_marks_are_left_out_together() -> None:
    assert readable(2 * codecs.BOM_UTF8 + b"OFF").data == b"OFF"
