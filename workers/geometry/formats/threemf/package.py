"""3MF: a zip of XML parts; objects, components and the build's transforms.

The XML is read as a stream by expat; a document type, and with it every entity, is refused.
"""

import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.polygons import require_faces, require_indices
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.threemf.model_part import Model3MF, Reference, read_model_part
from workers.geometry.mesh import TriangleMesh

MOST_ENTRIES = 10_000
MOST_PARTS = 256  # of them, model parts
LARGEST_UNPACKED = 512 << 20  # bytes, all model parts together
LARGEST_RATIO = 200  # unpacked to packed
DEEPEST_NESTING = 16  # components within components
MOST_INSTANCES = 100_000


def is_3mf(data: bytes) -> bool:
    """Whether this zip archive has a 3MF model part.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    bool
        False also for a damaged archive.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return any(name.lower().endswith(".model") for name in archive.namelist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OverflowError):
        return False


def read_3mf(data: bytes, limits: MeshLimits) -> Reading:
    """Read all build items of a 3MF file.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Triangles of the build items, placed by their transforms, or of all objects where
        nothing is built.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = [e for e in archive.infolist() if e.filename.lower().endswith(".model")]
        if len(archive.infolist()) > MOST_ENTRIES or len(entries) > MOST_PARTS:
            raise UploadTooLargeError("the 3MF archive has too many entries")
        if not entries:
            raise UnsupportedFormatError("the zip archive has no 3MF model part")
        _check_size(entries, len(data))
        budget = _Budget(limits)
        parts = {
            "/" + entry.filename.lstrip("/"): read_model_part(_unpack(archive, entry), budget.count)
            for entry in entries
        }
    return Reading(_Assembly(parts, limits).mesh())


def _check_size(entries: list[zipfile.ZipInfo], packed: int) -> None:
    """Raise ``UploadTooLargeError`` if the parts unpack to too much, all together.

    Entries may lie over each other in the archive, so the whole file counts as packed once.
    """
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > LARGEST_UNPACKED:
        raise UploadTooLargeError(
            f"the 3MF model parts unpack to {unpacked:,} bytes, "
            f"but at most {LARGEST_UNPACKED:,} are accepted"
        )
    if unpacked > LARGEST_RATIO * max(packed, 1024):
        raise UploadTooLargeError(
            f"the 3MF model parts unpack to more than {LARGEST_RATIO} times the file's size"
        )


def _unpack(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Iterator[bytes]:
    """Pieces of an entry's content, never more than the directory declared."""
    unpacked = 0
    with archive.open(entry) as stream:
        while piece := stream.read(1 << 16):
            unpacked += len(piece)
            if unpacked > entry.file_size:
                raise UploadTooLargeError("the 3MF model part unpacks to more than it declares")
            yield piece


class _Budget:
    """Counts vertices and triangles of all parts while they are read."""

    def __init__(self, limits: MeshLimits) -> None:
        self._limits = limits
        self._vertices = 0
        self._faces = 0

    def count(self, vertices: int, faces: int) -> None:
        """Add to the counts and check them.

        Parameters
        ----------
        vertices, faces : int
            How many more there are.
        """
        self._vertices += vertices
        self._faces += faces
        self._limits.check(vertices=self._vertices, faces=self._faces)


@dataclass
class _Assembly:
    """Places the objects where the build says, counting before it allocates."""

    parts: dict[str, Model3MF]
    limits: MeshLimits
    vertices: list[FloatArray] = field(default_factory=list)
    faces: list[IntArray] = field(default_factory=list)
    n_vertices: int = 0
    n_faces: int = 0
    n_instances: int = 0

    def mesh(self) -> TriangleMesh:
        """Mesh of all build items, or of all objects where nothing is built."""
        built = [(path, item) for path, part in self.parts.items() for item in part.build]
        if not built:
            built = [
                (path, Reference(None, object_id, np.eye(4)))
                for path, part in self.parts.items()
                for object_id, thing in part.objects.items()
                if len(thing.faces)
            ]
        for path, item in built:
            self._place(path, item, np.eye(4), 0)
        require_faces(self.n_vertices, self.n_faces)
        return TriangleMesh(np.concatenate(self.vertices), np.concatenate(self.faces))

    def _place(self, path: str, reference: Reference, parent: FloatArray, depth: int) -> None:
        """Add one instance of an object and of its components."""
        self.n_instances += 1
        if depth > DEEPEST_NESTING or self.n_instances > MOST_INSTANCES:
            raise InvalidMeshError("the 3MF objects refer to each other too often or in a circle")
        path = reference.path or path
        part = self.parts.get(path)
        thing = part.objects.get(reference.object_id) if part else None
        if thing is None:
            raise InvalidMeshError(f"the 3MF file has no object {reference.object_id[:20]!r}")
        transform = parent @ reference.transform
        if len(thing.faces):
            self._add(thing.vertices, thing.faces, transform)
        for component in thing.components:
            self._place(path, component, transform, depth + 1)

    def _add(self, vertices: FloatArray, faces: IntArray, transform: FloatArray) -> None:
        """Add the triangles of one object."""
        require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), len(vertices))
        self.limits.check(vertices=self.n_vertices + len(vertices), faces=self.n_faces + len(faces))
        with np.errstate(all="ignore"):  # infinite coordinates are cleaning's to report
            self.vertices.append(vertices @ transform[:3, :3].T + transform[:3, 3])
        self.faces.append(faces + self.n_vertices)
        self.n_vertices += len(vertices)
        self.n_faces += len(faces)
