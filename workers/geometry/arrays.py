"""Array types of the pure layers, and the one way to make an array read-only."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def read_only(array: Any, dtype: type[np.generic]) -> NDArray[Any]:
    """Return a contiguous array of this dtype that nobody can write to.

    Parameters
    ----------
    array : array-like
        Values of any type that converts.
    dtype : numpy type
        That of the result.

    Returns
    -------
    array of the same shape
        The array itself where it already is all that; a copy otherwise.
    """
    if (
        isinstance(array, np.ndarray)
        and array.dtype == np.dtype(dtype)
        and array.flags.c_contiguous
        and not array.flags.writeable
    ):
        return array
    frozen = np.array(array, dtype=dtype, order="C", copy=True)
    frozen.flags.writeable = False
    return frozen
