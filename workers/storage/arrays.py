"""Arrays as bytes: descriptors as bare little-endian float32, the rest as npz."""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

VECTOR = np.dtype("<f4")


def vector_to_bytes(vector: NDArray[np.float32]) -> bytes:
    """Little-endian float32 bytes of a descriptor.

    Parameters
    ----------
    vector : (d,) float32
        The descriptor.

    Returns
    -------
    4 d bytes.
    """
    return np.ascontiguousarray(vector, dtype=VECTOR).tobytes()


def vector_from_bytes(data: bytes) -> NDArray[np.float32]:
    """Descriptor from its bytes.

    Parameters
    ----------
    data : bytes
        What `vector_to_bytes` gave.

    Returns
    -------
    (d,) float32, read-only.
    """
    return np.frombuffer(data, dtype=VECTOR)


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Write named arrays as an uncompressed npz; equal arrays give equal bytes.

    Parameters
    ----------
    arrays : Mapping
        Arrays by their names, without objects.

    Returns
    -------
    The bytes of the file.
    """
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **{k: arrays[k] for k in sorted(arrays)})
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, NDArray[Any]]:
    """Read what `pack` wrote; pickles are refused.

    Parameters
    ----------
    data : bytes
        The bytes of the file.

    Returns
    -------
    Arrays by their names.

    Raises
    ------
    ValueError
        It is no npz file, or holds a pickle.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}
