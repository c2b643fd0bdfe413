"""Ranks and measures of each query of an evaluation."""

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
    """What one query has under one model.

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
    """Outcomes of a protocol's queries under one model, in their order.

    ``precision`` (21,) is the mean over them of the interpolated precision at `RECALLS`.
    """

    outcomes: tuple[QueryOutcome, ...]
    precision: FloatArray

    def to_json(self) -> dict[str, Any]:
        """Everything that `from_json` needs; floats keep all of their bits.

        Returns
        -------
        dict
            Plain JSON.
        """
        return {
            "outcomes": [
                [list(astuple(one.measures)), one.rank, list(one.top)] for one in self.outcomes
            ],
            "precision": self.precision.tolist(),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Ranking":
        """Return the ranking that `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        Ranking
            With the same bits.
        """
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
    """Rank the targets for every query, one after the other: memory is that of one row.

    Parameters
    ----------
    protocol : Protocol
        Which shapes are queries and targets.
    distances : callable
        From the place of a query in ``protocol.queries`` to its distances (m,) from all of
        ``protocol.targets``; for a matrix (q, m) its ``__getitem__``. Ties go to the lower id.
    places : range, optional
        Of the queries that are ranked, at least one; all by default.

    Returns
    -------
    Ranking
        In the order of the places.
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


def join_rankings(rankings: Sequence[Ranking]) -> Ranking:
    """Ranking of all queries from rankings of some of them.

    Parameters
    ----------
    rankings : sequence of Ranking
        At least one, in the order of the queries.

    Returns
    -------
    Ranking
        Of all of them; the very one that was given, if it was one.
    """
    if len(rankings) == 1:
        return rankings[0]
    outcomes = tuple(outcome for one in rankings for outcome in one.outcomes)
    total = sum((len(one.outcomes) * one.precision for one in rankings), np.zeros(len(RECALLS)))
    return Ranking(outcomes, read_only(total / len(outcomes), np.float64))
