"""A learned kernel becomes a model that shapes are described and compared under."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from workers.errors import KernelDomainError
from workers.geometry.arrays import BoolArray, Float32Array
from workers.geometry.solution import Solution
from workers.geometry.views import View
from workers.retrieval.builtin import distance_model
from workers.retrieval.dissimilarity import DISSIMILARITIES
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances
from workers.training.learning import LearnedKernel


def learned_model(
    name: str,
    learned: LearnedKernel,
    *,
    parameters: Mapping[str, Any],
    view: View,
    versions: Mapping[str, str],
) -> Model:
    """Model of one channel, "distances": the distribution of the learned kernel's distances.

    Its bins reach as far as the distances of the shapes learned from. Its normalisation is the unit
    in which the kernel was learned.

    Parameters
    ----------
    name : str
        Of the model.
    learned : LearnedKernel
        With the report of its training.
    parameters : Mapping
        The model's, as they were requested.
    view : View
        Under which the kernel was learned.
    versions : Mapping
        Of what the training depended on, besides what the descriptors depend on.

    Returns
    -------
    Model
        Not calibrated yet, see `calibrated`.
    """
    model = distance_model(
        learned.report["method"],
        learned.kernel,
        view,
        normalisation=learned.report["unit"],
        top=learned.report["top_distance"],
        name=name,
        parameters=parameters,
    )
    return replace(model, versions={**model.versions, **versions})


def calibrated(model: Model, solutions: Sequence[Solution], labels: Sequence[str]) -> Model:
    """Return the model with its typical distances, which give similarity its meaning.

    They are medians over pairs of shapes of different classes, to three digits, one for each
    dissimilarity. A dissimilarity whose median is not above 0 has none.

    Parameters
    ----------
    model : Model
        Of one view.
    solutions : sequence of Solution
        Of shapes under this view; those that the model's kernel is not known for count nothing.
    labels : sequence of str
        Their classes.

    Returns
    -------
    Model
        As it was given, if fewer than two classes are left.
    """
    (view,) = model.views
    rows: list[Float32Array] = []
    kinds: list[str] = []
    for solution, label in zip(solutions, labels, strict=True):
        try:
            rows.append(describe({view.name: solution}, model))
        except KernelDomainError:
            continue
        kinds.append(label)
    if len(set(kinds)) < 2:
        return model
    names = np.array(kinds)
    return replace(
        model, typical_distances=_typical(model, np.stack(rows), names[:, None] != names)
    )


def _typical(model: Model, rows: Float32Array, others: BoolArray) -> dict[str, float]:
    """Median distance between rows (n, d) of different classes, by dissimilarity."""
    typical = {}
    for dissimilarity in DISSIMILARITIES:
        matrix = np.stack(
            [distances(row, rows, model, dissimilarity=dissimilarity) for row in rows]
        )
        median = float(f"{np.median(matrix[others]):.3g}")
        if median > 0.0:
            typical[dissimilarity] = median
    return typical
