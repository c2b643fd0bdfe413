"""From a received file to the mesh file in it: decompressed, or the only mesh of an archive."""

import io

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.containers.compression import HEAD, compression_of, unpack
from workers.geometry.formats.containers.contents import Contents, Found, Skipped, no_mesh
from workers.geometry.formats.containers.members import ArchiveLimits
from workers.geometry.formats.containers.opening import archive_kind, open_archive
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.naming import inner_name

DEEPEST = 2
"""How many times a file may be compressed: a file that was compressed already is common enough."""

LARGEST_RATIO = 1000
"""How much larger a compressed file may become; a mesh seldom becomes 50 times as large."""

ALWAYS_UNPACKED = 16 << 20
"""So many bytes may come out of a file that is small."""


def unwrap(data: bytes, filename: str, limits: MeshLimits) -> tuple[bytes, str]:
    """Return the mesh file that a compressed file or an archive holds; another file as it is.

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
        Cut off or damaged, or an archive that does not hold exactly one mesh.
    UnsupportedFormatError
        Compressed more often than twice, or an archive that cannot be read.
    UploadTooLargeError
        Over the limit.
    """
    is_opened, times = False, 0
    while True:
        kind = None if is_opened else archive_kind(io.BytesIO(data), filename)
        compression = compression_of(data[:HEAD], filename)
        if kind is not None:
            data, filename = _only_mesh(data, filename, kind, limits)
            is_opened = True
        elif compression is None:
            return data, filename
        elif times == DEEPEST:
            raise UnsupportedFormatError(
                f"the file is compressed more than {DEEPEST} times; unpack it before uploading"
            )
        else:
            limit = min(limits.unpacked, max(LARGEST_RATIO * len(data), ALWAYS_UNPACKED))
            data, filename = unpack(data, compression, limit), inner_name(filename)
            times += 1


def is_wrapped(data: bytes, filename: str = "") -> bool:
    """Whether a file is compressed, or an archive.

    Parameters
    ----------
    data : bytes
        The whole file.
    filename : str
        Name of the file.

    Returns
    -------
    bool
        False for a mesh file, 3MF included.
    """
    if compression_of(data[:HEAD], filename):
        return True
    return archive_kind(io.BytesIO(data), filename) is not None


def _only_mesh(data: bytes, filename: str, kind: str, limits: MeshLimits) -> tuple[bytes, str]:
    """Content and name of the mesh of an archive that holds one."""
    allowed = ArchiveLimits(unpacked=limits.unpacked, entry=limits.unpacked)
    skipped: list[str] = []
    meshes = []
    for item in Contents(open_archive(io.BytesIO(data), kind, allowed), allowed).items():
        if isinstance(item, Skipped):
            skipped.append(item.detail)
            continue
        meshes.append(item)
        if len(meshes) > 1:
            first, second = (mesh.path[-100:] for mesh in meshes)
            raise InvalidMeshError(
                f"the archive holds several meshes, {first!r} and {second!r} first; expected one"
            )
    if not meshes:
        raise no_mesh(skipped)
    (mesh,) = meshes
    if isinstance(mesh, Found):
        return mesh.data, mesh.path
    raise mesh.error
