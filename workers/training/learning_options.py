"""What a kernel is learned with."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workers.errors import InvalidRequestError
from workers.training.moments import CRITERIA, UNITS

METHODS = ("spline", "grid", "heat-time")
INTERPOLATIONS = {"nearest": 0, "linear": 1}  # degree of the basis
SPLINE_DEGREE = 3
KNOT_SPACING = 1.0  # of ln λ; see docs/learning.md for what finer and coarser ones do

_COMMON = ("criterion", "unit", "margin")
_TAKEN = {
    "spline": (*_COMMON, "splines", "smoothness", "nonnegative"),
    "grid": (*_COMMON, "points", "interpolation"),
    "heat-time": _COMMON,
}


@dataclass(frozen=True)
class LearningOptions:
    """How a kernel is learned; checked.

    Attributes
    ----------
    method : str
        "spline", eq. (13); "grid", eq. (10); "heat-time", the best time of the heat kernel.
    criterion : str
        "kernel", k(x,x') as in eq. (7), or "distance", d²(x,x').
    unit : str
        Of the eigenvalues: "none", the meshes' own; "area" or "first-eigenvalue", whatever makes
        that 1.
    splines : int or None
        Number of cubic splines, q, uniform in ln λ; at least 4. None: as many as put their knots
        a factor e apart, about 10 for λ/λ₁.
    smoothness : float
        η as a share of trace(P) / trace(R), from 0.
    nonnegative : bool
        Keep a >= 0; else the closed form is taken, with K² put to 0 where it is negative.
    points : int
        Number of points of the grid γ, r.
    interpolation : str
        "nearest" or "linear" in ln λ, between the points of the grid.
    margin : float
        Factor, from 1, by which the kernel's domain goes beyond the eigenvalues learned from.
    """

    method: str = "spline"
    criterion: str = "distance"
    unit: str = "first-eigenvalue"
    splines: int | None = None
    smoothness: float = 1e-10
    nonnegative: bool = True
    points: int = 30
    interpolation: str = "linear"
    margin: float = 4.0

    def __post_init__(self) -> None:
        """Check every option."""
        for name, choices in (
            ("method", METHODS),
            ("criterion", CRITERIA),
            ("unit", UNITS),
            ("interpolation", tuple(INTERPOLATIONS)),
        ):
            if getattr(self, name) not in choices:
                raise InvalidRequestError(
                    f"there is no {name} {getattr(self, name)!r}; there are {', '.join(choices)}"
                )
        for name, low, high in (("splines", SPLINE_DEGREE + 1, 500), ("points", 2, 500)):
            value = getattr(self, name)
            if name == "splines" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                raise InvalidRequestError(
                    f"{name} is {value!r}, expected a whole number from {low} to {high}"
                )
        for name, least in (("smoothness", 0.0), ("margin", 1.0)):
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and math.isfinite(value) and value >= least):
                raise InvalidRequestError(
                    f"{name} is {value!r}, expected a finite number from {least:g}"
                )
        if not isinstance(self.nonnegative, bool):
            raise InvalidRequestError(
                f"nonnegative is {self.nonnegative!r}, expected true or false"
            )

    def to_json(self) -> dict[str, Any]:
        """Return the options that the method takes: ``parameters`` of the API, without the view.

        Returns
        -------
        dict
            Plain JSON.
        """
        return {name: getattr(self, name) for name in _TAKEN[self.method]}

    @classmethod
    def from_json(cls, method: str, parameters: Mapping[str, Any]) -> "LearningOptions":
        """Return the options of a method.

        Parameters
        ----------
        method : str
            "spline", "grid" or "heat-time".
        parameters : mapping of str
            What `to_json` writes; what is missing has its default.

        Returns
        -------
        LearningOptions
            Checked.

        Raises
        ------
        InvalidRequestError
            The method is unknown or does not take a parameter, or a value is out of range.
        """
        if method not in METHODS:
            raise InvalidRequestError(
                f"there is no method {method!r}; there are {', '.join(METHODS)}"
            )
        unknown = sorted(set(parameters) - set(_TAKEN[method]))
        if unknown:
            raise InvalidRequestError(
                f"method {method!r} takes no parameter {unknown[0]!r}; it takes "
                f"{', '.join(_TAKEN[method])}"
            )
        return cls(method=method, **parameters)

    def basis_size(self, low: float, high: float) -> int:
        """Count the functions in which K² is written: points of a grid, or splines.

        Parameters
        ----------
        low, high : float
            Smallest and largest eigenvalue.

        Returns
        -------
        int
            q of eq. (11).
        """
        if self.method == "grid":
            return self.points
        if self.splines is None:
            return max(round(math.log(high / low) / KNOT_SPACING), 1) + SPLINE_DEGREE
        return self.splines

    @property
    def basis_degree(self) -> int:
        """Degree of the functions in which K² is written."""
        return INTERPOLATIONS[self.interpolation] if self.method == "grid" else SPLINE_DEGREE

    @property
    def basis_smoothness(self) -> float:
        """Relative η: 0 for a grid, eq. (10)."""
        return 0.0 if self.method == "grid" else float(self.smoothness)
