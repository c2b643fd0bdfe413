"""Typed arrays within the buffers of a glTF file, checked before they are read."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidMeshError
from workers.geometry.formats.gltf.buffers import Buffers, View
from workers.geometry.formats.gltf.document import Json, entries, entry, natural, part

COMPONENTS = {
    **{5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5124: "<i4", 5125: "<u4"},
    **{5126: "<f4", 5130: "<f8"},  # 5124 and 5130 stand in no core file, but some write them
}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Accessors:
    """The accessors of one glTF document.

    Parameters
    ----------
    document : dict
        Content of the JSON.
    buffers : Buffers
        Of the same file.
    """

    def __init__(self, document: Json, buffers: Buffers) -> None:
        self._accessors = entries(document, "accessors")
        self._buffers = buffers
        self._sparse: dict[int, NDArray[Any]] = {}

    def count(self, index: Any) -> int:
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
        return natural(entry(self._accessors, index, "accessor"), "count")

    def is_plain(self, index: Any) -> bool:
        """Tell whether the accessor has data of its own.

        Parameters
        ----------
        index : int
            Number of the accessor in the document.

        Returns
        -------
        bool
            False where the data come from elsewhere, such as a Draco stream.

        Raises
        ------
        InvalidMeshError
            There is no such accessor.
        """
        item = entry(self._accessors, index, "accessor")
        return item.get("bufferView") is not None or bool(part(item, "sparse"))

    def values(self, index: Any, kind: str) -> NDArray[Any]:
        """Elements of an accessor, checked against the buffer before they are read.

        Parameters
        ----------
        index : int
            Number of the accessor in the document. Its count was checked against the limits.
        kind : str
            "SCALAR", "VEC3" or "VEC4": what the accessor must hold.

        Returns
        -------
        (count,), (count, 3) or (count, 4) array
            Of the type in the file. A view of the buffer where possible.

        Raises
        ------
        InvalidMeshError
            Another kind, or data that would lie outside its buffer.
        UnsupportedFormatError, UploadTooLargeError
            See `Buffers.view`.
        """
        item = entry(self._accessors, index, "accessor")
        if item.get("type") != kind or item.get("componentType") not in COMPONENTS:
            raise InvalidMeshError(f"accessor {index} of the glTF file is no {kind} of numbers")
        if index not in self._sparse:
            values = self._plain(index, item, kind)
            if not part(item, "sparse"):
                return values.ravel() if kind == "SCALAR" else values
            self._sparse[index] = self._substituted(index, item, values)
        values = self._sparse[index]
        return values.ravel() if kind == "SCALAR" else values

    def scaled(self, index: Any, values: NDArray[Any]) -> NDArray[Any]:
        """Integers of a normalized accessor as the fractions that they stand for.

        Parameters
        ----------
        index : int
            Number of the accessor in the document.
        values : array
            All or some of its elements.

        Returns
        -------
        array
            float64 from -1 to 1 where the accessor is normalized; the same array elsewhere.

        Raises
        ------
        InvalidMeshError
            There is no such accessor.
        """
        normalized = entry(self._accessors, index, "accessor").get("normalized")
        if normalized is not True or values.dtype.kind not in "iu":
            return values
        return np.maximum(values / np.float64(np.iinfo(values.dtype).max), -1.0)

    def _plain(self, index: Any, item: Json, kind: str) -> NDArray[Any]:
        """Elements (count, width) without what a sparse accessor changes."""
        dtype, count = np.dtype(COMPONENTS[item["componentType"]]), natural(item, "count")
        if item.get("bufferView") is None:
            self._buffers.require_known(item, "accessor")
            self._buffers.budget.take(count * WIDTHS[kind] * dtype.itemsize)
            return np.zeros((count, WIDTHS[kind]), dtype)
        view = self._buffers.view(item["bufferView"])
        return _elements(view, natural(item, "byteOffset"), count, WIDTHS[kind], dtype, index)

    def _substituted(self, index: Any, item: Json, base: NDArray[Any]) -> NDArray[Any]:
        """Elements of a sparse accessor: some of the base's are replaced."""
        sparse = part(item, "sparse")
        places, count = part(sparse, "indices"), natural(sparse, "count")
        replaced = part(sparse, "values")
        if count > len(base) or places.get("componentType") not in COMPONENTS:
            raise InvalidMeshError(
                f"accessor {index} of the glTF file replaces {count:,} of {len(base):,} elements"
            )
        if count == 0:
            return base
        dtype = np.dtype(COMPONENTS[places["componentType"]])
        view = self._buffers.view(places.get("bufferView"))
        indices = _elements(view, natural(places, "byteOffset"), count, 1, dtype, index).ravel()
        view = View(self._buffers.view(replaced.get("bufferView")).data, 0)
        width, offset = base.shape[1], natural(replaced, "byteOffset")
        values = _elements(view, offset, count, width, base.dtype, index)
        if dtype.kind == "f" or int(indices.min()) < 0 or int(indices.max()) >= len(base):
            raise InvalidMeshError(
                f"accessor {index} of the glTF file replaces element {indices.max()}, but has "
                f"{len(base):,}"
            )
        if item.get("bufferView") is not None:
            self._buffers.budget.take(base.nbytes)
            base = base.copy()
        base[indices] = values
        return base


def _elements(
    view: View, offset: int, count: int, width: int, dtype: np.dtype[Any], index: Any
) -> NDArray[Any]:
    """Elements (count, width) of a view, checked against its length."""
    stride = view.stride or width * dtype.itemsize
    last = offset + (count - 1) * stride + width * dtype.itemsize
    if count and last > len(view.data):
        raise InvalidMeshError(
            f"accessor {index} of the glTF file declares {count:,} elements, "
            "more than its buffer holds: it is truncated or damaged"
        )
    begin = offset if count else 0
    return np.ndarray((count, width), dtype, view.data, begin, (stride, dtype.itemsize))
