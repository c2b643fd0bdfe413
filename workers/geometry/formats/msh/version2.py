"""Nodes and elements of MSH 1 and 2."""

import re

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits, check_length
from workers.geometry.formats.msh.elements import elements_by_type, nodes_of_types, require_types
from workers.geometry.formats.msh.sections import MshFile
from workers.geometry.formats.rows.records import as_floats, record_starts
from workers.geometry.formats.surfaces.cells import Cells
from workers.geometry.formats.text.tokens import floats, integers, integral, places_in_runs

COUNT = re.compile(rb"\s*(\d{1,15})[ \t]*\r?\n?")
SHORTEST_NODE, SHORTEST_ELEMENT = len(b"1 0 0 0\n"), len(b"1 15 0 1\n")


def count_of(section: bytes, noun: str) -> tuple[int, bytes]:
    """Read the count in front of a section.

    Parameters
    ----------
    section : bytes
        Begins with the count, on a line of its own.
    noun : str
        What is counted, for the message.

    Returns
    -------
    count : int
        As declared.
    rest : bytes
        What follows.

    Raises
    ------
    InvalidMeshError
        There is no count.
    """
    found = COUNT.match(section)
    if found is None:
        raise InvalidMeshError(f"expected the number of {noun} in the MSH file")
    return int(found[1]), section[found.end() :]


def read_nodes(
    file: MshFile, section: bytes, limits: MeshLimits, repairs: list[str]
) -> tuple[IntArray, FloatArray]:
    """Read numbers and positions of nodes.

    Parameters
    ----------
    file : MshFile
        Says how numbers are written.
    section : bytes
        A count and a row ``number x y z`` a node.
    limits : MeshLimits
        Most vertices that are accepted.
    repairs : list of str
        A wrong count is added here.

    Returns
    -------
    tags : (n,) int64
        Numbers of the nodes.
    vertices : (n, 3) float64
        Positions.

    Raises
    ------
    InvalidMeshError, UploadTooLargeError
        Truncated, damaged, or over the limits.
    """
    declared, rest = count_of(section, "nodes")
    limits.check(vertices=declared)
    if not file.byte_order:
        check_length(declared * SHORTEST_NODE - 1, len(rest) + 1, vertices=declared, faces=0)
        values = floats(rest)
        n_nodes, over = divmod(len(values), 4)
        if over or (n_nodes < declared and "Nodes" in file.unended):
            raise InvalidMeshError(
                f"the MSH file declares {declared:,} nodes, but has {len(values):,} numbers "
                "for them: it is truncated"
            )
        if n_nodes != declared:
            repairs.append(f"the file declares {declared:,} nodes, but has {n_nodes:,}")
        table = values.reshape(-1, 4)
        return integral(table[:, 0]), table[:, 1:]
    real = f"{file.byte_order}f{file.data_size}"
    rows = np.dtype([("tag", f"{file.byte_order}i4"), ("position", real, (3,))])
    check_length(declared * rows.itemsize, len(rest), vertices=declared, faces=0)
    nodes = np.frombuffer(rest, rows, declared)
    return nodes["tag"].astype(np.int64), as_floats(nodes["position"])


def read_elements(file: MshFile, section: bytes, repairs: list[str]) -> list[Cells]:
    """Read elements; their tags are left out.

    Parameters
    ----------
    file : MshFile
        Says how numbers are written.
    section : bytes
        A count and a row an element, in a binary file in blocks of a type.
    repairs : list of str
        A wrong count is added here.

    Returns
    -------
    list of Cells
        Corners are node numbers.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError
        Truncated, damaged, or of an unknown type.
    """
    declared, rest = count_of(section, "elements")
    if file.byte_order:
        values = np.frombuffer(rest, f"{file.byte_order}i4", len(rest) // 4).astype(np.int64)
        types, first = _binary_elements(values, declared)
    else:
        values = integers(rest)
        types, first = _text_elements(values, file.version)
    if len(types) < declared and file.unended:
        raise InvalidMeshError(
            f"the MSH file declares {declared:,} elements, but ends after {len(types):,}: "
            "it is truncated"
        )
    if len(types) != declared:
        repairs.append(f"the file declares {declared:,} elements, but has {len(types):,}")
    return elements_by_type(values, types, first)


def _text_elements(values: IntArray, version: str) -> tuple[IntArray, IntArray]:
    """Types of elements, and where the first node of each stands."""
    padded = np.concatenate([values, np.zeros(5, dtype=np.int64)])
    n = len(values)
    most = n + 1  # a longer element is cut short anyway, and must not overflow
    if version == "1":  # number, type, physical, elementary, count, nodes
        starts, end = record_starts(5 + np.minimum(padded[4 : n + 4], most), n)
        before = np.full(len(starts), 5)
    else:  # number, type, count of tags, tags, nodes
        n_tags = np.minimum(padded[2 : n + 2], most)
        starts, end = record_starts(3 + n_tags + nodes_of_types(padded[1 : n + 1]), n)
        before = 3 + n_tags[starts]
    types = padded[starts + 1]
    require_types(types)
    wrong = (before < 3) | ((version == "1") & (padded[starts + 4] != nodes_of_types(types)))
    if wrong.any() or end > n:
        bad = int(np.argmax(wrong)) if wrong.any() else len(starts) - 1
        raise InvalidMeshError(
            f"element {bad} of the MSH file has too few or too many numbers: it is damaged"
        )
    return types, starts + before


def _binary_elements(values: IntArray, declared: int) -> tuple[IntArray, IntArray]:
    """Types of elements in blocks ``type, count, count of tags``, and where the nodes stand."""
    n = len(values)
    padded = np.concatenate([values, np.zeros(3, dtype=np.int64)])
    rows, n_tags = padded[1 : n + 1], np.clip(padded[2 : n + 2], 0, n)
    widths = 1 + n_tags + nodes_of_types(padded[:n])
    starts, _ = record_starts(3 + np.clip(rows, 0, n) * widths, n)
    starts = starts[np.cumsum(rows[starts]) - rows[starts] < declared]  # no bytes behind the last
    types, counts = values[starts], rows[starts]
    require_types(types)
    if (counts < 0).any() or (starts[-1:] + 3 + counts[-1:] * widths[starts[-1:]] > n).any():
        raise InvalidMeshError("the MSH file ends within its elements: it is truncated or damaged")
    row = np.repeat(starts + 3, counts) + places_in_runs(counts) * np.repeat(widths[starts], counts)
    return np.repeat(types, counts), row + 1 + np.repeat(n_tags[starts], counts)
