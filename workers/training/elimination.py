"""Backward elimination: the channels that a bank can do without are dropped one by one."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.training.ranking_loss import RankingTerms, learn_weights, ranking_loss

FEWEST_CHANNELS = 4  # where elimination ends; a choice
START_WEIGHT = 20.0  # of all channels together, where the convex problem is started from


@dataclass(frozen=True, eq=False)
class Stage:
    """A bank during elimination.

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


def eliminate(training: RankingTerms, validation: RankingTerms) -> list[Stage]:
    """Banks of ever fewer channels.

    At each step one channel is dropped: the one without which the others, at their weights, have
    the least loss on the validation queries. Then weights are learned anew on the training queries.
    Channels whose weight is 0 go first, all at once.

    Parameters
    ----------
    training, validation : RankingTerms
        Of the same candidates.

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
        if len(left) <= FEWEST_CHANNELS:
            return stages
        kept = np.arange(len(left)) != _least_missed(held_out, weights)
        left, weights = left[kept], weights[kept] * (weights.sum() / weights[kept].sum())


def choose(stages: list[Stage], *, most: int, share: float, least_nats: float) -> Stage:
    """Largest bank of at most so many channels whose loss is about the least (decision 17).

    On shapes like those learned from, a few channels do as well as many; on others many do better.
    Where queries are few or easy, all losses are close to 0, and differ by chance alone.

    Parameters
    ----------
    stages : list of Stage
        The largest first.
    most : int
        Channels; at least as many as the smallest stage has.
    share, least_nats : float
        How far above the least loss it may be: this share of it, and at least so much, in nats.

    Returns
    -------
    Stage
        One of them.
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
