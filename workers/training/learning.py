"""Learning a kernel from pairs of shapes: eqs. (7) to (13)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from workers.diffusion.kernels import (
    CommuteTimeKernel,
    HeatKernel,
    Kernel,
    SplineKernel,
    TabulatedKernel,
    evaluate,
)
from workers.diffusion.splines import SplineBasis
from workers.errors import InsufficientTrainingDataError, KernelDomainError
from workers.geometry.arrays import FloatArray, IntArray
from workers.training.heat_time import best_heat_time, heat_columns
from workers.training.learning_options import LearningOptions
from workers.training.moments import PairMoments
from workers.training.quotient import closed_form, nonnegative_minimum, numerator
from workers.training.training_set import TrainingSet, make_training_set

REACH = 2.5  # times the root mean square of a shape's distances: next to none are longer
CURVE_POINTS = 2000
_UNCHANGED = 1e-12  # trace(P) / trace(N): rounding
_UNSEEN = 1e-9  # value of a basis function below which it counts as 0
_FLOOR = 1e-6  # of the largest λK²: where ln K² still has a slope to speak of


@dataclass(frozen=True, eq=False)
class LearnedKernel:
    """A kernel and how it was found.

    Attributes
    ----------
    kernel : Kernel
        For eigenvalues in ``report["unit"]``.
    report : Mapping
        Plain JSON: the criterion of this and other kernels on the classes learned from and on
        those held out, the ranges of eigenvalues, the slope of ln K², and ``top_distance``, beyond
        which next to no distance of the shapes learned from lies.
    """

    kernel: Kernel
    report: Mapping[str, Any]


def learn_kernel(
    moments: Sequence[PairMoments], labels: Sequence[str], options: LearningOptions
) -> LearnedKernel:
    """Learn the K² that changes least under transformations for how far it separates classes.

    K² is scaled so that the mean squared distance is 1 over all shapes learned from; a heat
    kernel stays as it is.

    Parameters
    ----------
    moments : sequence of PairMoments
        Taken for the criterion of the options; their order fixes the order of all sums.
    labels : sequence of str
        Class of each pair; negatives are between classes. Of four classes or more, every fourth
        is held out, and only measured on.
    options : LearningOptions
        Method, criterion, unit, and the functions in which K² is written.

    Returns
    -------
    LearnedKernel
        The kernel, and the report of its learning.

    Raises
    ------
    InsufficientTrainingDataError
        There are fewer than two classes, or no transformation changes anything.
    InvalidRequestError
        A pair was taken for another criterion.
    """
    training = make_training_set(
        moments, labels, criterion=options.criterion, unit=options.unit, hold_out=True
    )
    fit = _fit(training, options)
    time = best_heat_time(
        lambda times: training.criteria(heat_columns(times, fit.basis.low)),
        fit.basis.low,
        fit.basis.high,
    )
    if options.method == "heat-time":
        kernel: Kernel = HeatKernel(time)
    elif options.method == "spline" and not options.nonnegative:
        kernel = _clipped_kernel(fit, training, options.margin)
    else:
        start = np.exp(-2.0 * time * (fit.basis.places - fit.basis.low))
        kernel = _nonnegative_kernel(fit, start, training, options.margin)
    return LearnedKernel(kernel, MappingProxyType(_report(kernel, time, fit, training, options)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """The quotient to be minimised, and its plain closed form."""

    basis: SplineBasis
    above: FloatArray  # (q, q) P + ηR
    below: FloatArray  # (q, q) N
    seen: IntArray  # (q',), functions that are not 0 on all eigenvalues
    smoothness: float  # η itself
    plain: FloatArray  # (q,) closed form

    def filled(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients (q,) from those of the functions seen: in between they are linear."""
        filled: FloatArray = np.interp(np.arange(self.basis.size), self.seen, coefficients)
        return filled

    def solved(self, solve: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
        """Coefficients (q,) that a solver finds for the functions seen."""
        window = np.ix_(self.seen, self.seen)
        return self.filled(solve(self.above[window], self.below[window]))

    def values(self, coefficients: FloatArray, eigenvalues: FloatArray) -> FloatArray:
        """Σ a_i s_i(λ), constant beyond the ends."""
        inside = np.clip(eigenvalues, self.basis.low, self.basis.high)
        values: FloatArray = self.basis.values(inside) @ coefficients
        return values


def _fit(training: TrainingSet, options: LearningOptions) -> _Fit:
    """Take P, N and R of a basis over the range of the eigenvalues learned from."""
    spectra = training.spectra(held_out=False)
    low, high = float(spectra.min()), float(spectra.max())
    if not high > low:
        raise InsufficientTrainingDataError(
            f"all eigenvalues to learn from are {low:g}, expected a range of them"
        )
    size = options.basis_size(low, high)
    basis = SplineBasis(low, high, size, options.basis_degree)
    positive, negative = training.statistics(basis.values).means
    if not np.trace(positive) > _UNCHANGED * np.trace(negative):
        raise InsufficientTrainingDataError(
            f"the {training.count(held_out=False)} transformed shapes do not differ from their "
            f"originals in the unit {options.unit!r} (trace(P) is {np.trace(positive):.3g}, "
            f"trace(N) {np.trace(negative):.3g}), so that there is nothing to learn"
        )
    penalty = basis.roughness_penalty()
    smoothness = options.basis_smoothness * float(np.trace(positive) / np.trace(penalty))
    above = numerator(positive, smoothness * penalty, negative)
    seen = np.arange(basis.size)
    if smoothness == 0.0:
        seen = np.flatnonzero(basis.values(spectra).max(axis=0) > _UNSEEN)
    fit = _Fit(basis, above, negative, seen, smoothness, np.empty(0))
    return replace(fit, plain=fit.solved(closed_form))


def _nonnegative_kernel(
    fit: _Fit, heat: FloatArray, training: TrainingSet, margin: float
) -> SplineKernel:
    """Solve with a >= 0, starting from the closed form, commute time, heat and a constant."""
    starts = (np.maximum(fit.plain, 0.0), 1.0 / fit.basis.places, heat, np.ones(fit.basis.size))
    coefficients = fit.solved(
        lambda above, below: nonnegative_minimum(above, below, [s[fit.seen] for s in starts])
    )
    low, high, degree = fit.basis.low, fit.basis.high, fit.basis.degree
    limits = _domain(fit, training, margin)
    kernel = SplineKernel(low, high, degree, coefficients, limits)
    return replace(kernel, coefficients=coefficients / _mean_squared_distance(kernel, training))


def _clipped_kernel(fit: _Fit, training: TrainingSet, margin: float) -> TabulatedKernel:
    """Tabulate the closed form, 0 where it is negative."""
    inner = np.geomspace(fit.basis.low, fit.basis.high, CURVE_POINTS)
    inner[[0, -1]] = fit.basis.low, fit.basis.high
    places = np.unique([*inner, *_domain(fit, training, margin)])
    kernel = TabulatedKernel(places, np.maximum(fit.values(fit.plain, places), 0.0))
    mean = _mean_squared_distance(kernel, training)
    return TabulatedKernel(places, kernel.values / mean)


def _domain(fit: _Fit, training: TrainingSet, margin: float) -> tuple[float, float]:
    """The range learned from, widened by the margin and to all that is measured on."""
    held_out = training.spectra(held_out=True)
    return (
        float(held_out.min(initial=fit.basis.low / margin)),
        float(held_out.max(initial=fit.basis.high * margin)),
    )


def _mean_squared_distance(kernel: Kernel, training: TrainingSet) -> float:
    """Mean of d² over all shapes learned from."""
    squared = training.mean_squared_distances(lambda values: evaluate(kernel, values)[:, None])
    mean = float(squared.mean())
    if not mean > 0.0:
        raise KernelDomainError("the learned kernel vanishes on all shapes it was learned from")
    return mean


def _report(
    kernel: Kernel, time: float, fit: _Fit, training: TrainingSet, options: LearningOptions
) -> dict[str, Any]:
    """Everything worth knowing about a learned kernel, as JSON."""

    def columns(eigenvalues: FloatArray) -> FloatArray:
        return np.column_stack(
            [
                evaluate(kernel, eigenvalues),
                evaluate(CommuteTimeKernel(), eigenvalues),
                heat_columns(np.array([time]), fit.basis.low)(eigenvalues)[:, 0],
                fit.values(fit.plain, eigenvalues),
            ]
        )

    names = ("learned", "commute-time", "heat", "closed-form")
    criterion: dict[str, Any] = {
        "training": dict(zip(names, training.criteria(columns).tolist(), strict=True)),
        "held-out": None,
    }
    if training.held_out:
        found = training.held_out_criteria(columns).tolist()
        criterion["held-out"] = dict(zip(names, found, strict=True))
    squared = training.mean_squared_distances(lambda values: evaluate(kernel, values)[:, None])
    places = np.geomspace(fit.basis.low, fit.basis.high, CURVE_POINTS)
    slope, deviation = _slope(kernel, places)
    return {
        "method": options.method,
        **options.to_json(),
        "classes": list(training.classes),
        "held_out_classes": list(training.held_out),
        "n_pairs": training.count(held_out=False),
        "n_held_out_pairs": training.count(held_out=True),
        "criterion": criterion,
        "heat_time": time,
        "slope": slope,
        "slope_deviation": deviation,
        "negative_share": float((fit.values(fit.plain, places) < 0.0).mean()),
        "functions": fit.basis.size,
        "unseen_functions": fit.basis.size - len(fit.seen),
        "eta": fit.smoothness,
        "trained_range": [fit.basis.low, fit.basis.high],
        "domain": list(_domain(fit, training, options.margin)),
        "top_distance": REACH * float(np.sqrt(squared.max())),
    }


def _slope(kernel: Kernel, places: FloatArray) -> tuple[float | None, float | None]:
    """Slope of ln K² on ln λ, evenly in ln λ, and the largest deviation from that line.

    Taken where λK² is above a millionth of its largest value: below, K² is as good as 0.
    """
    squared = evaluate(kernel, places)
    weighty = squared * places > _FLOOR * (squared * places).max()
    if np.count_nonzero(weighty) < 2:
        return None, None
    logs, values = np.log(places[weighty]), np.log(squared[weighty])
    slope, offset = np.polyfit(logs, values, 1)
    return float(slope), float(np.abs(values - slope * logs - offset).max())
