"""Transforms of COLLADA's nodes as matrices that multiply columns."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray


def matrix_of(kind: str, numbers: FloatArray) -> FloatArray:
    """Matrix of one transform.

    Parameters
    ----------
    kind : str
        One of ``TRANSFORMS``.
    numbers : (count,) float64
        As the file has them; angles are degrees.

    Returns
    -------
    (4, 4) float64

    Raises
    ------
    InvalidMeshError
        Too few numbers.
    """
    needed, make = _MAKERS[kind]
    if len(numbers) < needed:
        raise InvalidMeshError(
            f"a <{kind}> of the COLLADA file has {len(numbers)} numbers; expected {needed}"
        )
    with np.errstate(all="ignore"):
        return make(numbers[:needed])


def _translation(numbers: FloatArray) -> FloatArray:
    """Move by (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = numbers
    return matrix


def _scaling(numbers: FloatArray) -> FloatArray:
    """Scale by (3,)."""
    return np.diag([*numbers, 1.0])


def _rotation(numbers: FloatArray) -> FloatArray:
    """Turn about an axis (3,) by an angle (Rodrigues)."""
    axis, angle = numbers[:3], np.deg2rad(numbers[3])
    length = np.sqrt((axis**2).sum())
    matrix = np.eye(4)
    if length > 0.0:
        x, y, z = axis / length
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turned = np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
        matrix[:3, :3] += turned
    return matrix


def _look(numbers: FloatArray) -> FloatArray:
    """Stand at an eye, look at a point along −z, with a direction up; nine numbers."""
    eye, point, up = numbers.reshape(3, 3)
    back = eye - point
    side = np.cross(up, back)
    lengths = np.sqrt([(back**2).sum(), (side**2).sum()])
    matrix = _translation(eye)
    if (lengths > 0.0).all():
        back, side = back / lengths[0], side / lengths[1]
        matrix[:3, :3] = np.stack([side, np.cross(back, side), back], axis=1)
    return matrix


def _skewing(numbers: FloatArray) -> FloatArray:
    """Shear along an axis by an angle, where another axis points (RenderMan's skew)."""
    angle, along, across = np.deg2rad(numbers[0]), numbers[1:4], numbers[4:7]
    matrix = np.eye(4)
    norms = np.sqrt([(along**2).sum(), (across**2).sum()])
    if (norms > 0.0).all():
        along, across = along / norms[0], across / norms[1]
        side = across - (across @ along) * along  # what of the second axis is across the first
        length = np.sqrt((side**2).sum())
        if length > 0.0:
            matrix[:3, :3] += np.tan(angle) * np.outer(along, side / length)
    return matrix


_MAKERS: Mapping[str, tuple[int, Callable[[FloatArray], FloatArray]]] = MappingProxyType(
    {
        "matrix": (16, lambda numbers: numbers.reshape(4, 4)),
        "translate": (3, _translation),
        "rotate": (4, _rotation),
        "scale": (3, _scaling),
        "lookat": (9, _look),
        "skew": (7, _skewing),
    }
)
TRANSFORMS = frozenset(_MAKERS)
