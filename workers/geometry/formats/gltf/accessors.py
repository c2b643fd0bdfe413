"""Typed arrays within the buffers of a glTF file, checked before they are read."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError, UnsupportedFormatError

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3}


class Accessors:
    """The accessors of one glTF document."""

    def __init__(self, document: dict[str, Any], buffers: list[bytes]) -> None:
        self._accessors = document.get("accessors", [])
        self._views = document.get("bufferViews", [])
        self._buffers = buffers

    def count(self, index: int) -> int:
        """Return how many elements the accessor declares.

        Parameters
        ----------
        index : int
            Number of the accessor in the document.

        Returns
        -------
        int
            From 0; not checked against the buffer, see `values`.

        Raises
        ------
        InvalidMeshError
            There is no such accessor, or its count is no natural number.
        """
        return _natural(_item(self._accessors, index, "accessor"), "count")

    def values(self, index: int, kind: str) -> NDArray[Any]:
        """Elements of an accessor, checked against the buffer before they are read.

        Parameters
        ----------
        index : int
            Number of the accessor in the document.
        kind : str
            "SCALAR" or "VEC3": what the accessor must hold.

        Returns
        -------
        (count,) or (count, 3) array
            Of the type in the file, for "SCALAR" or "VEC3"; float64 from -1 to 1 where the accessor
            is normalized. A view of the buffer where possible.

        Raises
        ------
        InvalidMeshError
            Another kind, or data that would lie outside its buffer.
        UnsupportedFormatError
            A sparse accessor.
        """
        accessor = _item(self._accessors, index, "accessor")
        if "sparse" in accessor or "bufferView" not in accessor:
            raise UnsupportedFormatError("the glTF file has sparse accessors, which are not read")
        if accessor.get("type") != kind or accessor.get("componentType") not in COMPONENTS:
            raise InvalidMeshError(f"accessor {index} of the glTF file is no {kind} of numbers")
        view = _item(self._views, accessor["bufferView"], "buffer view")
        data = _item(self._buffers, view["buffer"], "buffer")
        dtype = np.dtype(COMPONENTS[accessor["componentType"]])
        count, width = _natural(accessor, "count"), WIDTHS[kind]
        stride = _natural(view, "byteStride") or width * dtype.itemsize
        inside = _natural(accessor, "byteOffset")
        length = _natural(view, "byteLength")
        last = inside + (count - 1) * stride + width * dtype.itemsize
        begin = _natural(view, "byteOffset")
        if count and (last > length or begin + length > len(data)):
            raise InvalidMeshError(
                f"accessor {index} of the glTF file declares {count:,} elements, "
                "more than its buffer holds: it is truncated or damaged"
            )
        strides = (stride, dtype.itemsize)
        values: NDArray[Any] = np.ndarray(
            (count, width), dtype, data, begin + inside if count else 0, strides
        )
        if accessor.get("normalized") and dtype.kind in "iu":
            values = np.maximum(values / np.float64(np.iinfo(dtype).max), -1.0)
        return values.ravel() if kind == "SCALAR" else values


def _item(items: Any, index: Any, noun: str) -> Any:
    """``items[index]``, or ``InvalidMeshError`` if there is none."""
    if not isinstance(items, list) or not isinstance(index, int) or not 0 <= index < len(items):
        raise InvalidMeshError(f"the glTF file has no {noun} {str(index)[:20]}")
    return items[index]


def _natural(item: dict[str, Any], key: str) -> int:
    """Return the natural number under a key, 0 where it is missing."""
    value = item.get(key, 0)
    if not isinstance(value, int) or not 0 <= value < 1 << 40:
        raise InvalidMeshError(f"'{key}' of the glTF file is {str(value)[:20]}; expected a number")
    return value
