"""Rows of numbers and lists one after the other, as PLY and binary OFF have them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import IntArray
from workers.geometry.formats.rows.records import as_floats
from workers.geometry.formats.text.tokens import Polygons, integral, places_in_runs

Buffer = bytes | memoryview


@dataclass(frozen=True)
class Property:
    """One property; ``length_type`` is None for a scalar. Types are numpy codes such as "f4"."""

    name: str
    type: str
    length_type: str | None = None

    @property
    def size(self) -> int:
        """Bytes of a number, or of one number of the list."""
        return int(self.type[1])

    @property
    def fixed_size(self) -> int:
        """Bytes of the number, or of the list's length."""
        return int((self.length_type or self.type)[1])


@dataclass(frozen=True)
class Element:
    """So many rows of these properties."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def shortest_row(self) -> int:
        """Bytes a row takes at least (all lists empty)."""
        return sum(p.fixed_size for p in self.properties)

    @property
    def has_lists(self) -> bool:
        """Whether rows may differ in length."""
        return any(p.length_type for p in self.properties)


@dataclass(frozen=True, eq=False)
class Rows:
    """Where the rows of an element lie.

    Attributes
    ----------
    data : bytes or memoryview
        The whole file.
    byte_order : str
        "<" or ">".
    element : Element
        What a row holds, and how many there are.
    starts : (count,) int64
        Where each row begins, in bytes. Only the first where the rows are alike.
    end : int
        Where the last row ends, in bytes.
    lengths : tuple of int or None
        Of the properties' lists (0 for a scalar), where the rows are alike.
    """

    data: Buffer
    byte_order: str
    element: Element
    starts: IntArray
    end: int
    lengths: tuple[int, ...] | None = None

    def numbers(self, place: int) -> NDArray[Any]:
        """Return one number of each row.

        Parameters
        ----------
        place : int
            Which of the properties; it is no list.

        Returns
        -------
        (count,) array
            Of the property's type.
        """
        prop = self.element.properties[place]
        if self.lengths is not None:
            return self._table(place, 0, prop.type, 1)[:, 0]
        return gather(self.data, self._cursors(place), self.byte_order + prop.type)

    def lists(self, place: int) -> Polygons:
        """Return one list of each row, as polygons.

        Parameters
        ----------
        place : int
            Which of the properties; it is a list.

        Returns
        -------
        Polygons
            One for each row.

        Raises
        ------
        InvalidMeshError
            A value is no integer.
        """
        prop = self.element.properties[place]
        if self.lengths is not None:
            length = self.lengths[place]
            values = self._table(place, prop.fixed_size, prop.type, length)
            counts = np.full(self.element.count, length, dtype=np.int64)
            return Polygons(counts, as_integers(values))
        cursors = self._cursors(place)
        counts = list_lengths(self.data, cursors, self.byte_order, prop)
        begin = np.repeat(cursors + prop.fixed_size, counts) + prop.size * places_in_runs(counts)
        return Polygons(counts, as_integers(gather(self.data, begin, self.byte_order + prop.type)))

    def lengths_of(self, place: int) -> NDArray[Any]:
        """Return the length of one list of each row, where the rows are alike.

        Parameters
        ----------
        place : int
            Which of the properties; it is a list.

        Returns
        -------
        (count,) array
            Of the lengths' type.
        """
        return self._table(place, 0, self.element.properties[place].length_type or "u1", 1)[:, 0]

    def _table(self, place: int, skip: int, type: str, width: int) -> NDArray[Any]:
        """Numbers (count, width) that stand at the same place of rows that are alike."""
        count, offset = self.element.count, self._offset(place) + skip
        if count == 0 or width == 0:
            return np.zeros((count, width), dtype=type)
        strides = (self._offset(len(self.element.properties)), int(type[1]))
        begin = int(self.starts[0]) + offset
        return np.ndarray((count, width), self.byte_order + type, self.data, begin, strides)

    def _offset(self, place: int) -> int:
        """Bytes from the start of a row to a property, where the rows are alike."""
        before = zip(self.element.properties[:place], self.lengths or (), strict=False)
        return sum(p.fixed_size + length * p.size for p, length in before)

    def _cursors(self, place: int) -> IntArray:
        """Where the property begins in each row (count,), in bytes."""
        cursors = self.starts
        for prop in self.element.properties[:place]:
            after = cursors + prop.fixed_size
            if prop.length_type:
                after += prop.size * list_lengths(self.data, cursors, self.byte_order, prop)
            cursors = after
        return cursors


def gather(data: Buffer, offsets: IntArray, type: str) -> NDArray[Any]:
    """Read numbers that lie anywhere in a file.

    Parameters
    ----------
    data : bytes or memoryview
        The whole file.
    offsets : (n,) int64
        Where each number begins, in bytes; all of it lies in the file.
    type : str
        Byte order and type, such as "<f4".

    Returns
    -------
    (n,) array
        The numbers.
    """
    size = int(type[2])
    if size == 1 or not (offsets % size).any():
        return np.frombuffer(data, type, count=len(data) // size)[offsets // size]
    every_byte = np.frombuffer(data, dtype=np.uint8)
    picked = np.empty((len(offsets), size), dtype=np.uint8)
    for i in range(size):
        picked[:, i] = every_byte[offsets + i]
    return picked.reshape(-1).view(type)


def as_integers(values: NDArray[Any]) -> IntArray:
    """Turn numbers of any type into integers.

    Parameters
    ----------
    values : array of n
        Integers, or floats that are whole numbers.

    Returns
    -------
    (n,) int64
        The same numbers, row by row; a copy.

    Raises
    ------
    InvalidMeshError
        One is no integer.
    """
    if values.dtype.kind == "f":
        return integral(as_floats(values.ravel()))
    return values.astype(np.int64, order="C").ravel()


def list_lengths(data: Buffer, cursors: IntArray, byte_order: str, prop: Property) -> IntArray:
    """Read the lengths of a list.

    Parameters
    ----------
    data : bytes or memoryview
        The whole file.
    cursors : (n,) int64
        Where each length stands, in bytes.
    byte_order : str
        "<" or ">".
    prop : Property
        The list.

    Returns
    -------
    (n,) int64
        The lengths; none was compared with anything yet.

    Raises
    ------
    InvalidMeshError
        One is no integer.
    """
    return as_integers(gather(data, cursors, f"{byte_order}{prop.length_type}"))
