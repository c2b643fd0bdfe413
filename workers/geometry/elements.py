"""What one triangle adds to a mesh's matrices: its cotangents, its area, a third of it a corner.

The functions take corner positions face by face, not a mesh, so that they also serve a surface
which does not fit into space. Corner c of a face lies opposite the edge from corner c + 1 to
corner c + 2.
"""

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray

NEXT = [1, 2, 0]
"""Corner after each corner, in the winding of the face."""

LAST = [2, 0, 1]
"""Corner before each corner."""


def corner_cotangents(
    corners: FloatArray, double_areas: FloatArray, *, in_order: bool = False
) -> FloatArray:
    """Cotangent of the angle at each corner, as dot / |cross|.

    That is exact on needles too, where cos / √(1 - cos²) is some per cent off.

    Parameters
    ----------
    corners : (m, 3, d) float64
        Positions of each face's corners, d >= 2.
    double_areas : (m,) float64
        |cross|: twice the area of each face, as from `double_areas`.
    in_order : bool
        Add x, then y, then z of a dot product, and not in the order of ``einsum``. This decides
        the last bits: the versions of creatures and of spectra stand for one each.

    Returns
    -------
    (m, 3) float64
        Without unit; not finite where the double area is 0.
    """
    to_next = corners[:, NEXT] - corners  # (m, 3, d): from corner c to corner c + 1
    to_last = -to_next[:, LAST]  # (m, 3, d): from corner c to corner c + 2
    if in_order:
        dots = (to_next * to_last).sum(axis=2)  # (m, 3)
    else:
        dots = np.einsum("fcd,fcd->fc", to_next, to_last)
    cotangents: FloatArray = dots / double_areas[:, None]
    return cotangents


def double_areas(corners: FloatArray) -> FloatArray:
    """Twice the area of each face, in any dimension.

    |cross| is the root of the sum of squared 2 × 2 minors. It is taken at the corner between the
    two shorter edges, where a needle or a flat triangle loses least to rounding.

    Parameters
    ----------
    corners : (m, 3, d) float64
        Positions of each face's corners, d >= 2.

    Returns
    -------
    (m,) float64
        In the square of the positions' unit.
    """
    to_next = corners[:, NEXT] - corners  # (m, 3, d)
    to_last = -to_next[:, LAST]  # (m, 3, d)
    opposite = np.einsum("fcd,fcd->fc", to_next, to_next)[:, NEXT]  # (m, 3): squared lengths
    faces = np.arange(len(corners))
    apex = np.argmax(opposite, axis=1)  # (m,)
    u, v = to_next[faces, apex], to_last[faces, apex]  # (m, d)
    squared = np.zeros(len(corners))
    for i in range(corners.shape[2]):
        for j in range(i + 1, corners.shape[2]):
            squared += (u[:, i] * v[:, j] - u[:, j] * v[:, i]) ** 2
    return np.asarray(np.sqrt(squared), dtype=np.float64)


def lumped_areas(faces: IntArray, face_areas: FloatArray, n_vertices: int) -> FloatArray:
    """Area of each vertex: a third of the area of the faces around it, the A of eq. (8).

    Parameters
    ----------
    faces : (m, 3) int64
        Vertex of each corner.
    face_areas : (m,) float64
        Area of each face.
    n_vertices : int
        n.

    Returns
    -------
    (n,) float64
        In the unit of ``face_areas``, whose sum is theirs; 0 at a vertex without a face.
    """
    # added face by face: the order decides the last bits
    thirds = np.repeat(face_areas / 3.0, 3)  # (3m,)
    return np.asarray(np.bincount(faces.ravel(), thirds, minlength=n_vertices), dtype=np.float64)
