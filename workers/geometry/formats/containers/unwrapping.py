"""From a received file to the mesh file in it: decompressed."""

from workers.errors import UnsupportedFormatError
from workers.geometry.formats.containers.compression import HEAD, compression_of, unpack
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.naming import inner_name

DEEPEST = 2
"""How many times a file may be compressed: a file that was compressed already is common enough."""

LARGEST_RATIO = 1000
"""How much larger a compressed file may become; a mesh seldom becomes 50 times as large."""

ALWAYS_UNPACKED = 16 << 20
"""So many bytes may come out of a file that is small."""


def unwrap(data: bytes, filename: str, limits: MeshLimits) -> tuple[bytes, str]:
    """Return the mesh file that a compressed file holds; another file as it is.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Name of the file.
    limits : MeshLimits
        Most bytes that it may unpack to.

    Returns
    -------
    (bytes, str)
        Content and name of the file within.

    Raises
    ------
    InvalidMeshError
        Cut off or damaged.
    UnsupportedFormatError
        Compressed more often than twice.
    UploadTooLargeError
        Over the limit.
    """
    for _ in range(DEEPEST):
        compression = compression_of(data[:HEAD], filename)
        if compression is None:
            return data, filename
        limit = min(limits.unpacked, max(LARGEST_RATIO * len(data), ALWAYS_UNPACKED))
        data, filename = unpack(data, compression, limit), inner_name(filename)
    if compression_of(data[:HEAD], filename):
        raise UnsupportedFormatError(
            f"the file is compressed more than {DEEPEST} times; unpack it before uploading"
        )
    return data, filename
