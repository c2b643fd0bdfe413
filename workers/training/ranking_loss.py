"""Weights of channels by a ranking loss: every query's own reference before all others."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from workers.geometry.arrays import BoolArray, Float32Array, FloatArray, IntArray

RIDGE = 0.01
"""Of the squared distance of the weights from even ones: learned freely on creatures, weights were
1 to 2 points behind even ones on real shapes (commit 17fdbbf)."""

SHRINKAGE = 1e-4  # of their squares: keeps weights finite where every query is ranked first already
MOST_STEPS = 300


@dataclass(frozen=True, eq=False)
class RankingTerms:
    """What the fused distance is the weighted sum of.

    Attributes
    ----------
    terms : (c, q, g) float32
        (D/s)^p of every channel, from every query to every reference.
    truth : (q,) int64
        Each query's own reference.
    excluded : (q, g) bool
        References that are no impostors of a query though they are not its own.
    importance : (q,) float64
        Share of each query in the loss; the sum is 1.
    alike : (c,) bool or None
        Channels that are of one kind, so that even weights are expected of them; None for all.
    kept : (c, q) float32 or None
        Share of its weight that each channel keeps for a query, see `kept_shares`; None for 1.
    """

    terms: Float32Array
    truth: IntArray
    excluded: BoolArray
    importance: FloatArray
    alike: BoolArray | None = None
    kept: Float32Array | None = None

    @property
    def n_channels(self) -> int:
        """Number of channels, c."""
        return len(self.terms)

    def channels(self, chosen: IntArray) -> "RankingTerms":
        """Terms of some channels.

        Parameters
        ----------
        chosen : (k,) int64
            Their numbers.

        Returns
        -------
        RankingTerms
            Of k channels.
        """
        return replace(
            self,
            terms=self.terms[chosen],
            alike=None if self.alike is None else self.alike[chosen],
            kept=None if self.kept is None else self.kept[chosen],
        )

    def queries(self, chosen: IntArray) -> "RankingTerms":
        """Terms of some queries, whose importance is scaled to sum 1.

        Parameters
        ----------
        chosen : (k,) int64
            Their numbers.

        Returns
        -------
        RankingTerms
            Of k queries.
        """
        importance = self.importance[chosen]
        return RankingTerms(
            np.ascontiguousarray(self.terms[:, chosen]),
            self.truth[chosen],
            self.excluded[chosen],
            importance / importance.sum(),
            self.alike,
            None if self.kept is None else self.kept[:, chosen],
        )

    def distances(self, weights: FloatArray) -> FloatArray:
        """Fused distances Σ w (D/s)^p, the same weights for all queries.

        Parameters
        ----------
        weights : (c,) float64
            w >= 0.

        Returns
        -------
        (q, g) float64, infinite to excluded references
        """
        flat = self.terms.reshape(self.n_channels, -1)
        fused = (weights.astype(np.float32) @ flat).astype(np.float64)  # (q g)
        fused = fused.reshape(self.excluded.shape)
        return np.where(self.excluded, np.inf, fused)

    def search_distances(self, weights: FloatArray) -> FloatArray:
        """Fused distances with the weights that channels have for each query, as in a search.

        The loss does not use them: learned without them a bank is broader, and did better on other
        shapes (decision 16).

        Parameters
        ----------
        weights : (c,) float64
            w >= 0.

        Returns
        -------
        (q, g) float64, infinite to excluded references
        """
        if self.kept is None:
            return self.distances(weights)
        kept = weights[:, None] * self.kept  # (c, q)
        total = kept.sum(axis=0)  # (q,)
        kept *= np.divide(weights.sum(), total, out=np.ones(len(total)), where=total > 0.0)
        fused = np.einsum("cq,cqg->qg", kept.astype(np.float32), self.terms).astype(np.float64)
        return np.where(self.excluded, np.inf, fused)


def ranking_loss(terms: RankingTerms, weights: FloatArray) -> float:
    """Softmax cross-entropy: mean over queries of -ln of the share exp(-d) of their own reference.

    Parameters
    ----------
    terms : RankingTerms
        Of c channels.
    weights : (c,) float64
        w >= 0.

    Returns
    -------
    float
        In nats.
    """
    return _loss_of(terms, terms.distances(weights))


def ranks(terms: RankingTerms, weights: FloatArray) -> IntArray:
    """Rank of every query's own reference.

    Parameters
    ----------
    terms : RankingTerms
        Of c channels.
    weights : (c,) float64
        w >= 0.

    Returns
    -------
    (q,) int64, from 1; references at the same distance count as before it
    """
    return ranks_among(terms.search_distances(weights), terms.truth)


def ranks_among(distances: FloatArray, truth: IntArray) -> IntArray:
    """Rank of every query's own reference.

    Parameters
    ----------
    distances : (q, g) float64
        From every query to every reference.
    truth : (q,) int64
        Each query's own reference.

    Returns
    -------
    (q,) int64, from 1; references at the same distance count as before it
    """
    own = np.take_along_axis(distances, truth[:, None], axis=1)  # (q, 1)
    places: IntArray = np.count_nonzero(distances <= own, axis=1).astype(np.int64)
    return places


def learn_weights(terms: RankingTerms, start: FloatArray, *, ridge: float = RIDGE) -> FloatArray:
    """Weights >= 0 that minimise the loss and are not far from even; the problem is convex.

    Shapes that weights are learned on are never quite like those they are used on. So a channel
    that has not been seen to help counts as much as the others of its kind.

    Parameters
    ----------
    terms : RankingTerms
        Of c channels.
    start : (c,) float64
        Where to begin.
    ridge : float
        Of the squared distance of the weights of channels that are alike from even ones.

    Returns
    -------
    (c,) float64, not negative; their sum says how sharp the softmax is.
    """
    flat = terms.terms.reshape(terms.n_channels, -1)
    every = np.ones(terms.n_channels, dtype=np.bool_)
    alike = every if terms.alike is None or not terms.alike.any() else terms.alike
    places = np.arange(len(terms.truth))
    own = terms.terms[:, places, terms.truth].astype(np.float64)  # (c, q)
    of_own = own @ terms.importance  # (c,)

    def value_and_gradient(weights: FloatArray) -> tuple[float, FloatArray]:
        fused = terms.distances(weights)
        uneven = np.where(alike, weights - weights.mean(where=alike), 0.0)
        loss = _loss_of(terms, fused) + ridge * float(uneven @ uneven)
        loss += SHRINKAGE * float(weights @ weights)
        nearest = fused.min(axis=1, keepdims=True)
        shares = np.exp(nearest - fused)  # (q, g)
        shares *= (terms.importance / shares.sum(axis=1))[:, None]
        expected = flat @ shares.astype(np.float32).ravel()  # (c,)
        return loss, of_own - expected + 2.0 * (ridge * uneven + SHRINKAGE * weights)

    found = minimize(
        value_and_gradient,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(0.0, None)] * terms.n_channels,
        options={"maxiter": MOST_STEPS, "ftol": 1e-7},
    )
    weights: FloatArray = np.maximum(found.x, 0.0)
    return weights


def _loss_of(terms: RankingTerms, fused: FloatArray) -> float:
    """Loss of fused distances (q, g)."""
    nearest = fused.min(axis=1)  # (q,)
    own = fused[np.arange(len(fused)), terms.truth]
    total = np.log(np.exp(nearest[:, None] - fused).sum(axis=1)) - nearest
    return float(terms.importance @ (own + total))
