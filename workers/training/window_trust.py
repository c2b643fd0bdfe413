"""How much windows count beside a bank's distance, learned from queries and their evidence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.retrieval.calibration import impostor_quantiles
from workers.retrieval.windows.evidence import Evidence
from workers.retrieval.windows.signature import Signature
from workers.retrieval.windows.trust import (
    FEATURES,
    NOT_VERIFIED,
    Trust,
    query_features,
    saturated,
    share_of,
)

RIDGE = 1e-5
"""Of the squared distance from where learning starts. Measured once, on held-out species of
training: 1e-4 is worse by a point (90.1 and 91.2 as the mean of eleven transformations)."""

FORGIVING = 0.3
"""q of the loss (1 - P^q) / q, where P is the share of the own shape in a softmax (Zhang, Sabuncu
2018). At 0 it is cross-entropy, which grows without end for copies that no evidence finds; these
taught that windows say little. Measured once, on held-out species of training: 0, 0.2, 0.3, 0.5
and 1 find 84.7, 85.7, 86.4, 86.2 and 84.7 as the mean of eleven transformations."""

_START = (
    *(10.0, 0.0, 0.0, 0.0),  # d
    *(8.0, 0.0, 0.0, 0.0),  # X
    *(1.0, 0.0, 0.0, 0.0),  # p
    *(0.0, 0.0),  # share of the windows that face the same way
    *(1.4, 1.3),  # where d and X saturate
)
_BOUNDS = [(-np.inf, np.inf)] * 14 + [(0.5, 3.0), (0.5, 3.0)]
_STEPS = 150


@dataclass(frozen=True, eq=False)
class WindowQueries:
    """Queries with what is known of all targets.

    Attributes
    ----------
    features : (q, 4) float64
        What each shows of itself.
    distances : (q, n) float64
        The bank's.
    around, facing : (q, n, c) float64
        X of both groups of windows; infinite where they were not compared.
    log_consistency : (q, n) float64
        ln p.
    truth : (q,) int64
        The target that each is a copy of.
    transformations : tuple of str
        Of each: they have the same share in the loss.
    """

    features: FloatArray
    distances: FloatArray
    around: FloatArray
    facing: FloatArray
    log_consistency: FloatArray
    truth: IntArray
    transformations: tuple[str, ...]

    @classmethod
    def of(
        cls,
        queries: Sequence[tuple[Signature, FloatArray, Evidence]],
        truth: Sequence[int],
        transformations: Sequence[str],
    ) -> "WindowQueries":
        """Put together what is known of queries.

        Parameters
        ----------
        queries : sequence of (Signature, (n,) float64, Evidence)
            Each with its distances and its evidence.
        truth : sequence of int
            The target that each is a copy of.
        transformations : sequence of str
            Of each.

        Returns
        -------
        WindowQueries
        """
        scales = max(one.all_around.shape[1] for _, _, one in queries)
        shape = len(queries), len(queries[0][1])
        around = np.full((*shape, scales), np.inf)
        facing = np.full((*shape, scales), np.inf)
        log_consistency = np.full(shape, NOT_VERIFIED)
        for number, (_, _, one) in enumerate(queries):
            own = slice(0, one.all_around.shape[1])
            around[number, one.places, own] = one.all_around
            facing[number, one.places, own] = one.facing
            log_consistency[number, one.places] = one.log_consistency
        return cls(
            np.array([query_features(signature) for signature, _, _ in queries]),
            np.array([distances for _, distances, _ in queries]),
            around,
            facing,
            log_consistency,
            np.array(truth, dtype=np.int64),
            tuple(transformations),
        )

    def only(self, chosen: BoolArray) -> "WindowQueries":
        """Some of the queries.

        Parameters
        ----------
        chosen : (q,) bool
            Which.

        Returns
        -------
        WindowQueries
        """
        return WindowQueries(
            self.features[chosen],
            self.distances[chosen],
            self.around[chosen],
            self.facing[chosen],
            self.log_consistency[chosen],
            self.truth[chosen],
            tuple(np.array(self.transformations)[chosen].tolist()),
        )

    def fused(self, trust: Trust) -> tuple[FloatArray, FloatArray]:
        """Distances of all targets from all evidence, as `Evidence.fused` has them.

        Parameters
        ----------
        trust : Trust
            How much it counts.

        Returns
        -------
        distances : (q, n) float64
        totals : (q,) float64
            By which the sum of the evidence was divided.
        """
        distance, windows, consistency = (
            np.logaddexp(0.0, self.features @ np.array(one))
            for one in (trust.distance, trust.windows, trust.consistency)
        )
        share = share_of(self.features[:, :2] @ np.array(trust.facing))[:, None, None]
        differences = ((1.0 - share) * self.around + share * self.facing).min(axis=2)
        evidence = distance[:, None] * saturated(self.distances, trust.most_distance)
        evidence += windows[:, None] * saturated(differences, trust.most_windows)
        evidence -= consistency[:, None] * self.log_consistency
        totals = distance + windows
        return evidence / totals[:, None], totals


def learn_trust(queries: WindowQueries, start: Trust | None = None) -> Trust:
    """Find the weights by which a copy is nearest to its own shape.

    The loss is the mean of (1 - P^q) / q, see `FORGIVING`.

    Parameters
    ----------
    queries : WindowQueries
        Of at least two targets.
    start : Trust, optional
        What is known already: weights stay near it as far as the queries do not say otherwise.

    Returns
    -------
    Trust
        The same for the same queries.

    Raises
    ------
    InsufficientTrainingDataError
        There are no queries, or fewer than two targets.
    """
    if len(queries.truth) == 0 or queries.distances.shape[1] < 2:
        raise InsufficientTrainingDataError(
            f"{len(queries.truth)} queries among {queries.distances.shape[-1]} targets, expected "
            "at least one among two"
        )
    known: FloatArray = np.array(_START) if start is None else _values(start)
    names, kinds = np.unique(queries.transformations, return_inverse=True)
    shares = 1.0 / (len(names) * np.bincount(kinds))[kinds]  # (q,)
    rows = np.arange(len(queries.truth))

    def loss(values: FloatArray) -> float:
        distances, totals = queries.fused(_trust(values))
        scores = -totals[:, None] * distances
        top = scores.max(axis=1)
        log_sums = top + np.log(np.exp(scores - top[:, None]).sum(axis=1))
        missed = log_sums - scores[rows, queries.truth]
        lost = -np.expm1(-FORGIVING * missed) / FORGIVING
        return float(shares @ lost + RIDGE * np.square(values - known).sum())

    found = minimize(loss, known, method="L-BFGS-B", bounds=_BOUNDS, options={"maxiter": _STEPS})
    return Trust.from_json(_trust(found.x).to_json())


def window_impostors(queries: WindowQueries, trust: Trust) -> tuple[float, ...]:
    """Quantiles of the distances of wrong pairs, by which a similarity is told.

    Parameters
    ----------
    queries : WindowQueries
        Of copies.
    trust : Trust
        What was learned.

    Returns
    -------
    tuple of float
        As `Model` keeps them.
    """
    distances, _ = queries.fused(trust)
    wrong = np.isfinite(queries.distances)  # others were not compared
    wrong[np.arange(len(queries.truth)), queries.truth] = False
    return impostor_quantiles(distances[wrong])


def _values(trust: Trust) -> FloatArray:
    """A vector of all weights of a trust."""
    return np.array(
        [
            *trust.distance,
            *trust.windows,
            *trust.consistency,
            *trust.facing,
            trust.most_distance,
            trust.most_windows,
        ]
    )


def _trust(values: FloatArray) -> Trust:
    """Weights from a vector of them all."""
    numbers = [float(value) for value in values]
    distance, windows, consistency = (
        tuple(numbers[FEATURES * i : FEATURES * (i + 1)]) for i in range(3)
    )
    facing = tuple(numbers[12:14])
    return Trust(distance, windows, consistency, facing, numbers[14], numbers[15])
