"""The chunks of a GLB file: a header, JSON and one block of binary data."""

import struct
from dataclasses import dataclass

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.gltf.document import Json, read_document, require_version_2

MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
KNOWN = (JSON_CHUNK, BINARY_CHUNK)
MOST_CHUNKS = 10_000
Bytes = bytes | memoryview


@dataclass(frozen=True, eq=False)
class Container:
    """A glTF document with the binary data that came in the same file.

    Attributes
    ----------
    document : dict
        Content of the JSON, of glTF 2.0.
    binary : memoryview or None
        The binary chunk; None in a .gltf file.
    repairs : tuple of str
        Where the file breaks the rules of its container.
    """

    document: Json
    binary: memoryview | None
    repairs: tuple[str, ...] = ()


def is_glb(data: bytes) -> bool:
    """Tell whether a file is a GLB.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        By its first bytes.
    """
    return data.startswith(MAGIC)


def is_gltf(data: bytes) -> bool:
    """Tell whether a file is the JSON of a glTF.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        By its first character and the names in it.
    """
    if not data[:4096].lstrip().startswith(b"{"):
        return False
    return b'"asset"' in data or (b'"meshes"' in data and b'"accessors"' in data)


def open_gltf(data: bytes) -> Container:
    """Take a GLB or a .gltf file apart.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    Container
        Its JSON is parsed, its binary data not copied.

    Raises
    ------
    InvalidMeshError
        No glTF, or its JSON is damaged or not there as a whole.
    UnsupportedFormatError
        glTF 1.0.
    UploadTooLargeError
        See `read_document`.
    """
    if not data.startswith(MAGIC):
        document = read_document(data)
        require_version_2(document.content)
        return Container(document.content, None, document.repairs)
    version = int.from_bytes(data[4:8], "little")
    if version != 2:
        raise UnsupportedFormatError(
            f"the file is GLB version {version}; expected version 2: open it in Blender or "
            "another program and export it as GLB"
        )
    chunks, repairs = _chunks(data)
    if JSON_CHUNK not in chunks:
        raise InvalidMeshError("the GLB file has no JSON chunk")
    document = read_document(bytes(chunks[JSON_CHUNK]))
    require_version_2(document.content)
    binary = chunks.get(BINARY_CHUNK)
    return Container(document.content, binary, (*repairs, *document.repairs))


def write_glb(text: bytes, binary: bytes) -> bytes:
    """Bytes of a GLB file.

    Parameters
    ----------
    text : bytes
        Its JSON.
    binary : bytes
        Its binary data; no chunk is written for none.

    Returns
    -------
    bytes
        Each chunk padded to four bytes.
    """
    text += b" " * (-len(text) % 4)
    parts = [struct.pack("<II", len(text), JSON_CHUNK), text]
    if binary:
        padding = b"\0" * (-len(binary) % 4)
        parts += [struct.pack("<II", len(binary) + len(padding), BINARY_CHUNK), binary, padding]
    length = 12 + sum(len(part) for part in parts)
    return b"".join([MAGIC, struct.pack("<II", 2, length), *parts])


def _chunks(data: bytes) -> tuple[dict[int, memoryview], list[str]]:
    """First chunk of each known kind, as far as it is there, and what was wrong."""
    whole = memoryview(data)
    declared = int.from_bytes(data[8:12], "little")
    repairs = []
    if declared != len(data):
        repairs.append(
            f"the GLB header declares {declared:,} bytes, but the file has {len(data):,}; "
            "all chunks that are there were read"
        )
    chunks: dict[int, memoryview] = {}
    position = 12
    for _ in range(MOST_CHUNKS):
        position = _next_chunk(data, position)
        if position + 8 > len(data) or len(chunks) == len(KNOWN):
            break
        size, kind = struct.unpack_from("<II", data, position)
        position += 8
        if kind in KNOWN and kind not in chunks:
            chunks[kind] = whole[position : position + size]
            if kind == JSON_CHUNK and BINARY_CHUNK in chunks:
                repairs.append("the JSON of the GLB file does not come first")
            if position + size > len(data):
                repairs.append("the last chunk of the GLB file is truncated; the rest was read")
        position += size
    return chunks, repairs


def _next_chunk(data: bytes, position: int) -> int:
    """Where the next chunk begins; some writers pad chunks without counting the padding."""
    aligned = position + -position % 4
    known_at = [
        int.from_bytes(data[at + 4 : at + 8], "little") in KNOWN for at in (position, aligned)
    ]
    return aligned if known_at == [False, True] else position
