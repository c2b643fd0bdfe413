"""VTK's kinds of data sets: which are read, and why the others are not."""

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.surfaces.cells import POLYGON, STRIP, Cells, join_cells
from workers.geometry.formats.text.tokens import Polygons, quoted

GRIDS = ("structured_grid", "structuredgrid")
READ = ("polydata", "unstructured_grid", "unstructuredgrid", *GRIDS)
IMAGES = (
    *("structured_points", "imagedata", "uniform_grid", "uniformgrid"),
    *("rectilinear_grid", "rectilineargrid", "hypertreegrid"),
)
COLLECTIONS = (
    *("collection", "vtkmultiblockdataset", "vtkhierarchicalboxdataset", "vtkoverlappingamr"),
    *("ppolydata", "punstructuredgrid", "pstructuredgrid", "vtkpartitioneddatasetcollection"),
)
LIST_TYPES = {"vertices": 2, "lines": 4, "polygons": POLYGON, "triangle_strips": STRIP}


def require_read(dataset: str) -> None:
    """Raise where a kind of data set has no surface.

    Parameters
    ----------
    dataset : str
        As the file names it, in lower case.

    Raises
    ------
    InvalidMeshError
        No kind of VTK.
    UnsupportedFormatError
        An image, or a file that only names other files.
    """
    if dataset in READ:
        return
    if dataset in IMAGES:
        raise UnsupportedFormatError(
            f"the VTK file holds an image or a regular grid ({dataset}), not a surface; "
            "extract a surface (ParaView: Contour or Extract Surface) and upload that"
        )
    if dataset in COLLECTIONS:
        raise UnsupportedFormatError(
            f"the VTK file only lists other files ({dataset}); upload the files it lists"
        )
    found = quoted(dataset.encode()) if dataset else "nothing"
    raise InvalidMeshError(
        f"expected a VTK data set such as POLYDATA or UNSTRUCTURED_GRID, found {found}"
    )


def poly_cells(lists: dict[str, Polygons]) -> Cells:
    """Make cells of the four lists of polygonal data.

    Parameters
    ----------
    lists : dict of Polygons
        By "vertices", "lines", "polygons" and "triangle_strips"; others do not count.

    Returns
    -------
    Cells
        One for each.
    """
    parts = [
        Cells(np.full(len(lists[name].counts), cell_type, dtype=np.int64), lists[name])
        for name, cell_type in LIST_TYPES.items()
        if name in lists
    ]
    return join_cells(parts)
