"""Bytes of the buffer views of a glTF file, decompressed where they must be."""

from dataclasses import dataclass, field

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.formats.gltf import meshopt
from workers.geometry.formats.gltf.container import Container
from workers.geometry.formats.gltf.document import Json, entries, entry, natural, part
from workers.geometry.formats.gltf.uris import decode_data, is_data, missing_file
from workers.geometry.formats.limits import MeshLimits

Bytes = bytes | memoryview


@dataclass
class Budget:
    """How much may still be unpacked, all parts of a file together.

    Attributes
    ----------
    left : int
        Bytes.
    """

    left: int

    def take(self, size: int) -> None:
        """Count what is about to be unpacked.

        Parameters
        ----------
        size : int
            Bytes.

        Raises
        ------
        UploadTooLargeError
            More than is left.
        """
        self.left -= size
        if self.left < 0:
            raise UploadTooLargeError(
                "the glTF file unpacks to more than is accepted: simplify the mesh, or send it "
                "in parts"
            )


@dataclass(frozen=True, eq=False)
class View:
    """Bytes of a buffer view.

    Attributes
    ----------
    data : bytes or memoryview
        As far as they are there.
    stride : int
        Bytes from one element to the next; 0 where they follow each other.
    """

    data: Bytes
    stride: int


@dataclass
class Buffers:
    """The buffers of one file; read, decoded and unpacked when they are first needed.

    Attributes
    ----------
    container : Container
        The file.
    limits : MeshLimits
        Its ``unpacked`` holds for all views together.
    """

    container: Container
    limits: MeshLimits
    _data: dict[int, Bytes] = field(default_factory=dict)
    _unpacked: dict[int, View] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Look up what is asked for again and again."""
        document = self.container.document
        self._views = entries(document, "bufferViews")
        self._buffers = entries(document, "buffers")
        required = document.get("extensionsRequired")
        names = required if isinstance(required, list) else []
        self._required = {name for name in names if isinstance(name, str)}
        self.budget = Budget(self.limits.unpacked)

    def view(self, index: object) -> View:
        """Find the bytes of a buffer view.

        Parameters
        ----------
        index : object
            Its number, as the document has it.

        Returns
        -------
        View
            Shorter than declared where the file is truncated.

        Raises
        ------
        InvalidMeshError
            No such view, or its buffer is missing or damaged.
        UnsupportedFormatError
            It needs an extension that is not read.
        UploadTooLargeError
            It unpacks to more than the limits allow.
        """
        item = entry(self._views, index, "buffer view")
        stride = natural(item, "byteStride")
        for name in meshopt.NAMES:
            compressed = part(item, "extensions", name)
            if compressed:
                return self._decompressed(int(str(index)), compressed, stride)
        self.require_known(item, "buffer view")
        return View(self._piece(item), stride)

    def require_known(self, item: Json, noun: str) -> None:
        """Raise ``UnsupportedFormatError`` if something needs an extension that is not read.

        Parameters
        ----------
        item : dict
            A part of the document that holds geometry, and no plain data.
        noun : str
            What it is, for the message.

        Raises
        ------
        UnsupportedFormatError
            It uses an extension that the document requires.
        """
        for name in part(item, "extensions"):
            if name in self._required:
                raise UnsupportedFormatError(
                    f"a {noun} of the glTF file needs the extension {name[:60]}, which is not "
                    "read: open it in Blender or another program and export it as plain GLB"
                )

    def is_required(self, name: str) -> bool:
        """Tell whether the document requires an extension.

        Parameters
        ----------
        name : str
            Of the extension.

        Returns
        -------
        bool
            True if a reader may not go without.
        """
        return name in self._required

    def _decompressed(self, index: int, extension: Json, stride: int) -> View:
        """View under meshopt compression; its size is checked first."""
        if index not in self._unpacked:
            size = natural(extension, "byteStride")
            self.budget.take(natural(extension, "count") * size)
            decoded = meshopt.decode_view(extension, self._piece(extension))
            attributes = extension.get("mode") == "ATTRIBUTES"
            self._unpacked[index] = View(decoded.data, stride or (size if attributes else 0))
        return self._unpacked[index]

    def _piece(self, item: Json) -> Bytes:
        """Bytes of a buffer from an offset, of a length."""
        data = self._buffer(item.get("buffer"))
        start = natural(item, "byteOffset")
        return memoryview(data)[start : start + natural(item, "byteLength")]

    def _buffer(self, index: object) -> Bytes:
        """Bytes of one buffer: the GLB's own, or embedded ones."""
        item = entry(self._buffers, index, "buffer")
        number = int(str(index).partition(".")[0])
        uri = item.get("uri")
        if not isinstance(uri, str):
            if self.container.binary is None or number != 0:
                raise InvalidMeshError(f"buffer {number} of the glTF file has no data")
            return self.container.binary
        if not is_data(uri):
            raise missing_file(uri)
        if number not in self._data:
            self._data[number] = decode_data(uri)
        return self._data[number]
