"""Gmsh's types of elements, and elements by the numbers of their nodes."""

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import BoolArray, IntArray
from workers.geometry.formats.surfaces.cells import (
    HEXAHEDRON,
    PYRAMID,
    QUAD,
    TETRAHEDRON,
    TRIANGLE,
    WEDGE,
    Cells,
    cells_of_one_type,
)

LINE, POINT = 3, 1
NODES = {
    LINE: {1: 2, 8: 3, 26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    TRIANGLE: {
        **{2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21},
        **{42: 28, 43: 36, 44: 45, 45: 55, 46: 66},
    },
    QUAD: {
        **{3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20},
        **{47: 49, 48: 64, 49: 81, 50: 100, 51: 121},
    },
    TETRAHEDRON: {
        **{4: 4, 11: 10, 29: 20, 30: 35, 31: 56, 32: 22, 33: 28},
        **{71: 84, 72: 120, 73: 165, 74: 220, 75: 286},
    },
    HEXAHEDRON: {
        5: 8,
        12: 27,
        17: 20,
        92: 64,
        93: 125,
        94: 216,
        95: 343,
        96: 512,
        97: 729,
        98: 1000,
    },
    WEDGE: {6: 6, 13: 18, 18: 15, 90: 40, 91: 75, 106: 126, 107: 196, 108: 288, 109: 405, 110: 550},
    PYRAMID: {7: 5, 14: 14, 19: 13, 118: 30, 119: 55, 120: 91, 121: 140, 122: 204},
    POINT: {15: 1},
}
"""How many nodes an element of each of Gmsh's types has, by VTK's number of the plain type."""

CORNERS = {
    **{POINT: 1, LINE: 2, TRIANGLE: 3, QUAD: 4, TETRAHEDRON: 4},
    **{HEXAHEDRON: 8, WEDGE: 6, PYRAMID: 5},
}
PLAIN = {gmsh: plain for plain, types in NODES.items() for gmsh in types}
N_NODES = np.zeros(128, dtype=np.int64)
"""By Gmsh's type; 0 for one that is not known."""

for _types in NODES.values():
    for _type, _count in _types.items():
        N_NODES[_type] = _count
N_NODES.flags.writeable = False


def nodes_of_types(types: IntArray) -> IntArray:
    """How many nodes elements have.

    Parameters
    ----------
    types : (n,) int64
        Gmsh's types, or anything else.

    Returns
    -------
    (n,) int64
        0 where there is no such type.
    """
    return np.where((types >= 0) & (types < len(N_NODES)), N_NODES[types % len(N_NODES)], 0)


def require_types(types: IntArray) -> None:
    """Raise for a type of element that is not known.

    Parameters
    ----------
    types : (n,) int64
        Gmsh's types.

    Raises
    ------
    UnsupportedFormatError
        One of them has no row in `NODES`.
    """
    unknown = types[nodes_of_types(types) == 0]
    if len(unknown):
        raise UnsupportedFormatError(
            f"the MSH file has elements of Gmsh's type {unknown[0]}, which is not read; "
            "export the surface as STL or PLY from Gmsh"
        )


def elements_by_type(values: IntArray, types: IntArray, first: IntArray) -> list[Cells]:
    """Make cells of elements in one run of numbers.

    Parameters
    ----------
    values : (n,) int64
        With the nodes of each element side by side.
    types : (e,) int64
        Gmsh's types, all known.
    first : (e,) int64
        Where the first node of each element stands.

    Returns
    -------
    list of Cells
        Of plain types; corners are node numbers. Inner nodes of higher orders are left out.

    Raises
    ------
    InvalidMeshError
        An element that ends after the numbers.
    """
    if len(first) and (first + nodes_of_types(types)).max() > len(values):
        raise InvalidMeshError("the MSH file ends within an element: it is truncated")
    cells = []
    for gmsh in np.unique(types).tolist():
        plain = PLAIN[gmsh]
        rows = first[types == gmsh]
        cells.append(cells_of_one_type(plain, values[rows[:, None] + np.arange(CORNERS[plain])]))
    return cells


def node_indices(tags: IntArray, wanted: IntArray) -> IntArray:
    """Find nodes by their numbers.

    Parameters
    ----------
    tags : (n,) int64
        Number of each node, in any order and with gaps.
    wanted : (c,) int64
        Numbers of nodes.

    Returns
    -------
    (c,) int64
        Places among the tags.

    Raises
    ------
    InvalidMeshError
        There is no such node.
    """
    lowest = int(tags.min()) if len(tags) else 0
    span = int(tags.max()) - lowest + 1 if len(tags) else 0
    if span <= 4 * len(tags):  # a table is faster, unless the numbers lie far apart
        table = np.full(span + 1, -1, dtype=np.int64)  # the last is that of any other number
        table[tags[::-1] - lowest] = np.arange(len(tags))[::-1]
        inside = (wanted >= lowest) & (wanted < lowest + span)
        found = table[np.where(inside, wanted - lowest, span)]
        _require_nodes(found >= 0, wanted)
        return found
    order = np.argsort(tags, kind="stable")
    ordered = tags[order]
    places = np.minimum(np.searchsorted(ordered, wanted), len(tags) - 1)
    _require_nodes(ordered[places] == wanted, wanted)
    return order[places]


def _require_nodes(known: BoolArray, wanted: IntArray) -> None:
    """Raise for a node that there is not."""
    if not known.all():
        raise InvalidMeshError(
            f"an element refers to node {wanted[np.argmin(known)]}, which the file does not have"
        )
