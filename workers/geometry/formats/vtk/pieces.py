"""Elements of VTK's XML files, and the points and cells of each piece."""

from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.rows.records import polygons_by_offsets
from workers.geometry.formats.surfaces.cells import POLYHEDRON, Cells
from workers.geometry.formats.text.tokens import Polygons, quoted
from workers.geometry.formats.vtk.arrays import ArrayReader, DataArray, Encoding
from workers.geometry.formats.vtk.datasets import GRIDS, poly_cells
from workers.geometry.formats.vtk.grid import grid_cells

LISTS = {"verts": "vertices", "lines": "lines", "polys": "polygons", "strips": "triangle_strips"}
GEOMETRY = ("points", "cells", *LISTS)
ATTRIBUTES = {"pointdata": "point data", "celldata": "cell data"}
HEADER_TYPES = {"uint32": "u4", "uint64": "u8"}


@dataclass
class Piece:
    """One piece: its attributes, and its arrays by section and name in lower case."""

    attributes: dict[str, str]
    arrays: dict[tuple[str, str], DataArray] = field(default_factory=dict)


@dataclass
class Pieces:
    """Takes up the elements of a file.

    Attributes
    ----------
    dataset : str
        Kind of the data set, in lower case.
    encoding : Encoding
        How numbers are written.
    pieces : list of Piece
        In the order of the file.
    offsets : set of int
        Where appended arrays begin, those not needed included.
    found : set of str
        What else there is.
    """

    dataset: str = ""
    encoding: Encoding = field(default_factory=Encoding)
    pieces: list[Piece] = field(default_factory=list)
    offsets: set[int] = field(default_factory=set)
    found: set[str] = field(default_factory=set)
    _section: str = ""
    _kind: str = ""
    _array: dict[str, str] | None = None
    _text: list[str] = field(default_factory=list)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up the beginning of an element.

        Parameters
        ----------
        tag : str
            Its name.
        attributes : dict of str
            As they stand there.
        """
        name = tag.lower()
        if name == "vtkfile":
            self.dataset = attributes.get("type", "").lower()
            self.encoding = _encoding(attributes)
        elif name == "piece":
            self.pieces.append(Piece(attributes))
        elif name in GEOMETRY:
            self._section = name
        elif name in ATTRIBUTES:
            self._section = ""
        elif name == "dataarray":
            array = DataArray(attributes, "")
            if array.format == "appended":
                self.offsets.add(array.offset)
            if self._section and self.pieces:
                self._array, self._text = attributes, []
            elif self._kind:
                self.found.add(self._kind)
        self._kind = ATTRIBUTES.get(name, self._kind if name != "fielddata" else "")

    def end(self, tag: str) -> None:
        """Take up the end of an element.

        Parameters
        ----------
        tag : str
            Its name.
        """
        name = tag.lower()
        if name == "dataarray" and self._array is not None:
            key = self._section, self._array.get("Name", "").lower()
            self.pieces[-1].arrays.setdefault(key, DataArray(self._array, "".join(self._text)))
            self._array, self._text = None, []
        elif name in GEOMETRY:
            self._section = ""

    def text(self, piece: str) -> None:
        """Take up a piece of text.

        Parameters
        ----------
        piece : str
            Of an array, or between elements.
        """
        if self._array is not None:
            self._text.append(piece)


def piece_points(piece: Piece, reader: ArrayReader) -> FloatArray:
    """Positions of a piece.

    Parameters
    ----------
    piece : Piece
        With an array in its section "points", of any name.
    reader : ArrayReader
        Of the file.

    Returns
    -------
    (n, 3) float64

    Raises
    ------
    InvalidMeshError
        The array does not hold three numbers a point.
    """
    array = next((a for (section, _), a in piece.arrays.items() if section == "points"), None)
    values = np.zeros(0) if array is None else reader.floats(array)
    declared = piece.attributes.get("NumberOfPoints", "").strip()
    n_points, rest = divmod(len(values), 3)
    if rest or (declared.isascii() and declared.isdigit() and int(declared[:15]) != n_points):
        raise InvalidMeshError(
            f"a piece of the VTK file declares {quoted(declared.encode())} points, "
            f"but has {len(values):,} coordinates"
        )
    return values.reshape(-1, 3)


def piece_cells(piece: Piece, reader: ArrayReader, dataset: str, n_points: int) -> Cells:
    """Cells of a piece.

    Parameters
    ----------
    piece : Piece
        With lists of polygons, with cells and their types, or with an extent.
    reader : ArrayReader
        Of the file.
    dataset : str
        Kind of the data set, in lower case.
    n_points : int
        How many points the piece has.

    Returns
    -------
    Cells
        Corners are not checked.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError
        Arrays that do not fit each other, or polyhedra.
    """
    if dataset in GRIDS:
        return grid_cells(_dimensions(piece), n_points)
    if dataset == "polydata":
        return poly_cells({name: _polygons(piece, reader, tag) for tag, name in LISTS.items()})
    polygons = _polygons(piece, reader, "cells")
    array = piece.arrays.get(("cells", "types"))
    types = np.zeros(0, dtype=np.int64) if array is None else reader.integers(array)
    if (types == POLYHEDRON).any():
        raise UnsupportedFormatError(
            "the VTK file has polyhedra, which are not read; "
            "extract the surface (ParaView: Extract Surface) and upload that"
        )
    if len(polygons.counts) == len(types) + 1 and polygons.counts[0] == 0:
        polygons = Polygons(polygons.counts[1:], polygons.corners)  # offsets with a 0 in front
    if len(polygons.counts) != len(types):
        raise InvalidMeshError(
            f"a piece of the VTK file has {len(polygons.counts):,} cells, "
            f"but {len(types):,} types of cells"
        )
    return Cells(types, polygons)


def _polygons(piece: Piece, reader: ArrayReader, section: str) -> Polygons:
    """Polygons of one section."""
    connectivity, offsets = (
        piece.arrays.get((section, name)) for name in ("connectivity", "offsets")
    )
    if connectivity is None or offsets is None:
        none = np.zeros(0, dtype=np.int64)
        return Polygons(none, none)
    return polygons_by_offsets(reader.integers(offsets), reader.integers(connectivity))


def _dimensions(piece: Piece) -> tuple[int, int, int]:
    """Points along each direction, by a piece's extent."""
    try:
        ends = [int(word[:10]) for word in piece.attributes.get("Extent", "").split()]
        first, last = ends[0:6:2], ends[1:6:2]
        sizes = [max(b - a + 1, 0) for a, b in zip(first, last, strict=True)]
        return sizes[0], sizes[1], sizes[2]
    except (ValueError, IndexError):
        raise InvalidMeshError("a piece of the VTK file has no extent of six numbers") from None


def _encoding(attributes: dict[str, str]) -> Encoding:
    """How numbers are written, by the attributes of the root."""
    header = attributes.get("header_type", "UInt32")
    if header.lower() not in HEADER_TYPES:
        raise InvalidMeshError(f"expected the header_type UInt32, found {quoted(header.encode())}")
    big = attributes.get("byte_order", "").lower() == "bigendian"
    compressor = attributes.get("compressor", "").lower()
    return Encoding(">" if big else "<", HEADER_TYPES[header.lower()], compressor)
