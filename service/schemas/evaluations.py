"""Bodies of evaluations."""

from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict, Field, field_validator
from pydantic.config import JsonDict

from service.schemas.collections import CollectionName, ModelName
from service.schemas.jobs import JOB_EXAMPLE, JobAnswer, JobState
from service.schemas.pages import time_from
from service.schemas.queries import DissimilarityName
from service.schemas.text import Answer, Body
from workers.storage.evaluations import EvaluationView

MAX_MODELS = 20
HEAT: JsonDict = {
    "nearest_neighbour": 81.0,
    "first_tier": 81.0,
    "second_tier": 90.0,
    "e_measure": 5.2,
    "dcg": 88.3,
    "map": 84.6,
}
EVALUATION_EXAMPLE: JsonDict = {
    "id": "0199b1c6-2f3a-7d41-8a5e-0c1d2e3f4a5b",
    "job_id": "0199b1c6-2f39-7c02-9e1d-6b5a4c3d2e1f",
    "collection": "shrec",
    "models": ["heat", "commute-time"],
    "dissimilarity": None,
    "state": "succeeded",
    "n_queries": 715,
    "n_targets": 469,
    "leave_one_out": False,
    "mean_average_precision": {"heat": 84.6, "commute-time": 88.1},
    "table": {
        "isometry": {"heat": 99.2, "commute-time": 98.7},
        "holes": {"heat": 70.0, "commute-time": 77.5},
    },
    "by_strength": {
        "isometry": {"1": {"heat": 99.2, "commute-time": 98.7}},
        "holes": {"1": {"heat": 70.0, "commute-time": 77.5}},
    },
    "by_label": {"cat": {"heat": HEAT, "commute-time": {**HEAT, "map": 88.1}}},
    "measures": {"heat": HEAT, "commute-time": {**HEAT, "map": 88.1}},
    "precision_recall": {
        "heat": [[0.0, 84.6], [100.0, 84.6]],
        "commute-time": [[0.0, 88.1], [100.0, 88.1]],
    },
    "mean_of_rows": {
        "heat": {"value": 84.6, "low": 71.9, "high": 94.0},
        "commute-time": {"value": 88.1, "low": 77.4, "high": 96.2},
    },
    "mean_intervals": {
        "heat": {"value": 84.6, "low": 71.9, "high": 94.0},
        "commute-time": {"value": 88.1, "low": 77.4, "high": 96.2},
    },
    "differences": {
        "commute-time": {
            "mean_of_rows": {"value": 3.5, "low": -0.4, "high": 8.1},
            "mean_average_precision": {"value": 3.5, "low": -0.4, "high": 8.1},
        }
    },
    "skipped": [
        {
            "reason": "no-relevant-target",
            "count": 1,
            "shapes": [{"id": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c", "name": "dog.holes.3.off"}],
        }
    ],
    "ranks": [
        {
            "query": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c",
            "model": "heat",
            "rank": 2,
            "top": [
                "0199b1c4-7a11-7d2e-9c3b-5a6b7c8d9e0f",
                "0199b1c4-7a12-7e3f-8d4c-6b7c8d9e0f1a",
            ],
        }
    ],
    "created_at": "2026-03-01T09:30:00Z",
}
COPIED = ("id", "job_id", "collection", "models", "dissimilarity")
ByModel = dict[str, float]


class NewEvaluation(Body):
    """Models to measure on a collection."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"collection": "shrec", "models": ["heat", "commute-time"]},
                {"collection": "shrec", "models": ["heat"], "dissimilarity": "chi-squared"},
            ]
        }
    )

    collection: CollectionName
    models: list[ModelName] = Field(
        min_length=1,
        max_length=MAX_MODELS,
        json_schema_extra={"uniqueItems": True},
        description="each once; the first is the one that others are compared with",
    )
    dissimilarity: DissimilarityName | None = Field(
        None, description="compares all channels by this one instead of each by its own"
    )

    @field_validator("models")
    @classmethod
    def _each_once(cls, models: list[str]) -> list[str]:
        if len(set(models)) < len(models):
            raise ValueError("must name each model once")
        return models


class Interval(Answer):
    """A figure and its 95 % interval: percentiles of 2,000 bootstrap resamplings of labels."""

    value: float
    low: float | None = Field(description="null where all queries are of one label")
    high: float | None


class Differences(Answer):
    """How much better a model is than the first one, on the same resamplings of labels."""

    mean_of_rows: Interval | None = None
    mean_average_precision: Interval


class Measures(Answer):
    """Means over queries, as in the Princeton Shape Benchmark; the query is not in its list."""

    nearest_neighbour: float
    first_tier: float
    second_tier: float
    e_measure: float
    dcg: float
    map: float


class SkippedShape(Answer):
    """A shape that was no query."""

    id: str
    name: str


class Skipped(Answer):
    """Shapes that could have been queries and were none."""

    reason: Literal["failed", "no-label", "no-relevant-target", "not-described"] = Field(
        description="`failed` in its computation; has no label; no target has its label; could "
        "not be described under every model, or was deleted"
    )
    count: int
    shapes: list[SkippedShape] = Field(description="the first hundred")


class QueryRank(Answer):
    """What a query found under a model."""

    query: str = Field(description="id of the query's shape")
    model: str
    rank: int = Field(description="of the first relevant target, from 1")
    top: list[str] = Field(description="ids of the first ten targets")


class EvaluationAnswer(Answer):
    """Models measured on the same queries and targets; all figures in per cent.

    Until the state is `succeeded` there are no figures: counts are null, tables empty.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [EVALUATION_EXAMPLE]})

    id: str
    job_id: str
    collection: str
    models: list[str]
    dissimilarity: str | None = Field(description="null: each channel by its own")
    state: JobState
    n_queries: int | None = None
    n_targets: int | None = None
    leave_one_out: bool | None = Field(
        None,
        description="true where no shape is transformed: each labelled one is a query against the "
        "rest, and there is no table",
    )
    mean_average_precision: ByModel = Field(
        default_factory=dict, description="by model, over all queries"
    )
    table: dict[str, ByModel] = Field(
        default_factory=dict,
        description="mean average precision by transformation and model: Table 1. `all` is the "
        "transformation of that name, no mean",
    )
    by_strength: dict[str, dict[str, ByModel]] = Field(
        default_factory=dict, description="the same by transformation, strength and model"
    )
    by_label: dict[str, dict[str, Measures]] = Field(
        default_factory=dict, description="measures by label and model"
    )
    measures: dict[str, Measures] = Field(
        default_factory=dict, description="by model, over all queries"
    )
    precision_recall: dict[str, list[tuple[float, float]]] = Field(
        default_factory=dict,
        description="by model: recall and mean interpolated precision at 21 recalls",
    )
    mean_of_rows: dict[str, Interval] = Field(
        default_factory=dict, description="by model: mean of the rows of `table`, each alike"
    )
    mean_intervals: dict[str, Interval] = Field(
        default_factory=dict, description="by model: how sure `mean_average_precision` is"
    )
    differences: dict[str, Differences] = Field(
        default_factory=dict, description="by model but the first"
    )
    skipped: list[Skipped] = Field(default_factory=list, description="by reason")
    ranks: list[QueryRank] = Field(
        default_factory=list, description="a query and model each; left out, so empty, in lists"
    )
    created_at: datetime


class EvaluationAccepted(Answer):
    """An evaluation, and the job that makes it."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "evaluation": EVALUATION_EXAMPLE,
                    "job": {**JOB_EXAMPLE, "kind": "evaluate", "collection": "shrec"},
                }
            ]
        }
    )

    evaluation: EvaluationAnswer
    job: JobAnswer


def answer_evaluation(view: EvaluationView, *, with_ranks: bool) -> EvaluationAnswer:
    """Convert a row; ranks are read only if they are wanted."""
    ranks: list[Any] = (view.row.ranks or []) if with_ranks else []
    return EvaluationAnswer.model_validate(
        {
            **{name: getattr(view.row, name) for name in COPIED},
            **(view.row.result or {}),
            "state": view.state,
            "ranks": ranks,
            "created_at": time_from(view.row.created_at),
        }
    )
