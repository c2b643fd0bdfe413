"""One XML part of a 3MF file, read as a stream."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray

COUNTED_TOGETHER = 4096  # vertices or triangles between two looks at the limits


@dataclass(frozen=True, eq=False)
class Reference:
    """An object placed by a transform (4, 4), in this part (path None) or another."""

    path: str | None
    object_id: str
    transform: FloatArray


@dataclass(frozen=True, eq=False)
class Object3MF:
    """A mesh (n, 3), (m, 3), or components, or nothing."""

    vertices: FloatArray
    faces: IntArray
    components: tuple[Reference, ...]


@dataclass(frozen=True, eq=False)
class Model3MF:
    """Objects by id, and what of them is built."""

    objects: dict[str, Object3MF]
    build: tuple[Reference, ...]


def read_model_part(pieces: Iterable[bytes], count: Callable[[int, int], None]) -> Model3MF:
    """Read the objects and build items of a model part.

    Parameters
    ----------
    pieces : iterable of bytes
        The XML, piece after piece.
    count : function
        Called with numbers of further vertices and triangles while reading; raises when
        there are too many.

    Returns
    -------
    Model3MF
        Objects by id, and what is built, in the order of the file.

    Raises
    ------
    InvalidMeshError
        Damaged XML, a document type, a missing or bad attribute.
    """
    handler = _Handler(count)
    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = handler.doctype
    parser.StartElementHandler = handler.start
    parser.EndElementHandler = handler.end
    try:
        _feed(parser, pieces)
    except expat.ExpatError as error:
        raise InvalidMeshError(f"the XML of the 3MF file is damaged: {error}") from None
    except KeyError as error:
        raise InvalidMeshError(f"the XML of the 3MF file lacks the attribute {error}") from None
    return Model3MF(handler.objects, tuple(handler.build))


def _feed(parser: expat.XMLParserType, pieces: Iterable[bytes]) -> None:
    """Parse all pieces, with as much at a time as an unfinished tag or comment is long.

    expat before 2.6 reads an unfinished one from its beginning each time something is added, so
    small pieces would take the square of its length.
    """
    waiting: list[bytes] = []
    n_waiting = n_parsed = 0
    for piece in pieces:
        waiting.append(piece)
        n_waiting += len(piece)
        if n_waiting >= n_parsed - max(parser.CurrentByteIndex, 0):
            parser.Parse(b"".join(waiting), False)
            n_parsed += n_waiting
            waiting, n_waiting = [], 0
    parser.Parse(b"".join(waiting), True)


@dataclass
class _Handler:
    """Collects what expat reports."""

    count: Callable[[int, int], None]
    objects: dict[str, Object3MF] = field(default_factory=dict)
    build: list[Reference] = field(default_factory=list)
    coordinates: list[str] = field(default_factory=list)
    corners: list[str] = field(default_factory=list)
    components: list[Reference] = field(default_factory=list)
    object_id: str = ""
    uncounted_vertices: int = 0
    uncounted_faces: int = 0

    def doctype(self, *_: object) -> None:
        """Refuse a document type: entities could expand without bound."""
        raise InvalidMeshError("the XML of the 3MF file has a document type, which is refused")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one element."""
        name = tag.rpartition(":")[2]
        if name == "vertex":
            self.coordinates += (attributes["x"], attributes["y"], attributes["z"])
            self.uncounted_vertices += 1
        elif name == "triangle":
            self.corners += (attributes["v1"], attributes["v2"], attributes["v3"])
            self.uncounted_faces += 1
        elif name == "object":
            self.object_id = attributes["id"]
        elif name == "component":
            self.components.append(_reference(attributes))
        elif name == "item":
            self.build.append(_reference(attributes))
        if self.uncounted_vertices + self.uncounted_faces >= COUNTED_TOGETHER:
            self._count()

    def end(self, tag: str) -> None:
        """Finish an object."""
        if tag.rpartition(":")[2] != "object":
            return
        self._count()
        try:
            vertices = np.array(self.coordinates, dtype=np.float64).reshape(-1, 3)
            faces = np.array(self.corners, dtype=np.int64).reshape(-1, 3)
        except (ValueError, OverflowError):
            raise InvalidMeshError(
                "the 3MF file has a coordinate or index that is no number"
            ) from None
        self.objects[self.object_id] = Object3MF(vertices, faces, tuple(self.components))
        self.coordinates, self.corners, self.components = [], [], []

    def _count(self) -> None:
        """Report what was read since the last time."""
        self.count(self.uncounted_vertices, self.uncounted_faces)
        self.uncounted_vertices = self.uncounted_faces = 0


def _reference(attributes: dict[str, str]) -> Reference:
    """Reference of a component or build item; 3MF's matrices multiply rows."""
    path = next((v for k, v in attributes.items() if k.rpartition(":")[2] == "path"), None)
    transform = np.eye(4)
    if "transform" in attributes:
        numbers = attributes["transform"].split()
        try:
            transform[:3] = np.array(numbers, dtype=np.float64).reshape(4, 3).T
        except ValueError:
            raise InvalidMeshError("a transform of the 3MF file is not 12 numbers") from None
    return Reference(path, attributes["objectid"], transform)
