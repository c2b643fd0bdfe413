"""Kinds of compressed files: what is in them is read as if it had been sent itself."""

import bz2
import gzip
import lzma

from tests.formats.kinds import BODY, kind, refused
from workers.geometry.formats import write

COMPRESSED = "Compressed files"
PLY = write(BODY, "ply")
HALF = len(PLY) // 2


@kind(COMPRESSED, "gzip of any format", "Unpacked and read.", filename="body.ply.gz")
def gzipped() -> bytes:
    return gzip.compress(PLY)


@kind(COMPRESSED, "bzip2 of any format", "Unpacked and read.", filename="body.ply.bz2")
def bzipped() -> bytes:
    return bz2.compress(PLY)


@kind(COMPRESSED, "xz of any format", "Unpacked and read.", filename="body.ply.xz")
def xz() -> bytes:
    return lzma.compress(PLY)


@kind(COMPRESSED, "lzma of any format", "Unpacked and read.", filename="body.ply.lzma")
def lzma_alone() -> bytes:
    return lzma.compress(PLY, lzma.FORMAT_ALONE)


@kind(COMPRESSED, "gzip of several members", "All members are unpacked and joined.")
def members() -> bytes:
    return gzip.compress(PLY[:HALF]) + gzip.compress(PLY[HALF:])


@kind(COMPRESSED, "xz of several streams, filled up with zeros", "All are unpacked and joined.")
def streams() -> bytes:
    return lzma.compress(PLY[:HALF]) + bytes(4) + lzma.compress(PLY[HALF:]) + bytes(8)


@kind(COMPRESSED, "other bytes behind the compressed ones", "Left alone.")
def rubbish() -> bytes:
    return gzip.compress(PLY) + b"\r\nrubbish"


@kind(COMPRESSED, "compressed twice", "Unpacked twice and read.", filename="body.ply.bz2.gz")
def twice() -> bytes:
    return gzip.compress(bz2.compress(PLY))


@refused(
    COMPRESSED,
    "compressed three times",
    "Unpack it before uploading.",
    reason="compressed more than 2 times",
)
def thrice() -> bytes:
    return gzip.compress(bz2.compress(lzma.compress(PLY)))


@refused(
    COMPRESSED,
    "Zstandard, LZ4, lzip or compress (.Z)",
    "Compress it with gzip, or unpack it before uploading.",
    filename="body.ply.zst",
    reason="packed by zstd, which is not read",
)
def zstandard() -> bytes:
    return b"\x28\xb5\x2f\xfd" + bytes(100)


@refused(COMPRESSED, "cut off", "Send it again as a whole.", reason="ends early: it is cut off")
def cut() -> bytes:
    return gzip.compress(PLY)[:-100]


@refused(COMPRESSED, "damaged", "Send it again.", reason="damaged and cannot be unpacked")
def damaged() -> bytes:
    data = bytearray(gzip.compress(PLY))
    data[-6] ^= 1
    return bytes(data)


@refused(
    COMPRESSED,
    "a bomb: a small file that unpacks to a large one",
    "At most twice the bytes that one file may have come out.",
    reason="unpacks to more than 16,777,216 bytes",
)
def bomb() -> bytes:
    return bz2.compress(bytes(20 << 20))
