"""Buffer views under EXT_meshopt_compression or KHR_meshopt_compression."""

from typing import Any

import numpy as np
from meshopt import decode_gltf_buffer
from numpy.typing import NDArray

from workers.errors import InvalidMeshError
from workers.geometry.formats.gltf.document import Json, natural

NAMES = ("KHR_meshopt_compression", "EXT_meshopt_compression")
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")
SHORTEST = 64  # bytes; shorter data need not pass the test of its size
LARGEST_RATIO = 1024  # of attributes whose values are all the same, a quarter byte for 256


def decode_view(extension: Json, data: bytes | memoryview) -> NDArray[np.uint8]:
    """Plain bytes of a compressed buffer view.

    Parameters
    ----------
    extension : dict
        Of the buffer view; its 'count' times 'byteStride' was checked against the limits.
    data : bytes
        The compressed bytes.

    Returns
    -------
    (count * byteStride,) uint8
        As an accessor expects them.

    Raises
    ------
    InvalidMeshError
        Damaged, or more than so few bytes can hold.
    """
    count, stride = natural(extension, "count"), natural(extension, "byteStride")
    mode, kind = extension.get("mode"), extension.get("filter", "NONE")
    if mode not in MODES or kind not in FILTERS:
        raise InvalidMeshError(
            f"the glTF file has meshopt data of mode {str(mode)[:20]} and filter {str(kind)[:20]}, "
            "which is unknown"
        )
    if count == 0:
        return np.zeros(0, dtype=np.uint8)
    # Decoding takes the declared size at once: refuse what the bytes cannot hold.
    least = count * stride // LARGEST_RATIO if mode == "ATTRIBUTES" else count // 3
    if least > len(data) + SHORTEST:
        raise _damaged(f"{count:,} elements do not fit into {len(data):,} bytes")
    try:
        decoded: NDArray[Any] = decode_gltf_buffer(data, count, stride, mode, kind)
    except (ValueError, RuntimeError) as error:
        raise _damaged(str(error)[:80]) from None
    return np.ascontiguousarray(decoded).reshape(-1).view(np.uint8)


def _damaged(reason: str) -> InvalidMeshError:
    """Return the error for data that cannot be decoded."""
    return InvalidMeshError(f"the meshopt data of the glTF file is damaged: {reason}")
