"""What every query of an evaluation found: ranks and measures, query by query."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from workers.geometry.arrays import FloatArray, read_only
from workers.retrieval.measures import (
    RetrievalMeasures,
    precision_at_recall,
    retrieval_measures,
)
from workers.retrieval.protocol import Protocol

RECALLS: FloatArray = read_only(np.linspace(0.0, 1.0, 21), np.float64)
TOP = 10


@dataclass(frozen=True)
class QueryOutcome:
    """What one query found under one model.

    Attributes
    ----------
    measures : RetrievalMeasures
    rank : int
        Of the first relevant target, from 1.
    top : tuple of str
        Ids of the first ten targets.
    """

    measures: RetrievalMeasures
    rank: int
    top: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Ranking:
    """What queries of a protocol found under one model, in their order.

    ``precision`` (21,) is the mean over them of the interpolated precision at `RECALLS`.
    """

    outcomes: tuple[QueryOutcome, ...]
    precision: FloatArray

    def to_json(self) -> dict[str, Any]:
        """Everything that `from_json` needs, as plain JSON; floats keep all of their bits."""
        return {
            "outcomes": [
                [list(astuple(one.measures)), one.rank, list(one.top)] for one in self.outcomes
            ],
            "precision": self.precision.tolist(),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Ranking":
        """Return the ranking that `to_json` wrote."""
        return cls(
            tuple(
                QueryOutcome(RetrievalMeasures(*measures), rank, tuple(top))
                for measures, rank, top in value["outcomes"]
            ),
            read_only(value["precision"], np.float64),
        )


def rank_queries(
    protocol: Protocol, distances: Callable[[int], FloatArray], *, places: range | None = None
) -> Ranking:
    """Ask with every query, one after the other: memory is that of one row of distances.

    Parameters
    ----------
    protocol : Protocol
    distances : callable
        From the place of a query in ``protocol.queries`` to its distances (m,) from all of
        ``protocol.targets``; for a matrix (q, m) its ``__getitem__``. Ties go to the lower id.
    places : range, optional
        Of the queries to ask with, at least one; all by default.

    Returns
    -------
    Ranking
    """
    outcomes = []
    precision = np.zeros(len(RECALLS))
    for place in range(len(protocol.queries)) if places is None else places:
        query = int(protocol.queries[place])
        order = protocol.targets[np.argsort(distances(place), kind="stable")]  # (m,)
        order = order[order != query]
        relevant = protocol.classes[order] == protocol.classes[query]
        outcomes.append(
            QueryOutcome(
                retrieval_measures(relevant),
                int(np.argmax(relevant)) + 1,
                tuple(protocol.shapes[i].id for i in order[:TOP].tolist()),
            )
        )
        precision += precision_at_recall(relevant, recalls=RECALLS)
    return Ranking(tuple(outcomes), read_only(precision / len(outcomes), np.float64))


def join_rankings(parts: Sequence[Ranking]) -> Ranking:
    """Ranking of all queries from those of some at a time, in their order; at least one."""
    if len(parts) == 1:
        return parts[0]
    outcomes = tuple(outcome for part in parts for outcome in part.outcomes)
    total = sum((len(part.outcomes) * part.precision for part in parts), np.zeros(len(RECALLS)))
    return Ranking(outcomes, read_only(total / len(outcomes), np.float64))
