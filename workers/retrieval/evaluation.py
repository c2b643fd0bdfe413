"""The tables of an evaluation: Table 1, by strength, by label, means and their intervals."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.retrieval.bootstrap import Interval, RowMeans, difference, interval, mean_of_rows
from workers.retrieval.measures import RetrievalMeasures, mean_measures
from workers.retrieval.protocol import Protocol
from workers.retrieval.ranking import RECALLS, Ranking
from workers.transformations import TRANSFORMATIONS

SEED = 20100  # of the bootstrap; any number, the same for all


@dataclass(frozen=True, eq=False)
class EvaluationResult:
    """Models measured on the same queries; all figures are fractions.

    Attributes
    ----------
    mean_average_precision : Mapping
        By model: over all queries.
    table : Mapping
        Mean average precision by transformation and model; without rows if left one out.
    by_strength : Mapping
        The same by transformation, strength and model.
    by_label : Mapping
        Mean measures by label and model.
    measures : Mapping
        Mean measures by model, over all queries.
    precision : Mapping
        By model: mean interpolated precision (21,) at `RECALLS`.
    mean_of_rows : Mapping
        By model, of ``table``; every row counts alike, "all" being one of them.
    mean_intervals : Mapping
        By model, of ``mean_average_precision``.
    differences : Mapping
        By model but the first: how far both means are above those of the first.
    """

    mean_average_precision: Mapping[str, float]
    table: Mapping[str, Mapping[str, float]]
    by_strength: Mapping[str, Mapping[int, Mapping[str, float]]]
    by_label: Mapping[str, Mapping[str, RetrievalMeasures]]
    measures: Mapping[str, RetrievalMeasures]
    precision: Mapping[str, FloatArray]
    mean_of_rows: Mapping[str, Interval]
    mean_intervals: Mapping[str, Interval]
    differences: Mapping[str, Mapping[str, Interval]]

    def to_json(self) -> dict[str, Any]:
        """Figures in per cent, under the names of the interface.

        Returns
        -------
        dict
            Plain JSON.
        """
        return {
            "mean_average_precision": _percent(self.mean_average_precision),
            "table": _percent(self.table),
            "by_strength": _percent(self.by_strength),
            "by_label": _percent(self.by_label),
            "measures": _percent(self.measures),
            "precision_recall": {
                model: np.stack([np.round(100.0 * RECALLS, 9), 100.0 * precision], axis=1).tolist()
                for model, precision in self.precision.items()
            },
            "mean_of_rows": _percent(self.mean_of_rows),
            "mean_intervals": _percent(self.mean_intervals),
            "differences": _percent(self.differences),
        }


def summarise(
    protocol: Protocol, rankings: Mapping[str, Ranking], *, seed: int = SEED
) -> EvaluationResult:
    """Put the rankings of some models into tables, in the models' order.

    Parameters
    ----------
    protocol : Protocol
        Which shapes are queries.
    rankings : Mapping
        By model's name, at least one; all of this protocol.
    seed : int
        Of the bootstrap.

    Returns
    -------
    EvaluationResult
        Of all models.
    """
    models = list(rankings)
    found = {m: [one.measures for one in rankings[m].outcomes] for m in models}
    scores = np.array([[one.average_precision for one in found[m]] for m in models])  # (m, q)
    measures = {m: mean_measures(found[m]) for m in models}
    groups = {} if protocol.leave_one_out else _by_transformation(protocol)
    means = _resampled_means(protocol, scores, groups, seed)
    intervals = {
        name: {m: interval(its.values[i], its.samples[i]) for i, m in enumerate(models)}
        for name, its in means.items()
    }
    return EvaluationResult(
        mean_average_precision={m: measures[m].average_precision for m in models},
        table={name: _means(models, scores, queries) for name, queries in groups.items()},
        by_strength={
            name: {
                strength: _means(models, scores, chosen)
                for strength, chosen in _by_strength(protocol, queries).items()
            }
            for name, queries in groups.items()
        },
        by_label={
            label: {m: mean_measures([found[m][i] for i in queries]) for m in models}
            for label, queries in _by_label(protocol).items()
        },
        measures=measures,
        precision={m: rankings[m].precision for m in models},
        mean_of_rows=intervals.get("mean_of_rows", {}),
        mean_intervals=intervals["mean_average_precision"],
        differences={
            m: {name: difference(its, i, 0) for name, its in means.items()}
            for i, m in enumerate(models)
            if i > 0
        },
    )


def row_order(transformations: Iterable[str]) -> list[str]:
    """Names of transformations in the order of Table 1.

    Parameters
    ----------
    transformations : iterable of str
        In any order, some of them perhaps several times.

    Returns
    -------
    list of str
        Each once; those that are not in Table 1 stand behind, by name.
    """
    known = {name: place for place, name in enumerate(TRANSFORMATIONS)}
    return sorted(set(transformations), key=lambda name: (known.get(name, len(known)), name))


def _by_transformation(protocol: Protocol) -> dict[str, IntArray]:
    """Places of the queries of each transformation, in the order of Table 1."""
    found: dict[str, list[int]] = {}
    for place, query in enumerate(protocol.queries.tolist()):
        found.setdefault(str(protocol.shapes[query].transformation), []).append(place)
    return {name: np.array(found[name]) for name in row_order(found)}


def _by_strength(protocol: Protocol, queries: IntArray) -> dict[int, IntArray]:
    """Those of some queries, by strength; without those that have none."""
    shapes = [protocol.shapes[i] for i in protocol.queries[queries].tolist()]
    strengths = np.array([-1 if shape.strength is None else shape.strength for shape in shapes])
    return {n: queries[strengths == n] for n in np.unique(strengths).tolist() if n >= 0}


def _by_label(protocol: Protocol) -> dict[str, IntArray]:
    """Places of the queries of each label, sorted."""
    classes = protocol.classes[protocol.queries]
    return {protocol.labels[n]: np.flatnonzero(classes == n) for n in np.unique(classes).tolist()}


def _means(models: list[str], scores: FloatArray, queries: IntArray) -> dict[str, float]:
    """Mean score of some queries, by model."""
    return dict(zip(models, scores[:, queries].mean(axis=1).tolist(), strict=True))


def _resampled_means(
    protocol: Protocol, scores: FloatArray, groups: Mapping[str, IntArray], seed: int
) -> dict[str, RowMeans]:
    """Mean over all queries and, where there are rows, mean of the rows; on the same draws."""
    labels = protocol.classes[protocol.queries]
    together = np.zeros_like(labels)
    means = {"mean_average_precision": mean_of_rows(scores, together, labels, seed=seed)}
    if groups:
        rows = np.empty_like(labels)
        for number, queries in enumerate(groups.values()):
            rows[queries] = number
        means["mean_of_rows"] = mean_of_rows(scores, rows, labels, seed=seed)
    return means


def _percent(value: Any) -> Any:
    """Figures of any nesting as plain JSON in per cent; measures under their short names."""
    if isinstance(value, RetrievalMeasures):
        named = asdict(value)
        named["map"] = named.pop("average_precision")
        return _percent(named)
    if isinstance(value, Interval):
        return _percent(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): _percent(inner) for key, inner in value.items()}
    return None if value is None else 100.0 * float(value)
