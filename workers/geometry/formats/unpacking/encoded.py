"""Base64, zlib and xz inside of a file, never past an expected size."""

import base64
import binascii
import lzma
import re
import zlib

from workers.errors import InvalidMeshError, UploadTooLargeError

PADDED = re.compile(rb"[^=]+=*")
XZ_MEMORY = 128 << 20  # bytes; what xz -9 takes
ANY_HEADER = 47  # zlib or gzip


class Allowance:
    """How many bytes may still be unpacked.

    Parameters
    ----------
    limit : int
        In bytes, all that is unpacked together.
    """

    def __init__(self, limit: int) -> None:
        self.limit = self.left = limit

    def take(self, size: int) -> None:
        """Use up so many bytes.

        Parameters
        ----------
        size : int
            About to be unpacked.

        Raises
        ------
        UploadTooLargeError
            More than are left.
        """
        self.left -= size
        if self.left < 0:
            raise UploadTooLargeError(
                f"the file unpacks to more than {self.limit:,} bytes, which is not accepted"
            )


def decode_base64(text: bytes) -> bytes:
    """Decode base64, also of several parts that each end in padding.

    Parameters
    ----------
    text : bytes
        With blanks and line ends anywhere.

    Returns
    -------
    bytes
        All parts together.

    Raises
    ------
    InvalidMeshError
        A character that is not base64's, or one too few.
    """
    try:
        parts = PADDED.findall(b"".join(text.split()))
        return b"".join(base64.b64decode(part, validate=True) for part in parts)
    except binascii.Error as error:
        raise InvalidMeshError(f"the base64 text of the file is damaged: {error}") from None


def unpack_zlib(data: bytes, size: int, allowance: Allowance) -> bytes:
    """Unpack zlib or gzip to an expected size.

    Parameters
    ----------
    data : bytes
        Packed.
    size : int
        What it should unpack to, in bytes.
    allowance : Allowance
        The size is taken from it before anything is unpacked.

    Returns
    -------
    bytes
        Of that size.

    Raises
    ------
    InvalidMeshError
        Damaged, or of another size.
    UploadTooLargeError
        No room for it.
    """
    allowance.take(size)
    try:
        return _checked(zlib.decompressobj(ANY_HEADER).decompress(data, size + 1), size)
    except zlib.error as error:
        raise InvalidMeshError(f"a compressed part of the file is damaged: {error}") from None


def unpack_xz(data: bytes, size: int, allowance: Allowance) -> bytes:
    """Unpack xz or lzma to an expected size.

    Parameters
    ----------
    data : bytes
        Packed.
    size : int
        What it should unpack to, in bytes.
    allowance : Allowance
        The size is taken from it before anything is unpacked.

    Returns
    -------
    bytes
        Of that size.

    Raises
    ------
    InvalidMeshError
        Damaged, or of another size.
    UploadTooLargeError
        No room for it.
    """
    allowance.take(size)
    try:
        unpacker = lzma.LZMADecompressor(memlimit=XZ_MEMORY)
        return _checked(unpacker.decompress(data, size + 1), size)
    except lzma.LZMAError as error:
        raise InvalidMeshError(f"a compressed part of the file is damaged: {error}") from None


def _checked(unpacked: bytes, size: int) -> bytes:
    """Return what was unpacked, if it has the size that was expected."""
    if len(unpacked) != size:
        more = "more" if len(unpacked) > size else f"{len(unpacked):,}"
        raise InvalidMeshError(
            f"a compressed part of the file unpacks to {more} bytes; expected {size:,}"
        )
    return unpacked
