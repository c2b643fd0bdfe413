"""Structured grids: cells between the points of a table."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.formats.surfaces.cells import HEXAHEDRON, QUAD, Cells, cells_of_one_type


def grid_cells(dimensions: tuple[int, int, int], n_points: int) -> Cells:
    """Quads of a grid that is one point thick, hexahedra of another.

    Parameters
    ----------
    dimensions : (3,) int
        Points along each direction; the first runs fastest.
    n_points : int
        How many points there are.

    Returns
    -------
    Cells
        One between each four or eight neighbours.

    Raises
    ------
    InvalidMeshError
        The points are not as many as the grid has, or lie in one row.
    """
    product = dimensions[0] * dimensions[1] * dimensions[2]
    if product != n_points:
        sizes = " × ".join(f"{size:,}" for size in dimensions)
        raise InvalidMeshError(f"the grid has {sizes} points, but the file has {n_points:,}")
    wide = [axis for axis in range(3) if dimensions[axis] > 1]
    if len(wide) < 2:
        raise InvalidMeshError("the points of the grid lie in one row; expected a surface")
    numbers = np.arange(n_points).reshape(dimensions, order="F")
    flat = np.squeeze(numbers)
    if flat.ndim == 2:
        quads = [flat[:-1, :-1], flat[1:, :-1], flat[1:, 1:], flat[:-1, 1:]]
        return cells_of_one_type(QUAD, np.stack([part.ravel() for part in quads], axis=1))
    ends = {0: slice(None, -1), 1: slice(1, None)}
    corners = [
        flat[ends[i], ends[j], ends[k]].ravel()
        for k in (0, 1)
        for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    return cells_of_one_type(HEXAHEDRON, np.stack(corners, axis=1))
