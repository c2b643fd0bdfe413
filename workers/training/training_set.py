"""Pairs of shapes to learn from: their classes, which are held out, and sums over them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.training.moments import Columns, PairMoments
from workers.training.pair_statistics import (
    PairStatistics,
    ShapeMoments,
    pair_statistics,
    shape_moments,
)

HELD_OUT_EVERY = 4
"""From this many classes on, every fourth in the order of labels is not learned from."""


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Pairs in the order in which they are summed; `make_training_set` checks them.

    Attributes
    ----------
    moments : sequence of PairMoments
    labels : sequence of str
        Class of each pair.
    unit : str
        Of eigenvalues and features.
    held_out : tuple of str
        Classes that are not learned from, sorted.
    """

    moments: Sequence[PairMoments]
    labels: Sequence[str]
    unit: str
    held_out: tuple[str, ...] = ()

    @property
    def classes(self) -> tuple[str, ...]:
        """Classes that are learned from, sorted."""
        return tuple(sorted(set(self.labels) - set(self.held_out)))

    def count(self, *, held_out: bool) -> int:
        """Count the pairs of shapes.

        Parameters
        ----------
        held_out : bool
            Those of the classes that are held out, or else of the classes learned from.

        Returns
        -------
        int
            How many.
        """
        return sum((label in self.held_out) == held_out for label in self.labels)

    def statistics(self, functions: Columns) -> PairStatistics:
        """P and N of eq. (10), of the classes learned from.

        Parameters
        ----------
        functions : callable
            S of eq. (11): from eigenvalues in the unit to (k, q).

        Returns
        -------
        PairStatistics
            Sums in the order of the pairs.
        """
        return pair_statistics(self._by_class(functions, self.classes))

    def criteria(self, functions: Columns) -> FloatArray:
        """Criterion of eq. (7) of each function as K², on the classes learned from.

        Parameters
        ----------
        functions : callable
            S of eq. (11): from eigenvalues in the unit to (k, q).

        Returns
        -------
        (q,) float64
            Mean over positives by mean over negatives; less is better.
        """
        return _criteria(self.statistics(functions))

    def held_out_criteria(self, functions: Columns) -> FloatArray:
        """Criterion on the held-out classes; their negatives are among all classes.

        Parameters
        ----------
        functions : callable
            S of eq. (11): from eigenvalues in the unit to (k, q).

        Returns
        -------
        (q,) float64
            As for `criteria`.
        """
        everything = self._by_class(functions, (*self.classes, *self.held_out))
        return _criteria(pair_statistics(everything, self.held_out))

    def spectra(self, *, held_out: bool) -> FloatArray:
        """All eigenvalues, one spectrum after another.

        Parameters
        ----------
        held_out : bool
            Those of the classes that are held out, or else of the classes learned from.

        Returns
        -------
        (n,) float64
            In the unit of this set.
        """
        parts = [
            spectrum
            for moments, label in zip(self.moments, self.labels, strict=True)
            if (label in self.held_out) == held_out
            for spectrum in moments.spectra(self.unit)
        ]
        return np.concatenate([np.empty(0), *parts])

    def mean_squared_distances(self, functions: Columns) -> FloatArray:
        """Mean squared distance on each X and Y of the classes learned from.

        Parameters
        ----------
        functions : callable
            S of eq. (11): from eigenvalues in the unit to (k, q).

        Returns
        -------
        (2 pairs, q) float64
            X and Y of each pair, one after the other.
        """
        rows = []
        for moments, label in zip(self.moments, self.labels, strict=True):
            if label not in self.held_out:
                first, second = moments.columns(functions, self.unit)
                rows.append(moments.squared_distance[: len(first)] @ first)
                rows.append(moments.squared_distance[len(first) :] @ second)
        return np.array(rows)

    def _by_class(self, functions: Columns, labels: tuple[str, ...]) -> dict[str, ShapeMoments]:
        """Sums of moments by class."""
        sums: dict[str, ShapeMoments] = {}
        for moments, label in zip(self.moments, self.labels, strict=True):
            if label in labels:
                one = shape_moments(moments, functions, self.unit)
                sums[label] = sums[label] + one if label in sums else one
        return dict(sorted(sums.items()))


def make_training_set(
    moments: Sequence[PairMoments],
    labels: Sequence[str],
    *,
    criterion: str,
    unit: str,
    hold_out: bool,
) -> TrainingSet:
    """Check pairs and choose the classes that are held out.

    Parameters
    ----------
    moments : sequence of PairMoments
        Their order fixes the order of all sums.
    labels : sequence of str
        Class of each pair.
    criterion : str
        For which the moments have to be taken.
    unit : str
        "none", "area" or "first-eigenvalue".
    hold_out : bool
        Whether every fourth of four or more classes is held out.

    Returns
    -------
    TrainingSet
        All pairs.

    Raises
    ------
    InsufficientTrainingDataError
        There are fewer than two classes.
    InvalidRequestError
        The numbers of pairs and labels differ, or a pair was taken for another criterion.
    """
    if len(moments) != len(labels):
        raise InvalidRequestError(f"{len(moments)} pairs of shapes have {len(labels)} labels")
    classes = sorted(set(labels))
    if len(classes) < 2:
        raise InsufficientTrainingDataError(
            f"there are {len(moments)} pairs of shapes of {len(classes)} classes"
            f"{''.join(f' ({label!r})' for label in classes)}; at least 2 classes are needed, "
            "since shapes of different classes are what a kernel has to tell apart"
        )
    for i in range(len(moments)):
        if moments[i].criterion != criterion:
            raise InvalidRequestError(
                f"pair {i} has the moments of the criterion {moments[i].criterion!r}, "
                f"expected {criterion!r}"
            )
    enough = hold_out and len(classes) >= HELD_OUT_EVERY
    held_out = classes[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY] if enough else []
    return TrainingSet(moments, labels, unit, tuple(held_out))


def _criteria(statistics: PairStatistics) -> FloatArray:
    """Ratio of the means over positives and negatives for each function alone."""
    positive, negative = statistics.means
    with np.errstate(divide="ignore", invalid="ignore"):
        criteria: FloatArray = np.maximum(np.diag(positive), 0.0) / np.diag(negative)
    return criteria
