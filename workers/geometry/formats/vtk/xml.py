"""VTK's XML files of polygonal data (VTP), cells (VTU) and structured grids (VTS)."""

import re

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.cells import Cells, join_cells, surface_of_cells
from workers.geometry.formats.surfaces.polygons import require_indices
from workers.geometry.formats.text.tokens import Polygons
from workers.geometry.formats.unpacking.encoded import Allowance
from workers.geometry.formats.vtk.arrays import Appended, ArrayReader
from workers.geometry.formats.vtk.datasets import require_read
from workers.geometry.formats.vtk.pieces import Pieces, piece_cells, piece_points
from workers.geometry.formats.xml.stream import read_xml

ROOT = re.compile(rb"<VTKFile\b")
LOOKED_AT = 4096  # bytes
APPENDED = re.compile(rb"<AppendedData\b[^>]*>\s*_?")


def is_vtk_xml(data: bytes) -> bool:
    """Whether the root element is VTK's.

    Parameters
    ----------
    data : bytes
        The beginning of a file.

    Returns
    -------
    bool
        True for every kind of VTK's XML files, also those that are not read.
    """
    head = data[:LOOKED_AT].lstrip()
    return head.startswith(b"<") and ROOT.search(head) is not None


def read_vtk_xml(data: bytes, limits: MeshLimits) -> Reading:
    """Read a file in one of VTK's XML formats.

    Parameters
    ----------
    data : bytes
        The whole file.
    limits : MeshLimits
        Most vertices and faces, and most bytes that are unpacked.

    Returns
    -------
    Reading
        All points of all pieces, polygons and strips cut, the boundary of volume cells.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    xml, content, is_base64 = _without_appended(data)
    pieces = Pieces()
    read_xml(xml, pieces, "VTK")
    require_read(pieces.dataset)
    appended = Appended(content, is_base64, tuple(sorted(pieces.offsets)))
    reader = ArrayReader(pieces.encoding, appended, Allowance(limits.unpacked))
    points: list[FloatArray] = [np.zeros((0, 3))]
    cells: list[Cells] = []
    n_points = 0
    for piece in pieces.pieces:
        own = piece_points(piece, reader)
        limits.check(vertices=n_points + len(own))
        part = piece_cells(piece, reader, pieces.dataset, len(own))
        corners = part.corners.corners
        faces_of_corners = np.repeat(np.arange(len(part.types)), part.corners.counts)
        require_indices(corners, faces_of_corners, len(own))
        cells.append(Cells(part.types, Polygons(part.corners.counts, corners + n_points)))
        points.append(own)
        n_points += len(own)
    surface = surface_of_cells(np.concatenate(points), join_cells(cells), limits)
    n_pieces = (f"{len(pieces.pieces):,} pieces",) if len(pieces.pieces) > 1 else ()
    return Reading(surface.mesh, (), (*surface.found, *n_pieces, *sorted(pieces.found)))


def _without_appended(data: bytes) -> tuple[bytes, memoryview, bool]:
    """Cut the appended section off: raw bytes are no XML."""
    found = APPENDED.search(data)
    if found is None:
        return data, memoryview(b""), False
    is_base64 = b"raw" not in found[0].lower()
    end = data.rfind(b"</AppendedData")
    content = memoryview(data)[found.end() : end if end >= found.end() else len(data)]
    return data[: found.start()] + b"</VTKFile>", content, is_base64
