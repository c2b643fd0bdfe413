"""What a few broken coordinates make of a mesh: faces without a place, or absurdly far away."""

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray

MOST_STRAYS = 0.1  # of the faces; what breaks more of a file is no accident of a few numbers
USUAL = 0.9  # of the vertices are certainly part of the shape
GAP = 1e4  # times as far from the middle as the vertex before: no shape has such a hole


def without_strays(
    vertices: FloatArray, faces: IntArray
) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Leave out faces with corners that are not finite or absurdly far from all others.

    Far means: sorted by their distance from the median, the vertices are at most one tenth of all
    and come after a gap of a factor of 10,000. Two bodies a thousand sizes apart stay, also if one
    has few vertices. No limit on areas would do: one corner at 1e9 makes a face that outweighs the
    whole shape, and a far face of ordinary size weighs next to nothing.

    Parameters
    ----------
    vertices : (n, 3) float64
        Each with a face; perhaps NaN or infinite.
    faces : (m, 3) int64
        At least one; indices in range.

    Returns
    -------
    vertices, faces : arrays
        Those given if nothing is left out, else those that stay, in their order.
    repairs : tuple of str
        What was left out and its share, in sentences for people.

    Raises
    ------
    InvalidMeshError
        More than a tenth of the faces have corners that are not finite.
    """
    repairs: list[str] = []
    finite = np.isfinite(vertices)  # (n, 3)
    if not finite.all():
        strange: BoolArray = np.asarray(~finite.all(axis=1))  # (n,)
        hanging = _faces_at(strange, faces)
        _require_few(hanging, vertices, faces)
        repairs.append(f"left out {_share(hanging)} at vertices that are not finite")
        vertices, faces = without_unreferenced(vertices, faces[~hanging])
    far = _far_vertices(vertices)
    if far.any():
        hanging = _faces_at(far, faces)
        if hanging.sum() <= MOST_STRAYS * len(faces):
            repairs.append(f"left out {_share(hanging)} {GAP:,.0f} times as far away as the rest")
            vertices, faces = without_unreferenced(vertices, faces[~hanging])
    return vertices, faces, tuple(repairs)


def without_unreferenced(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Leave out vertices that no face has.

    Parameters
    ----------
    vertices : (n, 3) float64
        Anything.
    faces : (m, 3) int64
        Indices in range.

    Returns
    -------
    vertices, faces : arrays
        Vertices that have a face, in their order, and the faces renumbered.
    """
    referenced = np.zeros(len(vertices), dtype=np.bool_)
    referenced[faces.ravel()] = True
    if referenced.all():
        return vertices, faces
    new_index = np.cumsum(referenced) - 1  # (n,)
    return vertices[referenced], new_index[faces]


def _faces_at(chosen: BoolArray, faces: IntArray) -> BoolArray:
    """Which faces (m,) have a corner among the chosen vertices (n,)."""
    at: BoolArray = np.asarray(chosen[faces].any(axis=1))
    return at


def _share(chosen: BoolArray) -> str:
    """Number and share of the chosen faces, in words."""
    count = int(chosen.sum())
    share = 100.0 * count / len(chosen)
    return f"{count:,} {'face' if count == 1 else 'faces'} ({share:.2g} % of all)"


def _require_few(hanging: BoolArray, vertices: FloatArray, faces: IntArray) -> None:
    """Raise ``InvalidMeshError`` if too many faces hang on vertices that are not finite."""
    if hanging.sum() <= MOST_STRAYS * len(faces):
        return
    face = int(np.flatnonzero(hanging)[0])
    corners = vertices[faces[face]]  # (3, 3)
    raise InvalidMeshError(
        f"{hanging.sum():,} of {len(faces):,} faces have corners that are not finite: face {face} "
        f"has the coordinate {corners[~np.isfinite(corners)][0]}; expected finite numbers"
    )


def _far_vertices(vertices: FloatArray) -> BoolArray:
    """Which vertices (n,) lie beyond the first gap behind the nearest nine tenths of them."""
    none = np.zeros(len(vertices), dtype=np.bool_)
    if len(vertices) == 0:
        return none
    with np.errstate(over="ignore"):  # the largest coordinate along an axis: no square overflows
        distances = np.zeros(len(vertices))  # (n,)
        for axis in range(3):
            along = vertices[:, axis].copy()
            along -= np.median(along)
            np.maximum(distances, np.abs(along, out=along), out=distances)
    usual = int(np.ceil(USUAL * len(vertices))) - 1
    reach = np.partition(distances, usual)[usual]
    if reach == 0.0 or distances.max() <= GAP * reach:
        return none
    ascending = np.sort(distances[distances >= reach])
    gaps = np.flatnonzero(ascending[1:] > GAP * ascending[:-1])
    if len(gaps) == 0:
        return none
    far: BoolArray = distances > ascending[gaps[0]]
    return far
