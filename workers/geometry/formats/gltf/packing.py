"""A .gltf file and the files that it refers to, put together as one GLB."""

import json
from collections.abc import Mapping

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.gltf.container import open_gltf, write_glb
from workers.geometry.formats.gltf.document import Json, entries, natural, part
from workers.geometry.formats.gltf.meshopt import NAMES as MESHOPT
from workers.geometry.formats.gltf.uris import (
    FileNames,
    decode_data,
    file_name,
    is_data,
    is_relative,
    missing_file,
)

LONGEST = 3 << 30  # bytes; a GLB holds 4 GiB, its JSON included
MEDIA_TYPES = {
    b"\x89PNG": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
    b"\xabKTX": "image/ktx2",
}


def referenced_files(document: bytes) -> tuple[str, ...]:
    """Names of the files that a glTF document needs beside it: its buffers and images.

    Parameters
    ----------
    document : bytes
        A .gltf file; a GLB may refer to files too.

    Returns
    -------
    tuple of str
        Relative paths, percent-decoded, each once, in the order of the file. Empty for glTF 1.0,
        which reading refuses.

    Raises
    ------
    InvalidMeshError
        No glTF.
    UploadTooLargeError
        Its JSON has too many objects.
    """
    try:
        content = open_gltf(document).document
    except UnsupportedFormatError:
        return ()
    keys = [key for key in content if key in ("buffers", "images")]
    uris = [item.get("uri") for key in keys for item in entries(content, key)]
    names = [file_name(uri) for uri in uris if isinstance(uri, str) and is_relative(uri)]
    return tuple(dict.fromkeys(names))


def pack_glb(document: bytes, files: Mapping[str, bytes]) -> bytes:
    """Make a self-contained GLB of a .gltf file and the files that it refers to.

    Parameters
    ----------
    document : bytes
        The .gltf file.
    files : mapping of str to bytes
        What came with it, by path. Names match exactly, or percent-decoded, or without regard to
        case; or by the base name alone, if only one file has it.

    Returns
    -------
    bytes
        The same for the same files. Images that are missing keep their URI.

    Raises
    ------
    InvalidMeshError
        No glTF, or a buffer whose file is missing, by name.
    UnsupportedFormatError
        glTF 1.0.
    UploadTooLargeError
        Buffers over 3 GiB, or too many objects in the JSON.
    """
    container = open_gltf(document)
    content = container.document
    packing = _Packing(files)
    for number, item in enumerate(entries(content, "buffers")):
        uri = item.get("uri")
        if isinstance(uri, str):
            packing.add_buffer(number, uri)
        elif container.binary is not None and number == 0:
            packing.add_bytes(number, bytes(container.binary))
        else:
            packing.keep(number, item)
    packed = dict(content)
    packed["images"] = [packing.embed(item) for item in entries(content, "images")]
    packed["bufferViews"] = [packing.moved(view) for view in entries(content, "bufferViews")]
    packing.append_views(packed)
    try:
        text = json.dumps({key: value for key, value in packed.items() if value != []})
    except RecursionError:
        raise InvalidMeshError("the JSON of the glTF file is nested too deeply") from None
    return write_glb(text.encode(), packing.binary())


class _Packing:
    """Puts the data of all buffers and images one after the other, each file once."""

    def __init__(self, files: Mapping[str, bytes]) -> None:
        self._files = files
        self._names = FileNames(files)
        self._parts: list[bytes] = []
        self._length = 0
        self._places: dict[str, tuple[int, int]] = {}  # of files: start and length
        self._moves: dict[int, tuple[int, int]] = {}  # of buffers
        self._kept: list[Json] = []  # buffers that have no data anywhere
        self._kept_places: dict[int, int] = {}
        self._images: list[Json] = []  # buffer views of images

    def add_buffer(self, number: int, uri: str) -> None:
        """Take in a buffer: data in the document, or a file."""
        if is_data(uri):
            self.add_bytes(number, decode_data(uri))
            return
        name = self._names.find(uri)
        if name is None:
            raise missing_file(uri)
        self._moves[number] = self._place(name)

    def add_bytes(self, number: int, data: bytes) -> None:
        """Take in the data of a buffer."""
        self._moves[number] = self._append(data)

    def keep(self, number: int, item: Json) -> None:
        """Keep a buffer that has no data; what is compressed may name one."""
        self._kept_places[number] = len(self._kept)
        self._kept.append(item)

    def embed(self, image: Json) -> Json:
        """Image as a buffer view, if its file is there; its number is set in `append_views`."""
        uri = image.get("uri")
        name = self._names.find(uri) if isinstance(uri, str) and not is_data(uri) else None
        if name is None:
            return image
        start, length = self._place(name)
        view = {"buffer": 0, "byteOffset": start, "byteLength": length}
        self._images.append(view)
        rest = {key: value for key, value in image.items() if key != "uri"}
        found = self._files[name][:4]
        kind = next((kind for magic, kind in MEDIA_TYPES.items() if found.startswith(magic)), None)
        return rest | {"bufferView": view} | ({"mimeType": kind} if kind else {})

    def moved(self, item: Json) -> Json:
        """Buffer view at its new place; one beyond its buffer must not reach into the next."""
        changed = dict(item)
        for name in MESHOPT:
            inner = part(item, "extensions", name)
            if inner:
                moved = self._moved(inner)
                changed["extensions"] = changed["extensions"] | {name: moved}
        return self._moved(changed)

    def append_views(self, packed: Json) -> None:
        """Number the views of the images, and list the buffers."""
        views = packed["bufferViews"]
        for image in packed["images"]:
            if isinstance(image.get("bufferView"), dict):
                views.append(image["bufferView"])
                image["bufferView"] = len(views) - 1
        merged = [{"byteLength": self._length}] if self._length else []
        packed["buffers"] = merged + self._kept

    def binary(self) -> bytes:
        """Return the data of the one buffer."""
        return b"".join(self._parts)

    def _moved(self, item: Json) -> Json:
        """Something that lies in a buffer, at its new place."""
        number = item.get("buffer")
        if isinstance(number, int) and number in self._kept_places:
            return item | {"buffer": self._kept_places[number] + bool(self._length)}
        if not isinstance(number, int) or number not in self._moves:
            return item  # reading says what is wrong, if anything needs it
        start, length = self._moves[number]
        offset = min(natural(item, "byteOffset"), length)
        size = min(natural(item, "byteLength"), length - offset)
        return item | {"buffer": 0, "byteOffset": start + offset, "byteLength": size}

    def _place(self, name: str) -> tuple[int, int]:
        """Where the data of a file lies; it is taken in when first asked for."""
        if name not in self._places:
            self._places[name] = self._append(self._files[name])
        return self._places[name]

    def _append(self, data: bytes) -> tuple[int, int]:
        """Start and length of further data."""
        start = self._length
        padded = data + b"\0" * (-len(data) % 8)
        self._parts.append(padded)
        self._length += len(padded)
        if self._length > LONGEST:
            raise UploadTooLargeError("the buffers of the glTF file are larger than 3 GiB")
        return start, len(data)
