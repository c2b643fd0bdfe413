"""The report of a bank's training: rows, ablation, and the calibration of similarity checked."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.retrieval.bootstrap import interval, mean_of_rows
from workers.retrieval.calibration import impostor_quantiles, impostor_share
from workers.retrieval.model import Model
from workers.training.bank_shapes import BankShapes
from workers.training.elimination import Stage
from workers.training.ranking_loss import RankingTerms, learn_weights, ranks

BOOTSTRAP_SEED = 0
CHECKED_SHARES = (0.001, 0.01, 0.05, 0.2)


def bank_report(
    shapes: BankShapes,
    terms: RankingTerms,
    stages: Sequence[Stage],
    stage: Stage,
    held_out: BoolArray,
    names: Sequence[str],
) -> dict[str, Any]:
    """Figures of a training, before the weights are learned on all shapes; in per cent.

    Parameters
    ----------
    shapes : BankShapes
        That were learned from.
    terms : RankingTerms
        Of all channels with a scale.
    stages : sequence of Stage
        All banks on the way.
    stage : Stage
        The one that was chosen.
    held_out : (q,) bool
        Queries that weights were not learned on; none where there were too few groups.
    names : sequence of str
        Of the channels of ``terms``.

    Returns
    -------
    dict
        Plain JSON.
    """
    chosen = terms.channels(stage.channels)
    measured = {"training": ~held_out, "held_out": held_out}
    figures = {
        name: rows(shapes, chosen.queries(np.flatnonzero(which)), stage.weights, which)
        for name, which in measured.items()
        if which.any()
    }
    judged = held_out if held_out.any() else ~held_out
    return {
        "n_references": len(shapes.references),
        "n_queries": len(shapes.queries),
        "n_groups": len(set(shapes.groups)),
        "held_out_groups": sorted(
            {group for group, out in zip(shapes.query_groups, held_out, strict=True) if out}
        ),
        "n_candidates": len(names),
        "stages": [
            {"channels": len(one.channels), "validation_loss": round(one.loss, 5)} for one in stages
        ],
        "rows": figures,
        "ablation": ablation(
            shapes, chosen, held_out, judged, [names[i] for i in stage.channels], stage.weights
        ),
        "similarity": _checked_calibration(chosen, held_out, stage.weights),
    }


def rows(
    shapes: BankShapes, terms: RankingTerms, weights: FloatArray, which: BoolArray
) -> dict[str, Any]:
    """Mean average precision by transformation, their mean, and its interval over shapes.

    Parameters
    ----------
    shapes : BankShapes
        That were learned from.
    terms : RankingTerms
        Of the queries in ``which``.
    weights : (c,) float64
        Of the channels of ``terms``.
    which : (q,) bool
        Some of the shapes' queries.

    Returns
    -------
    dict
        Plain JSON, in per cent.
    """
    transformations = np.array(shapes.transformations)[which].tolist()
    return scored_rows(100.0 / ranks(terms, weights), transformations, terms.truth)


def scored_rows(
    scores: FloatArray, transformations: Sequence[str], truth: IntArray
) -> dict[str, Any]:
    """Mean score by transformation, their mean, and its interval over shapes.

    Parameters
    ----------
    scores : (q,) float64
        Of each query, in per cent.
    transformations : sequence of str
        Of each query.
    truth : (q,) int64
        The shape that each is a copy of.

    Returns
    -------
    dict
        Plain JSON, in per cent.
    """
    names, row = np.unique(transformations, return_inverse=True)
    means = mean_of_rows(scores, row, truth, seed=BOOTSTRAP_SEED)
    mean = interval(float(means.values[0]), means.samples[0])
    return {
        "map": {
            str(name): round(float(scores[row == i].mean()), 2) for i, name in enumerate(names)
        },
        "mean": round(mean.value, 2),
        "interval": [_rounded(end) for end in (mean.low, mean.high) if end is not None] or None,
    }


def ablation(
    shapes: BankShapes,
    terms: RankingTerms,
    held_out: BoolArray,
    judged: BoolArray,
    names: Sequence[str],
    weights: FloatArray,
) -> list[dict[str, Any]]:
    """What the mean of the rows loses without each channel, the weights learned anew.

    Parameters
    ----------
    shapes : BankShapes
        That were learned from.
    terms : RankingTerms
        Of the channels of the bank.
    held_out, judged : (q,) bool
        Queries not learned on, and those that the mean is measured on.
    names : sequence of str
        Of these channels.
    weights : (c,) float64
        Of these channels.

    Returns
    -------
    list of dict
        Plain JSON, one entry a channel; "lost" in per cent.
    """
    training = terms.queries(np.flatnonzero(~held_out))
    measured = terms.queries(np.flatnonzero(judged))
    full = rows(shapes, measured, weights, judged)["mean"]
    found = []
    for channel, name in enumerate(names):
        others: IntArray = np.flatnonzero(np.arange(len(names)) != channel)
        if len(others) == 0:
            break
        relearned = learn_weights(training.channels(others), weights[others])
        without = rows(shapes, measured.channels(others), relearned, judged)["mean"]
        found.append(
            {
                "channel": name,
                "weight": round(float(weights[channel] / weights.sum()), 4),
                "lost": _rounded(full - without),
            }
        )
    return found


def impostor_distances(terms: RankingTerms, weights: FloatArray) -> FloatArray:
    """Distances from every query to all references that are impostors of it.

    Parameters
    ----------
    terms : RankingTerms
        Of the channels of the bank.
    weights : (c,) float64
        Of these channels.

    Returns
    -------
    (i,) float64, as a search has them
    """
    fused = terms.search_distances(weights)
    fused[np.arange(len(fused)), terms.truth] = np.inf
    found: FloatArray = fused[np.isfinite(fused)]
    return found


def seen_scale(model: Model) -> float:
    """Share of the weight on channels in which two copies of different size differ.

    Parameters
    ----------
    model : Model
        With a weight above 0.

    Returns
    -------
    float
        In [0, 1].
    """
    total = sum(channel.weight for channel in model.channels)
    return sum(c.weight for c in model.channels if c.normalisation == "none") / total


def _checked_calibration(
    terms: RankingTerms, held_out: BoolArray, weights: FloatArray
) -> list[Mapping[str, float]]:
    """Share of held-out impostors that come closer than calibration on the others promised."""
    if not held_out.any():
        return []
    training = impostor_distances(terms.queries(np.flatnonzero(~held_out)), weights)
    quantiles = impostor_quantiles(training)
    others = impostor_distances(terms.queries(np.flatnonzero(held_out)), weights)
    shares = impostor_share(others, quantiles)
    return [
        {"promised": share, "found": float(f"{np.mean(shares <= share):.3g}")}
        for share in CHECKED_SHARES
    ]


def _rounded(value: float) -> float:
    return round(float(value), 2)
