"""Kernels known on a range of eigenvalues only: a table, and the splines of eq. (11)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from workers.diffusion.splines import SplineBasis, within
from workers.errors import InvalidRequestError, KernelDomainError
from workers.geometry.arrays import FloatArray, read_only


@dataclass(frozen=True, eq=False)
class TabulatedKernel:
    """K² given at some eigenvalues and linear in log λ between them.

    Attributes
    ----------
    eigenvalues : (r,) float64
        Positive and ascending, r >= 2.
    values : (r,) float64
        K² there, finite and not negative.
    """

    kind: ClassVar[str] = "tabulated"
    eigenvalues: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        """Freeze and check the table."""
        for name in ("eigenvalues", "values"):
            object.__setattr__(self, name, read_only(np.ravel(getattr(self, name)), np.float64))
        r = len(self.eigenvalues)
        if r < 2 or len(self.values) != r:
            raise InvalidRequestError(
                f"a tabulated kernel has {r} eigenvalues and {len(self.values)} values, "
                "expected as many of both and at least 2"
            )
        ascending = self.eigenvalues[0] > 0 and np.all(np.diff(self.eigenvalues) > 0)
        if not (ascending and np.isfinite(self.eigenvalues[-1])):
            raise InvalidRequestError("eigenvalues of a tabulated kernel must be > 0 and ascend")
        check_squared_transfer(self.eigenvalues, self.values)

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ), linear in ln λ between the entries of the table.

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the unit of the table.

        Returns
        -------
        (k,) float64; NaN outside the table, where nothing is extrapolated
        """
        inside = within(eigenvalues, *self.domain)
        places = np.log(np.where(inside, eigenvalues, 1.0))
        values = np.interp(places, np.log(self.eigenvalues), self.values)
        squared: FloatArray = np.where(inside, values, np.nan)
        return squared

    @property
    def domain(self) -> tuple[float, float]:
        """Ends of the table."""
        return float(self.eigenvalues[0]), float(self.eigenvalues[-1])

    @property
    def parameters(self) -> dict[str, Any]:
        """The table."""
        return {
            "eigenvalues": self.eigenvalues.tolist(),
            "squared_transfer": self.values.tolist(),
        }


@dataclass(frozen=True, eq=False)
class SplineKernel:
    """K²(λ) = Σ a_i s_i(λ), eq. (11), with a_i >= 0 so that K² >= 0 everywhere.

    Attributes
    ----------
    low, high : float
        Range of the splines, which is that of the eigenvalues learned from.
    degree : int
        0 to 3, see `SplineBasis`: 0 and 1 are interpolation on a grid, eq. (10).
    coefficients : (q,) float64
        Finite and not negative.
    limits : (float, float), optional
        The domain, around [low, high], where there is more: K² stays constant from the end of the
        splines up to there.
    """

    kind: ClassVar[str] = "spline"
    low: float
    high: float
    degree: int
    coefficients: FloatArray
    limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Freeze the coefficients and check everything."""
        coefficients = read_only(np.ravel(self.coefficients), np.float64)
        object.__setattr__(self, "coefficients", coefficients)
        _ = self.basis  # checks range, degree and size
        wrong = np.flatnonzero(~(np.isfinite(coefficients) & (coefficients >= 0.0)))
        if len(wrong):
            raise KernelDomainError(
                f"coefficient {wrong[0]} of the spline is {coefficients[wrong[0]]:g}, "
                "expected a finite number that is not negative"
            )
        low, high = self.domain
        if not (0.0 < low <= self.low and self.high <= high < np.inf):
            raise InvalidRequestError(
                f"the domain goes from {low:g} to {high:g}, expected it around the splines' "
                f"range from {self.low:g} to {self.high:g}"
            )

    @cached_property
    def basis(self) -> SplineBasis:
        """The functions s_i."""
        return SplineBasis(self.low, self.high, len(self.coefficients), self.degree)

    @property
    def domain(self) -> tuple[float, float]:
        """Smallest and largest eigenvalue."""
        return self.limits or (self.low, self.high)

    def squared_transfer(self, eigenvalues: FloatArray) -> FloatArray:
        """K²(λ) = Σ a_i s_i(λ), eq. (11).

        Parameters
        ----------
        eigenvalues : (k,) float64
            In the unit of ``low`` and ``high``.

        Returns
        -------
        (k,) float64; NaN outside the domain, where nothing is extrapolated
        """
        eigenvalues = np.asarray(eigenvalues, dtype=np.float64)
        inside = within(eigenvalues, *self.domain)
        places = np.clip(np.where(inside, eigenvalues, self.low), self.low, self.high)
        flat = self.basis.values(places.ravel()) @ self.coefficients
        squared: FloatArray = np.where(inside, flat.reshape(places.shape), np.nan)
        return squared

    @property
    def parameters(self) -> dict[str, Any]:
        """Range, degree, coefficients and domain."""
        return {
            "low": self.low,
            "high": self.high,
            "degree": self.degree,
            "coefficients": self.coefficients.tolist(),
            "domain": list(self.domain),
        }


def check_squared_transfer(eigenvalues: FloatArray, squared: FloatArray) -> None:
    """Refuse values that are no K².

    Parameters
    ----------
    eigenvalues : (k,) float64
        For the message.
    squared : (k,) float64
        K² there.

    Raises
    ------
    KernelDomainError
        One is not finite, or negative; the first of them is named.
    """
    wrong = np.flatnonzero(~(np.isfinite(squared) & (squared >= 0.0)))
    if len(wrong):
        i = wrong[0]
        raise KernelDomainError(
            f"K² is {squared[i]:g} at the eigenvalue {eigenvalues[i]:g}, "
            "expected a finite number that is not negative"
        )
