"""A bank: several local kernels, chosen and weighted so that a copy is nearest to its own shape."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.retrieval.calibration import impostor_quantiles
from workers.retrieval.channels import AreaChannel
from workers.retrieval.model import Model
from workers.training.bank_report import bank_report, impostor_distances, seen_scale
from workers.training.bank_shapes import (
    BankShapes,
    dissimilarities,
    ranking_terms,
    typical_scales,
)
from workers.training.elimination import choose, eliminate
from workers.training.ranking_loss import RankingTerms, learn_weights

BANK_VERSION = "4"
"""Part of a bank's versions: raised when the same descriptors give another bank."""

POWER = 0.25
"""A sum of metrics to a power <= 1 is a metric. ``python -m benchmarks.bank_study`` measured powers
1/2 and 1, which are 0.7 and 4.1 points worse (docs/method.md)."""

MOST_CHANNELS = 100
"""At most 40, 16 and 8 channels are 0.5, 1.9 and 2.6 points worse (the same study)."""

TOLERATED_SHARE = 0.03
"""Share of the least validation loss that a broader bank may cost (decisions 12 and 17)."""

TOLERATED_NATS = 0.01
"""What it may cost in any case: one per cent of a probability of 1 (decision 17)."""

VALIDATION_SHARE = 0.25
"""Share of the groups that is held out; a choice."""

FEWEST_GROUPS = 4
"""With fewer groups nothing is held out: a quarter of them would be none."""

__all__ = ["BankOptions", "BankShapes", "TrainedBank", "train_bank"]


@dataclass(frozen=True)
class BankOptions:
    """How a bank is learned.

    Attributes
    ----------
    power : float
        p of Σ w (D/s)^p.
    channels : int
        At most so many are kept.
    """

    power: float = POWER
    channels: int = MOST_CHANNELS

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not (np.isfinite(self.power) and self.power > 0.0) or self.channels < 1:
            raise InvalidRequestError(
                f"power is {self.power} and channels are {self.channels}, expected a power > 0 "
                "and at least 1 channel"
            )


@dataclass(frozen=True, eq=False)
class TrainedBank:
    """The model, and what was found on the way to it.

    Attributes
    ----------
    model : Model
    report : Mapping
        Plain JSON.
    relearned : callable
        From some of the queries, (q,) bool, to the model with weights learned on them alone. Its
        channels are chosen from the same ones. It is not calibrated.
    """

    model: Model
    report: Mapping[str, Any]
    relearned: Callable[[BoolArray], Model]


def train_bank(
    name: str,
    shapes: BankShapes,
    candidates: Model,
    options: BankOptions,
    *,
    parameters: Mapping[str, Any],
    versions: Mapping[str, str],
) -> TrainedBank:
    """Choose channels, and learn their weights and the meaning of their distances.

    A quarter of the groups is held out. Channels are eliminated by the loss on it, and weights
    learned on the rest: figures of the report are of that stage. Then the weights of the chosen
    channels are learned on all shapes. Where copies were scaled, the area is no candidate.

    Parameters
    ----------
    name : str
        Of the model.
    shapes : BankShapes
        Described under ``candidates``.
    candidates : Model
        Of all channels that may be chosen.
    options : BankOptions
        Power, and the number of channels.
    parameters : Mapping
        The model's, as they were requested.
    versions : Mapping
        Of what the training depended on, besides what the descriptors depend on.

    Returns
    -------
    TrainedBank
        The same for the same arguments, to the last digit.

    Raises
    ------
    InsufficientTrainingDataError
        There are fewer than two shapes with transformed copies, or they are all the same.
    """
    if len(set(shapes.truth.tolist())) < 2:
        raise InsufficientTrainingDataError(
            f"{len(set(shapes.truth.tolist()))} shapes with transformed copies are left, expected "
            "at least 2"
        )
    found = dissimilarities(shapes, candidates)
    scales = np.where(_left_out(shapes, candidates), 0.0, typical_scales(shapes, found))
    terms = ranking_terms(shapes, candidates, found, scales, power=options.power)
    useful = np.flatnonzero(scales > 0.0)
    held_out = held_out_queries(shapes)
    training = terms.queries(np.flatnonzero(~held_out))
    validation = terms.queries(np.flatnonzero(held_out)) if held_out.any() else training
    stages = eliminate(training, validation)
    stage = choose(stages, most=options.channels, share=TOLERATED_SHARE, least_nats=TOLERATED_NATS)
    chosen = terms.channels(stage.channels)

    def weighted(terms: RankingTerms) -> tuple[FloatArray, Model]:
        weights = rounded_weights(learn_weights(terms, stage.weights))
        return weights, _bank(name, candidates, options, weights, scales, useful[stage.channels])

    weights, model = weighted(chosen)
    model = replace(
        model,
        parameters=parameters,
        versions={**model.versions, **versions, "bank": BANK_VERSION},
        impostor_quantiles=impostor_quantiles(impostor_distances(chosen, weights)),
    )
    names = [candidates.channels[number].name for number in useful]
    report = bank_report(shapes, terms, stages, stage, held_out, names)
    return TrainedBank(
        model,
        {**report, "share_that_sees_scale": round(seen_scale(model), 4)},
        lambda some: weighted(chosen.queries(np.flatnonzero(some)))[1],
    )


def held_out_queries(shapes: BankShapes) -> BoolArray:
    """Queries of the groups that channels are chosen by: every fourth group, spread evenly.

    Parameters
    ----------
    shapes : BankShapes
        Of any number of groups.

    Returns
    -------
    (q,) bool, none of them where there are fewer than four groups
    """
    names = sorted(set(shapes.query_groups))
    if len(names) < FEWEST_GROUPS:
        return np.zeros(len(shapes.truth), dtype=np.bool_)
    step = round(1.0 / VALIDATION_SHARE)
    held_out = set(names[step - 1 :: step])
    return np.array([group in held_out for group in shapes.query_groups])


def _left_out(shapes: BankShapes, candidates: Model) -> BoolArray:
    """Whether a channel is not to be chosen, (c,): the area, where scale was trained."""
    of_area = np.array([isinstance(channel, AreaChannel) for channel in candidates.channels])
    return of_area & ("scale" in shapes.transformations)


def rounded_weights(weights: FloatArray) -> FloatArray:
    """Weights of sum 1, to four decimals.

    Parameters
    ----------
    weights : (c,) float64
        Not negative, not all 0.

    Returns
    -------
    (c,) float64
    """
    rounded: FloatArray = np.round(weights / weights.sum(), 4)
    return rounded


def _bank(
    name: str,
    candidates: Model,
    options: BankOptions,
    weights: FloatArray,
    scales: FloatArray,
    numbers: IntArray,
) -> Model:
    """Return the model of the channels that have a weight, and the views that they need.

    Views keep their limits of roughness where there is a view without them.
    """
    chosen = tuple(
        replace(candidates.channels[number], weight=float(weight), scale=float(scales[number]))
        for number, weight in zip(numbers.tolist(), weights, strict=True)
        if weight > 0.0
    )
    if not chosen:
        raise InsufficientTrainingDataError("no channel of the bank has a weight above 0")
    needed = {channel.view for channel in chosen}
    limits = tuple(one for one in candidates.roughness_limits if one.view in needed)
    has_other_view = bool(needed - {one.view for one in limits})
    return replace(
        candidates,
        name=name,
        channels=chosen,
        roughness_limits=limits if has_other_view else (),
        views=tuple(view for view in candidates.views if view.name in needed),
        fusion_power=options.power,
    )
