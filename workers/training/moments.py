"""Positive and negative pairs of eq. (7), over all pairs of points, without counting any of them.

Points of X and Y = τX correspond, and have weights that sum to 1. Every sum over their pairs that
eq. (10) needs is then a product of moments of the eigenfunctions alone:

- kernel: the mean of φ_l(i)φ_l(j) · φ_m(i)φ_m(j) over i and j is E[φ_l φ_m]²;
- distance: the mean of (φ_l(i) - φ_l(j))² (φ_m(i) - φ_m(j))² is, once means are taken off,
  2 E[φ_l² φ_m²] + 2 E[φ_l²] E[φ_m²] + 4 E[φ_l φ_m]². This sum has no cancellation.

These moments do not depend on the basis in which K² is written, nor, up to factors, on the unit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidRequestError, SpectrumError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.spectrum import Spectrum
from workers.training.correspondence import Solved, corresponding_points

CRITERIA = ("kernel", "distance")
UNITS = ("none", "area", "first-eigenvalue")

Columns = Callable[[FloatArray], FloatArray]
"""From eigenvalues (k,) to the values there of q functions, (k, q)."""


@dataclass(frozen=True, eq=False)
class PairMoments:
    """Moments of a shape X and a transformation Y of it over all pairs of points; read-only.

    A pair of corresponding points has the features f = [k of X | k' of Y]: φ(x)φ(x') for k(x,x'),
    or (φ(x) - φ(x'))² for d²(x,x'), of surfaces scaled to area 1. Their sum, weighted by K²(λ), is
    what the criterion compares.

    Attributes
    ----------
    criterion : str
        "kernel" as in eq. (7), or "distance".
    eigenvalues, transformed_eigenvalues : (k,), (k',) float64
        Of X and Y at area 1.
    area, transformed_area : float
        In the unit of the meshes, squared.
    gram : (k + k', k + k') float64
        Weighted mean of f fᵀ.
    mean : (k + k',) float64
        Weighted mean of f.
    squared_distance : (k + k',) float64
        Weighted mean of (φ(x) - φ(x'))², whatever the criterion.
    """

    criterion: str
    eigenvalues: FloatArray
    transformed_eigenvalues: FloatArray
    area: float
    transformed_area: float
    gram: FloatArray
    mean: FloatArray
    squared_distance: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit and are finite."""
        for name in _ARRAYS:
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))
            if not np.isfinite(getattr(self, name)).all():
                raise InvalidRequestError(f"the pair's {name} has an entry that is no number")
        _check_choice("criterion", self.criterion, CRITERIA)
        count = len(self.eigenvalues) + len(self.transformed_eigenvalues)
        shapes = (self.gram.shape, self.mean.shape, self.squared_distance.shape)
        if shapes != ((count, count), (count,), (count,)) or count == 0:
            raise InvalidRequestError(
                f"the pair's moments have the shapes {shapes}, expected {count} features"
            )
        values = (*self.eigenvalues, *self.transformed_eigenvalues)
        if not min(*values, self.area, self.transformed_area) > 0.0:
            raise InvalidRequestError("a pair's eigenvalues and areas must be above 0")

    def scales(self, unit: str) -> tuple[float, float]:
        """What λ and the features of X and of Y are divided by.

        Parameters
        ----------
        unit : str
            "none", "area" or "first-eigenvalue".

        Returns
        -------
        (float, float)
            Areas of X and of Y in the unit, where λ is that of surfaces of area 1.
        """
        _check_choice("unit", unit, UNITS)
        if unit == "none":
            return float(self.area), float(self.transformed_area)
        if unit == "area":
            return 1.0, 1.0
        return float(self.eigenvalues[0]), float(self.transformed_eigenvalues[0])

    def spectra(self, unit: str) -> tuple[FloatArray, FloatArray]:
        """Eigenvalues of X and of Y in a unit.

        Parameters
        ----------
        unit : str
            "none", "area" or "first-eigenvalue".

        Returns
        -------
        (k,) and (k',) float64
            Rising.
        """
        first, second = self.scales(unit)
        return self.eigenvalues / first, self.transformed_eigenvalues / second

    def columns(self, functions: Columns, unit: str) -> tuple[FloatArray, FloatArray]:
        """Functions of λ at both spectra, in the unit of the features.

        Parameters
        ----------
        functions : callable
            S of eq. (11): from eigenvalues in the unit to (k, q).
        unit : str
            "none", "area" or "first-eigenvalue".

        Returns
        -------
        (k, q) and (k', q) float64
            At the eigenvalues of X and of Y.
        """
        return tuple(
            functions(spectrum) / scale
            for spectrum, scale in zip(self.spectra(unit), self.scales(unit), strict=True)
        )  # type: ignore[return-value]

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Return every field as an array, to be stored.

        Returns
        -------
        dict of str to array
            By the field's name.
        """
        return {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> "PairMoments":
        """Return the moments that `to_arrays` wrote.

        Parameters
        ----------
        arrays : mapping of str to array
            Every field by its name.

        Returns
        -------
        PairMoments
            Checked.

        Raises
        ------
        InvalidRequestError
            A field is missing, does not fit the others or is not finite.
        """
        try:
            return cls(
                criterion=str(arrays["criterion"]),
                area=float(arrays["area"]),
                transformed_area=float(arrays["transformed_area"]),
                **{name: arrays[name] for name in _ARRAYS},
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InvalidRequestError(f"the pair's moments cannot be read: {error!r}") from error


_ARRAYS = ("eigenvalues", "transformed_eigenvalues", "gram", "mean", "squared_distance")


def pair_moments(
    spectrum: Spectrum,
    transformed: Spectrum,
    points: FloatArray,
    transformed_points: FloatArray,
    weights: FloatArray,
    *,
    criterion: str,
) -> PairMoments:
    """Moments of a shape X and its transformation Y over all s² pairs of corresponding points.

    Parameters
    ----------
    spectrum, transformed : Spectrum
        Of X, k eigenpairs, and of Y, k' eigenpairs, each in the unit of its mesh.
    points : (s, k) float64
        Eigenfunctions of X at the points, in 1/length.
    transformed_points : (s, k') float64
        Eigenfunctions of Y at the corresponding points.
    weights : (s,) float64
        Area of X that each point stands for, in any unit: a pair counts the product of two.
    criterion : str
        "kernel" or "distance".

    Returns
    -------
    PairMoments
        On surfaces of area 1.

    Raises
    ------
    InvalidRequestError
        Sizes do not fit, something is not finite, or there is no eigenpair or no point.
    """
    _check_choice("criterion", criterion, CRITERIA)
    sizes = (len(points), spectrum.n_eigenpairs), (len(points), transformed.n_eigenpairs)
    if (points.shape, transformed_points.shape) != sizes or weights.shape != (len(points),):
        raise InvalidRequestError(
            f"points of shape {points.shape} and {transformed_points.shape} with weights of shape "
            f"{weights.shape} do not fit {sizes[0][1]} and {sizes[1][1]} eigenpairs"
        )
    if not (np.isfinite(weights).all() and weights.min(initial=0.0) >= 0.0 and weights.sum() > 0.0):
        raise InvalidRequestError("weights of points must be finite, not negative, and not all 0")
    weights = weights / weights.sum()
    functions = np.hstack(
        [points * np.sqrt(spectrum.area), transformed_points * np.sqrt(transformed.area)]
    )  # (s, k + k'), of mean square 1 on surfaces of area 1
    gram, mean, squared_distance = _moments(functions, weights, criterion)
    return PairMoments(
        criterion=criterion,
        eigenvalues=spectrum.eigenvalues * spectrum.area,
        transformed_eigenvalues=transformed.eigenvalues * transformed.area,
        area=spectrum.area,
        transformed_area=transformed.area,
        gram=gram,
        mean=mean,
        squared_distance=squared_distance,
    )


def moments_of_solved(
    original: Solved, transformed: Solved, origin: IntArray, *, criterion: str
) -> PairMoments:
    """Moments of a solved shape and its transformation, at the points that correspond.

    Parameters
    ----------
    original, transformed : Solved
        The shape X and its transformation Y.
    origin : (n',) int64
        Vertex of X's mesh that each vertex of Y's mesh corresponds to.
    criterion : str
        "kernel" or "distance".

    Returns
    -------
    PairMoments
        On surfaces of area 1.

    Raises
    ------
    SpectrumError
        One of them has no eigenpairs.
    InsufficientTrainingDataError
        Too few points correspond.
    """
    for one in (original, transformed):
        if not one.solution.spectrum.n_eigenpairs:
            raise SpectrumError("a mesh of the pair has no eigenpairs")
    found = corresponding_points(original, transformed, origin)
    return pair_moments(
        original.solution.spectrum,
        transformed.solution.spectrum,
        found.points,
        found.transformed_points,
        found.weights,
        criterion=criterion,
    )


def _moments(
    functions: FloatArray, weights: FloatArray, criterion: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Second moment, mean, and mean squared distance of (s, c) functions; module docstring."""
    averages = weights @ functions  # (c,)
    centred = functions - averages
    products = centred.T @ (weights[:, None] * centred)  # (c, c), E[φ_l φ_m]
    squared_distance = 2.0 * np.diag(products)
    if criterion == "kernel":
        products = products + np.outer(averages, averages)
        return products**2, averages**2, squared_distance
    squares = centred**2
    fourth = squares.T @ (weights[:, None] * squares)  # (c, c), E[φ_l² φ_m²]
    variances = np.diag(products)
    gram = 2.0 * fourth + 2.0 * np.outer(variances, variances) + 4.0 * products**2
    return gram, squared_distance, squared_distance


def _check_choice(what: str, found: str, expected: tuple[str, ...]) -> None:
    """Raise InvalidRequestError unless the choice is one of those there are."""
    if found not in expected:
        raise InvalidRequestError(f"there is no {what} {found!r}; there are {', '.join(expected)}")
