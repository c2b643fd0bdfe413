"""Rows of a binary PLY file, read with numpy where their lists are equally long."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError
from workers.geometry.arrays import IntArray
from workers.geometry.formats.ply.header import Element, Property
from workers.geometry.formats.tokens import Polygons, integral, places_in_runs


def binary_rows(
    data: bytes, position: int, element: Element, byte_order: str
) -> tuple[NDArray[Any], int]:
    """Read all rows of a binary element whose lists, if any, are equally long.

    Parameters
    ----------
    data : bytes
        The whole file.
    position : int
        Where the first row begins, in bytes.
    element : Element
        What a row holds, and how many there are.
    byte_order : str
        "<" or ">".

    Returns
    -------
    rows : (count,) structured array
        A field for each property, by its name.
    end : int
        Where the next element begins, in bytes.

    Raises
    ------
    InvalidMeshError
        Rows that end after the file, lists of unequal lengths, or two properties of one name.
    """
    if any(p.length_type for p in element.properties):
        equal = _equal_rows(data, position, element, byte_order)
        if equal is None:
            raise InvalidMeshError(f"PLY's {element.name} rows have lists of unequal lengths")
        return equal, position + equal.nbytes
    fields = [(f"{i}" if p.name == "" else p.name, byte_order + p.type) for i, p in _named(element)]
    dtype = np.dtype(fields)
    _require(data, position + element.count * dtype.itemsize, element)
    rows = np.frombuffer(data, dtype=dtype, count=element.count, offset=position)
    return rows, position + rows.nbytes


def binary_list(
    data: bytes, position: int, element: Element, wanted: Property, byte_order: str
) -> tuple[Polygons, int]:
    """Read one list property of all rows as polygons.

    Parameters
    ----------
    data : bytes
        The whole file.
    position : int
        Where the first row begins, in bytes.
    element : Element
        What a row holds, and how many there are.
    wanted : Property
        The list to read, one of the element's properties.
    byte_order : str
        "<" or ">".

    Returns
    -------
    polygons : Polygons
        One for each row.
    end : int
        Where the next element begins, in bytes.

    Raises
    ------
    InvalidMeshError
        Rows that end after the file, or a value that is no index.
    """
    rows = _equal_rows(data, position, element, byte_order)
    if rows is not None:
        values = rows[wanted.name]  # (count, length)
        counts = np.full(len(rows), values.shape[1], dtype=np.int64)
        return Polygons(counts, _as_integers(values.ravel())), position + rows.nbytes
    starts, counts, end = _walk(data, position, element, wanted, byte_order)
    size = int(wanted.type[1])
    begin = np.repeat(starts, counts) + size * places_in_runs(counts)  # (corners,), in bytes
    every_byte = np.frombuffer(data, dtype=np.uint8)
    picked = np.empty((len(begin), size), dtype=np.uint8)
    for i in range(size):
        picked[:, i] = every_byte[begin + i]
    return Polygons(counts, _as_integers(picked.ravel().view(byte_order + wanted.type))), end


def skip_rows(data: bytes, position: int, element: Element, byte_order: str) -> int:
    """Find where the element after this one begins.

    Parameters
    ----------
    data : bytes
        The whole file.
    position : int
        Where the first row begins, in bytes.
    element : Element
        What a row holds, and how many there are.
    byte_order : str
        "<" or ">".

    Returns
    -------
    int
        In bytes from the start of the file.

    Raises
    ------
    InvalidMeshError
        Rows that end after the file.
    """
    if not any(p.length_type for p in element.properties):
        return position + element.count * element.shortest_row
    rows = _equal_rows(data, position, element, byte_order)
    if rows is not None:
        return position + rows.nbytes
    return _walk(data, position, element, None, byte_order)[2]


def _named(element: Element) -> list[tuple[int, Property]]:
    """Properties with their numbers; the names must differ."""
    names = [p.name for p in element.properties]
    if len(set(names)) < len(names):
        raise InvalidMeshError(f"PLY's element {element.name} has two properties of one name")
    return list(enumerate(element.properties))


def _require(data: bytes, end: int, element: Element) -> None:
    """Raise ``InvalidMeshError`` if the element's rows end after the file."""
    if end > len(data):
        raise InvalidMeshError(
            f"PLY's {element.count:,} rows of '{element.name[:24]}' need {end:,} bytes of file, "
            f"but it has {len(data):,}: it is truncated"
        )


def _length(data: bytes, position: int, prop: Property, byte_order: str, element: Element) -> int:
    """Read the length of one list."""
    kind = prop.length_type or "u1"
    end = position + int(kind[1])
    _require(data, end, element)
    order = "big" if byte_order == ">" else "little"
    length = int.from_bytes(data[position:end], order, signed=kind[0] == "i")  # type: ignore[arg-type]
    if length < 0:
        raise InvalidMeshError(f"a list of PLY's '{element.name[:24]}' rows has length {length}")
    return length


def _equal_rows(
    data: bytes, position: int, element: Element, byte_order: str
) -> NDArray[Any] | None:
    """All rows as a structured array if their lists are as long as those of the first row."""
    if element.count == 0:
        return None
    fields: list[tuple[Any, ...]] = []
    offset = position
    for number, prop in _named(element):
        if prop.length_type:
            length = _length(data, offset, prop, byte_order, element)
            offset += int(prop.length_type[1]) + length * int(prop.type[1])
            _require(data, offset, element)
            fields.append((f"length of {number}", byte_order + prop.length_type))
            fields.append((prop.name, byte_order + prop.type, (length,)))
        else:
            offset += int(prop.type[1])
            fields.append((prop.name, byte_order + prop.type))
    dtype = np.dtype(fields)
    if position + element.count * dtype.itemsize > len(data):
        return None
    rows = np.frombuffer(data, dtype=dtype, count=element.count, offset=position)
    for number, prop in _named(element):
        if prop.length_type and (rows[f"length of {number}"] != rows[prop.name].shape[1]).any():
            return None
    return rows


def _walk(
    data: bytes, position: int, element: Element, wanted: Property | None, byte_order: str
) -> tuple[IntArray, IntArray, int]:
    """Byte offsets and lengths of one list of all rows, and where the rows end."""
    starts: list[int] = []
    counts: list[int] = []
    for _ in range(element.count):
        for prop in element.properties:
            if prop.length_type is None:
                position += int(prop.type[1])
                continue
            length = _length(data, position, prop, byte_order, element)
            position += int(prop.length_type[1])
            if prop is wanted:
                starts.append(position)
                counts.append(length)
            position += length * int(prop.type[1])
        _require(data, position, element)
    return np.array(starts, dtype=np.int64), np.array(counts, dtype=np.int64), position


def _as_integers(values: NDArray[Any]) -> IntArray:
    """Values of any property type as int64."""
    if values.dtype.kind == "f":
        return integral(values.astype(np.float64))
    return values.astype(np.int64)
