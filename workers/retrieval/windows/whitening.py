"""Differences of windows in units of how much a point's windows differ between two copies.

Learned from pairs of corresponding points of creatures and their posed, rough and cut copies,
meshed otherwise (`workers.training.window_pairs`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import FloatArray, read_only
from workers.retrieval.windows.moments import NUMBERS, STEADY
from workers.retrieval.windows.signature import KINDS, LOST, WHOLE

WHOLE_COLUMNS = KINDS * NUMBERS
COLUMNS = WHOLE_COLUMNS + KINDS * len(STEADY)
"""Whitened numbers of a point: of its windows as whole ones, then as cut ones."""

_CLIPPED = 0.99  # quantile: larger differences are points that do not correspond
_LEAST_PAIRS = 200  # of a window, from which a covariance of seven numbers is worth having


@dataclass(frozen=True, eq=False)
class Whitening:
    """A linear map for each kind of window.

    Attributes
    ----------
    whole : (7, 7, 7) float64
        By window: numbers times it have differences of variance 1.
    cut : (7, 4, 4) float64
        Of the four numbers that truncation hardly changes.
    """

    whole: FloatArray
    cut: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "whole", read_only(self.whole, np.float64))
        object.__setattr__(self, "cut", read_only(self.cut, np.float64))

    def apply(self, numbers: NDArray[Any]) -> NDArray[np.float32]:
        """Whitened numbers of points.

        Parameters
        ----------
        numbers : (s, 7, 7) float32
            Of windows, as in `Signature`.

        Returns
        -------
        (s, 77) float32
        """
        flat = np.asarray(numbers, dtype=np.float32).reshape(len(numbers), -1)
        white: NDArray[np.float32] = flat @ self.matrix
        return white

    @cached_property
    def matrix(self) -> NDArray[np.float32]:
        """Both maps as one, (49, 77): a block for each window and map."""
        matrix = np.zeros((KINDS, NUMBERS, COLUMNS))
        for window in range(KINDS):
            start, after = NUMBERS * window, WHOLE_COLUMNS + len(STEADY) * window
            matrix[window, :, start : start + NUMBERS] = self.whole[window]
            matrix[window, list(STEADY), after : after + len(STEADY)] = self.cut[window]
        return matrix.reshape(WHOLE_COLUMNS, COLUMNS).astype(np.float32)

    def to_json(self) -> dict[str, Any]:
        """Plain JSON, six digits.

        Returns
        -------
        dict
        """
        return {"whole": _rounded(self.whole), "cut": _rounded(self.cut)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Whitening":
        """Return the whitening that `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        Whitening

        Raises
        ------
        ValueError, KeyError, TypeError
            It is none.
        """
        whole, cut = (np.array(value[name], dtype=np.float64) for name in ("whole", "cut"))
        if whole.shape != (KINDS, NUMBERS, NUMBERS) or cut.shape != (KINDS, 4, 4):
            raise ValueError(f"whitening of the shapes {whole.shape} and {cut.shape}")
        if not (np.isfinite(whole).all() and np.isfinite(cut).all()):
            raise ValueError("whitening has numbers that are not finite")
        return cls(whole, cut)


def masks(reaches: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Which whitened numbers of points count.

    Parameters
    ----------
    reaches : (s, 7) uint8
        As in `Signature`.

    Returns
    -------
    counted : (s, 77) float32
        1 or 0.
    dimensions : (s, 7) float32
        How many numbers of each window count: 7, 4 or 0.
    """
    whole = reaches == WHOLE
    cut = (reaches != WHOLE) & (reaches != LOST)
    counted = np.concatenate(
        [np.repeat(whole, NUMBERS, axis=1), np.repeat(cut, len(STEADY), axis=1)], axis=1
    )
    dimensions = NUMBERS * whole + len(STEADY) * cut
    return counted.astype(np.float32), dimensions.astype(np.float32)


def learn_whitening(
    differences: NDArray[Any], one: NDArray[np.uint8], other: NDArray[np.uint8]
) -> Whitening:
    """Learn it from pairs of corresponding points.

    Parameters
    ----------
    differences : (p, 7, 7) float
        Numbers of one point less those of the other.
    one, other : (p, 7) uint8
        Their ``reaches``.

    Returns
    -------
    Whitening

    Raises
    ------
    InsufficientTrainingDataError
        There are too few pairs, or they do not differ.
    """
    whole, cut = [], []
    for window in range(KINDS):
        of_window = np.asarray(differences[:, window], dtype=np.float64)
        both = (one[:, window] == WHOLE) & (other[:, window] == WHOLE)
        partly = (one[:, window] == WHOLE) & (other[:, window] != LOST)
        whole.append(_whitener(of_window[both]))
        cut.append(_whitener(of_window[partly][:, STEADY]))
    return Whitening(np.array(whole), np.array(cut))


def _whitener(differences: FloatArray) -> FloatArray:
    """The map after which differences (p, m) have the covariance 1."""
    if len(differences) < _LEAST_PAIRS:
        raise InsufficientTrainingDataError(
            f"{len(differences)} pairs of windows are there to learn from, expected at least "
            f"{_LEAST_PAIRS}"
        )
    limits = np.quantile(np.abs(differences), _CLIPPED, axis=0)
    clipped = np.clip(differences, -limits, limits)
    covariance = clipped.T @ clipped / len(clipped)
    try:
        found: FloatArray = np.linalg.cholesky(np.linalg.inv(covariance))
    except np.linalg.LinAlgError as error:
        raise InsufficientTrainingDataError("windows of corresponding points do not differ") from (
            error
        )
    return found


def _rounded(values: FloatArray) -> Any:
    return [[[float(f"{x:.6g}") for x in row] for row in window] for window in values.tolist()]
