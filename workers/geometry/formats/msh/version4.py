"""Nodes and elements of MSH 4, in blocks of an entity."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.msh.elements import (
    elements_by_type,
    nodes_of_types,
    require_types,
)
from workers.geometry.formats.msh.sections import MshFile
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.surfaces.cells import Cells
from workers.geometry.formats.text.tokens import floats, integral


class Numbers:
    """The numbers of a section, one after the other.

    Parameters
    ----------
    file : MshFile
        Says how numbers are written.
    section : bytes
        Behind the line of its name.
    """

    def __init__(self, file: MshFile, section: bytes) -> None:
        self.byte_order = file.byte_order
        self.size = f"u{file.data_size}"
        self.section = section
        self.values = np.zeros(0) if file.byte_order else floats(section)
        self.position = 0

    def integers(self, count: int, type: str = "i4") -> IntArray:
        """Read whole numbers.

        Parameters
        ----------
        count : int
            How many.
        type : str
            numpy's code in a binary file.

        Returns
        -------
        (count,) int64

        Raises
        ------
        InvalidMeshError
            Fewer follow.
        """
        if not self.byte_order:
            return integral(self.floats(count))
        return self._binary(count, type).astype(np.int64)

    def sizes(self, count: int) -> IntArray:
        """Read counts or numbers of nodes, which take more bytes in a binary file.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        (count,) int64

        Raises
        ------
        InvalidMeshError
            Fewer follow.
        """
        return self.integers(count, self.size)

    def floats(self, count: int) -> FloatArray:
        """Read numbers.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        (count,) float64

        Raises
        ------
        InvalidMeshError
            Fewer follow.
        """
        if self.byte_order:
            return as_floats(self._binary(count, "f8"))
        self._require(count, len(self.values) - self.position)
        self.position += count
        return self.values[self.position - count : self.position]

    def rows(self, count: int, n_floats: int) -> tuple[IntArray, FloatArray]:
        """Read rows of a number and floats.

        Parameters
        ----------
        count, n_floats : int
            How many rows, and how many floats each.

        Returns
        -------
        numbers : (count,) int64
            In front of the floats.
        table : (count, n_floats) float64

        Raises
        ------
        InvalidMeshError
            Fewer follow.
        """
        if not self.byte_order:
            table = self.floats(count * (1 + n_floats)).reshape(count, 1 + n_floats)
            return integral(table[:, 0]), table[:, 1:]
        order = self.byte_order
        type = np.dtype([("tag", f"{order}i4"), ("floats", f"{order}f8", (n_floats,))])
        self._require(count * type.itemsize, len(self.section) - self.position)
        rows = np.frombuffer(self.section, type, count, self.position)
        self.position += rows.nbytes
        return rows["tag"].astype(np.int64), as_floats(rows["floats"])

    def _binary(self, count: int, type: str) -> "np.ndarray[tuple[int], np.dtype[np.generic]]":
        """Numbers as they are in the file."""
        self._require(count * int(type[1]), len(self.section) - self.position)
        values = np.frombuffer(self.section, self.byte_order + type, count, self.position)
        self.position += values.nbytes
        return values

    def _require(self, needed: int, left: int) -> None:
        """Raise where fewer follow."""
        if not 0 <= needed <= left:
            raise InvalidMeshError(
                f"a block of the MSH file needs {needed:,} numbers or bytes, "
                f"but {left:,} follow: it is truncated or damaged"
            )


@dataclass(frozen=True)
class _Block:
    """The head of a block: two or three numbers, and how many rows follow."""

    first: int
    second: int
    third: int
    count: int


def read_nodes(
    file: MshFile, section: bytes, limits: MeshLimits, repairs: list[str]
) -> tuple[IntArray, FloatArray]:
    """Read numbers and positions of nodes.

    Parameters
    ----------
    file : MshFile
        Says how numbers are written.
    section : bytes
        Blocks of nodes.
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
    numbers = Numbers(file, section)
    tags, tables = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    n_blocks, declared = _head(numbers, file.version)
    n_nodes = 0
    for _ in range(n_blocks):
        block = _block(numbers)
        n_nodes += block.count
        limits.check(vertices=n_nodes)
        if block.count == 0:
            continue
        # Nodes may have coordinates on their curve or surface behind their position.
        dimension = block.first if file.version == "4.1" else block.second
        width = 3 + (min(max(dimension, 0), 3) if block.third else 0)
        if file.version == "4.1":
            own = numbers.sizes(block.count)
            table = numbers.floats(width * block.count).reshape(-1, width)
        else:
            own, table = numbers.rows(block.count, width)
        tags.append(own)
        tables.append(table[:, :3])
    if n_nodes != declared:
        repairs.append(f"the file declares {declared:,} nodes, but has {n_nodes:,}")
    return np.concatenate(tags), np.concatenate(tables)


def read_elements(file: MshFile, section: bytes, repairs: list[str]) -> list[Cells]:
    """Read elements by blocks of one type.

    Parameters
    ----------
    file : MshFile
        Says how numbers are written.
    section : bytes
        Blocks of elements.
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
    numbers = Numbers(file, section)
    cells: list[Cells] = []
    n_blocks, declared = _head(numbers, file.version)
    n_elements = 0
    for _ in range(n_blocks):
        block = _block(numbers)
        if block.count == 0:
            continue
        n_elements += block.count
        kind = np.array([block.third])
        require_types(kind)
        width = 1 + int(nodes_of_types(kind)[0])
        type = numbers.size if file.version == "4.1" else "i4"
        values = numbers.integers(block.count * width, type)
        first = np.arange(block.count) * width + 1
        cells += elements_by_type(values, np.repeat(kind, block.count), first)
    if n_elements != declared:
        repairs.append(f"the file declares {declared:,} elements, but has {n_elements:,}")
    return cells


def _head(numbers: Numbers, version: str) -> tuple[int, int]:
    """How many blocks and how many rows in all a section declares."""
    n_blocks, declared = numbers.sizes(2).tolist()
    if version == "4.1":
        numbers.sizes(2)  # the lowest and the highest number
    if n_blocks < 0 or declared < 0:
        raise InvalidMeshError("the MSH file declares a count below 0")
    return n_blocks, declared


def _block(numbers: Numbers) -> _Block:
    """Head of the next block."""
    first, second, third = numbers.integers(3).tolist()
    count = int(numbers.sizes(1)[0])
    if count < 0:
        raise InvalidMeshError(f"a block of the MSH file declares {count} rows")
    return _Block(first, second, third, count)
