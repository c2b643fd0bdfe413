"""Functions of ln λ in which a transfer function is written: splines of eq. (11), or a grid."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from workers.errors import InvalidRequestError
from workers.geometry.arrays import BoolArray, FloatArray

HIGHEST_DEGREE = 3
_SLACK = 1e-12  # of a bound


@dataclass(frozen=True)
class SplineBasis:
    """Functions s_i(λ) on [low, high] that sum to 1, none below 0; knots are uniform in ln λ.

    One class is eq. (11) and both interpolation operators of eq. (10). Of degree 1 the
    coefficients are values on a grid γ, uniform in ln λ, and linear between. Of degree 0 each
    eigenvalue takes the value of the nearest grid point. Higher degrees end with multiple knots:
    there the outermost coefficients are the values at the ends.

    Attributes
    ----------
    low, high : float
        0 < low < high, in the unit of the eigenvalues.
    size : int
        q, at least 2 and more than the degree.
    degree : int
        0 to 3.
    """

    low: float
    high: float
    size: int
    degree: int = 3

    def __post_init__(self) -> None:
        """Check range and sizes."""
        if not (0.0 < self.low < self.high < np.inf):
            raise InvalidRequestError(
                f"a basis goes from {self.low:g} to {self.high:g}, expected 0 < low < high"
            )
        if not 0 <= self.degree <= HIGHEST_DEGREE:
            raise InvalidRequestError(
                f"the degree is {self.degree}, expected 0 to {HIGHEST_DEGREE}"
            )
        if self.size < max(2, self.degree + 1):
            raise InvalidRequestError(
                f"{self.size} functions of degree {self.degree} asked for, expected at least "
                f"{max(2, self.degree + 1)}"
            )

    @cached_property
    def knots(self) -> FloatArray:
        """Knots in ln λ, (q + degree + 1,); of degree 0 the bounds of the grid points' cells."""
        low, high = np.log(self.low), np.log(self.high)
        if self.degree == 0:
            grid = np.linspace(low, high, self.size)
            return np.concatenate([[low], 0.5 * (grid[1:] + grid[:-1]), [high]])
        inner = np.linspace(low, high, self.size - self.degree + 1)
        return np.pad(inner, self.degree, mode="edge")

    @cached_property
    def places(self) -> FloatArray:
        """Eigenvalue about which each function lies, (q,): the grid γ, or the Greville points."""
        if self.degree == 0:
            return np.geomspace(self.low, self.high, self.size)
        windows = np.lib.stride_tricks.sliding_window_view(self.knots[1:-1], self.degree)
        places: FloatArray = np.exp(windows.mean(axis=1))
        return places

    def values(self, eigenvalues: FloatArray) -> FloatArray:
        """s_i(λ_l): S of eq. (11), I of eq. (10).

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the unit of ``low`` and ``high``.

        Returns
        -------
        (k, q) float64; rows sum to 1, and are NaN for what lies outside [low, high].
        """
        eigenvalues = np.asarray(eigenvalues, dtype=np.float64)
        inside = within(eigenvalues, self.low, self.high)  # (k,)
        places = np.log(np.where(inside, eigenvalues, self.low))
        places = np.clip(places, self.knots[0], self.knots[-1])
        if self.degree == 0:
            cells = np.searchsorted(self.knots[1:-1], places, side="right")
            values: FloatArray = np.eye(self.size)[cells]
        else:
            values = BSpline.design_matrix(places, self.knots, self.degree).toarray()
        values[~inside] = np.nan
        return values

    def roughness_penalty(self) -> FloatArray:
        """R of eq. (12): ∫ s_i' s_j' d ln λ, exactly.

        The paper's matrix lost the second ∇. Functions of degree 0 have no derivative: there it is
        the matrix of differences between neighbours on the grid.

        Returns
        -------
        (q, q) float64, symmetric, positive semidefinite; constants are in its kernel.
        """
        if self.degree == 0:
            width = np.log(self.high / self.low) / (self.size - 1)
            steps = np.diff(np.eye(self.size), axis=0)  # (q - 1, q)
            return np.asarray(steps.T @ steps / width)
        inner = self.knots[self.degree : len(self.knots) - self.degree]
        nodes, weights = np.polynomial.legendre.leggauss(self.degree)  # exact up to 2 degree - 1
        half = 0.5 * np.diff(inner)[:, None]  # (cells, 1)
        points = (0.5 * (inner[1:] + inner[:-1])[:, None] + half * nodes).ravel()
        slopes = BSpline(self.knots, np.eye(self.size), self.degree).derivative()(points)  # (p, q)
        penalty: FloatArray = slopes.T @ ((half * weights).ravel()[:, None] * slopes)
        return penalty


def within(eigenvalues: FloatArray, low: float, high: float) -> BoolArray:
    """Which eigenvalues lie in [low, high].

    Parameters
    ----------
    eigenvalues : (k,) float64
        One that was rounded in the last place still lies inside.
    low, high : float
        In the same unit.

    Returns
    -------
    (k,) bool
    """
    slack = 1.0 + _SLACK
    inside: BoolArray = (eigenvalues >= low / slack) & (eigenvalues <= high * slack)
    return inside
