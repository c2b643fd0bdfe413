"""Backward elimination: the channels that a bank can do without are dropped one by one."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.training.ranking_loss import RankingTerms, learn_weights, ranking_loss

FEWEST_CHANNELS = 4
START_WEIGHT = 20.0  # of all channels together


@dataclass(frozen=True, eq=False)
class Stage:
    """A bank on its way.

    Attributes
    ----------
    channels : (c,) int64
        Numbers of the candidates that are left, ascending.
    weights : (c,) float64
        Learned on the training queries.
    loss : float
        On the validation queries.
    """

    channels: IntArray
    weights: FloatArray
    loss: float


def eliminate(
    training: RankingTerms,
    validation: RankingTerms,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> list[Stage]:
    """Banks of ever fewer channels.

    At each step the channel is dropped without which the others, at their weights, have the least
    loss on the validation queries; then weights are learned anew on the training queries.
    Channels whose weight is 0 go first, all at once.

    Parameters
    ----------
    training, validation : RankingTerms
        Of the same candidates.
    progress : callable, optional
        Told the number of channels dropped, and of those to drop.

    Returns
    -------
    list of Stage, the largest bank first, down to four channels or as many as there are.
    """
    n = training.n_channels
    left: IntArray = np.arange(n)
    weights = np.full(n, START_WEIGHT / n)
    stages: list[Stage] = []
    while True:
        weights = learn_weights(training.channels(left), weights)
        used = weights > 0.0
        if FEWEST_CHANNELS <= used.sum() < len(left):
            left, weights = left[used], weights[used]
        held_out = validation.channels(left)
        stages.append(
            Stage(
                read_only(left, np.int64),
                read_only(weights, np.float64),
                ranking_loss(held_out, weights),
            )
        )
        if progress is not None:
            progress(n - len(left), max(n - FEWEST_CHANNELS, 0))
        if len(left) <= FEWEST_CHANNELS:
            return stages
        kept = np.arange(len(left)) != _least_missed(held_out, weights)
        left, weights = left[kept], weights[kept] * (weights.sum() / weights[kept].sum())


def choose(stages: list[Stage], *, most: int, share: float, least_nats: float) -> Stage:
    """Return the largest bank of at most so many channels whose loss is about the least.

    On shapes that are like those learned from a few channels do as well as many; on others many do
    better. Where there are few queries, or easy ones, all losses are next to nothing, and a share
    of the least would tell apart what chance made.

    Parameters
    ----------
    stages : list of Stage
    most : int
        Channels; at least as many as the smallest stage has.
    share, least_nats : float
        How much more than the least of the stages that are small enough it may be: this share of
        it, and at least so much; in nats, as losses are.
    """
    small = [stage for stage in stages if len(stage.channels) <= most] or stages[-1:]
    least = min(stage.loss for stage in small)
    enough = least + max(share * least, least_nats)
    return next(stage for stage in small if stage.loss <= enough)


def _least_missed(terms: RankingTerms, weights: FloatArray) -> int:
    """Number of the channel without which the loss is least; the others share its weight."""
    losses = []
    for channel in range(terms.n_channels):
        without = weights.copy()
        without[channel] = 0.0
        if without.sum() <= 0.0:
            losses.append(np.inf)
            continue
        losses.append(ranking_loss(terms, without * (weights.sum() / without.sum())))
    return int(np.argmin(losses))
