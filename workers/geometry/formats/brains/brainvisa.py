"""BrainVISA's and Anatomist's .mesh, in text and binary of either byte order."""

import re
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.surfaces.polygons import polygon_mesh
from workers.geometry.formats.text.tokens import Polygons, floats, integral

TEXT = re.compile(rb"\s*ascii\s+VOID\s+([\d\s]*)", re.IGNORECASE)
BINARY = re.compile(rb"binar(ABCD|DCBA)")
WITHOUT_SIGNS = bytes.maketrans(b"(),", b"   ")
LONGEST_NAME = 64  # bytes, of the type of the texture


def is_brainvisa(data: bytes) -> bool:
    """Whether the bytes begin as BrainVISA's meshes do.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True for text and binary alike.
    """
    return TEXT.match(data[:4096]) is not None or BINARY.match(data) is not None


def read_brainvisa(data: bytes, limits: MeshLimits) -> Reading:
    """Read the first time step of a mesh.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Polygons cut into triangles.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    binary = BINARY.match(data)
    numbers: _Text | _Binary
    if binary:
        numbers = _Binary(data, binary.end(), ">" if binary[1] == b"ABCD" else "<")
        numbers.skip_name()
    else:
        text = TEXT.match(data)
        start = text.start(1) if text else 0
        numbers = _Text(floats(data[start:].translate(WITHOUT_SIGNS)))
    return _read(numbers, limits)


def _read(numbers: "_Text | _Binary", limits: MeshLimits) -> Reading:
    """Read what text and binary have alike."""
    n_corners, n_steps, _ = numbers.count(), numbers.count(), numbers.count()
    if n_corners not in (3, 4):
        raise UnsupportedFormatError(
            f"the BrainVISA mesh has {n_corners} corners a polygon; expected 3, a surface"
        )
    n_vertices = numbers.count()
    limits.check(vertices=n_vertices)
    check_length(3 * n_vertices, numbers.left, vertices=n_vertices, faces=0)
    vertices = numbers.floats(3 * n_vertices).reshape(-1, 3)
    numbers.floats(3 * numbers.count())  # normals
    if numbers.count():
        raise UnsupportedFormatError("the BrainVISA mesh has a texture inside, which is not read")
    n_faces = numbers.count()
    limits.check(faces=n_faces)
    corners = numbers.integers(n_corners * n_faces)
    polygons = Polygons(np.full(n_faces, n_corners, dtype=np.int64), corners)
    found = (f"{n_steps} time steps, of which the first is read",) if n_steps > 1 else ()
    return Reading(polygon_mesh(vertices, polygons, limits), found=found)


def _require(needed: int, left: int) -> None:
    """Raise where so many numbers do not follow."""
    if needed > left:
        raise InvalidMeshError(
            f"the BrainVISA mesh needs {needed:,} more numbers, but {left:,} follow: "
            "it is truncated"
        )


@dataclass
class _Text:
    """Numbers of a text, one after the other."""

    values: FloatArray
    position: int = 0

    @property
    def left(self) -> int:
        """How many follow."""
        return len(self.values) - self.position

    def count(self) -> int:
        """Read one count."""
        return int(self.integers(1)[0])

    def floats(self, count: int) -> FloatArray:
        """Read numbers."""
        _require(count, self.left)
        self.position += count
        return self.values[self.position - count : self.position]

    def integers(self, count: int) -> IntArray:
        """Read whole numbers from 0."""
        whole = integral(self.floats(count))
        if (whole < 0).any():
            raise InvalidMeshError(f"expected a count or a vertex index, found {whole.min()}")
        return whole


@dataclass
class _Binary:
    """Numbers of four bytes, one after the other."""

    data: bytes
    position: int
    byte_order: str

    @property
    def left(self) -> int:
        """How many follow."""
        return (len(self.data) - self.position) // 4

    def skip_name(self) -> None:
        """Go on behind the name of the type of the texture."""
        length = self.count()
        if length > LONGEST_NAME:
            raise InvalidMeshError("the BrainVISA mesh does not name the type of its texture")
        self.position += length

    def count(self) -> int:
        """Read one count."""
        return int(self.integers(1)[0])

    def floats(self, count: int) -> FloatArray:
        """Read numbers."""
        return as_floats(self._values("f4", count))

    def integers(self, count: int) -> IntArray:
        """Read whole numbers from 0."""
        return self._values("u4", count).astype(np.int64)

    def _values(self, type: str, count: int) -> "np.ndarray[tuple[int], np.dtype[np.generic]]":
        """Numbers as they are in the file."""
        _require(count, self.left)
        values = np.frombuffer(self.data, self.byte_order + type, count, self.position)
        self.position += 4 * count
        return values
