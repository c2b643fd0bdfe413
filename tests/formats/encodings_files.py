"""Kinds of text encodings, which all text formats share."""

import codecs

from tests.formats.kinds import BODY, kind
from workers.geometry.formats import write

AS_UTF_16 = ("read the text as UTF-16",)


@kind(
    "Text",
    "UTF-16 with a byte order mark, as Windows redirects write it",
    "Read as the same text in ASCII.",
    repairs=AS_UTF_16,
)
def utf_16() -> bytes:
    return codecs.BOM_UTF16_LE + write(BODY, "off").decode().encode("utf-16-le")


@kind("Text", "UTF-16, high byte first", "Read as the same text in ASCII.", repairs=AS_UTF_16)
def utf_16_high_byte_first() -> bytes:
    return codecs.BOM_UTF16_BE + write(BODY, "obj").decode().encode("utf-16-be")


@kind(
    "Text",
    "UTF-16 without a byte order mark",
    "Known by its first characters; read as the same text in ASCII.",
    repairs=AS_UTF_16,
)
def utf_16_unmarked() -> bytes:
    return write(BODY, "obj").decode().encode("utf-16-le")


@kind(
    "Text",
    "UTF-16, high byte first, without a byte order mark",
    "Known by its first characters; read as the same text in ASCII.",
    repairs=AS_UTF_16,
)
def utf_16_high_byte_first_unmarked() -> bytes:
    return write(BODY, "off").decode().encode("utf-16-be")


@kind(
    "Text",
    "UTF-16 with one byte too few at the end",
    "Read up to the last whole character.",
    repairs=AS_UTF_16,
)
def utf_16_cut() -> bytes:
    return utf_16()[:-1]


@kind(
    "Text",
    "UTF-32",
    "Read as the same text in ASCII.",
    repairs=("read the text as UTF-32",),
)
def utf_32() -> bytes:
    return write(BODY, "obj").decode().encode("utf-32")


@kind(
    "Text",
    "UTF-16 with names in other scripts",
    "Read; names are left alone.",
    repairs=AS_UTF_16,
)
def utf_16_names() -> bytes:
    return ("# 部品名 Körper\no 球\n" + write(BODY, "obj").decode()).encode("utf-16")


@kind(
    "Text",
    "UTF-8 with a byte order mark",
    "The mark is left out.",
    repairs=("left out the byte order mark",),
)
def utf_8() -> bytes:
    return codecs.BOM_UTF8 + write(BODY, "off")
