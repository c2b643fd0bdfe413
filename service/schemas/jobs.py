"""Bodies of jobs."""

from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict, Field
from pydantic.config import JsonDict

from service.schemas.pages import time_from, time_or_none
from service.schemas.text import Answer
from workers.storage.models import Job

JobKind = Literal["ingest", "query", "train", "describe", "evaluate", "prune", "correspondence"]
JobState = Literal["queued", "running", "succeeded", "failed", "cancelled"]
COPIED = (
    *("id", "kind", "state", "step", "errors", "skipped", "skipped_count", "attempts"),
    *("collection", "model", "result", "seconds_left"),
)
JOB_EXAMPLE: JsonDict = {
    "id": "0199b1c4-7a11-7d2e-9c3b-5a6b7c8d9e0f",
    "kind": "ingest",
    "state": "running",
    "step": None,
    "seconds_left": 14.5,
    "progress": {"done": 8, "total": 12, "unit": "shapes"},
    "errors": [
        {
            "item": "table.obj",
            "type": "invalid-mesh",
            "detail": "face 17 refers to vertex 99, but the mesh has 42 vertices",
        }
    ],
    "skipped": [{"item": "zoo/preview.png", "detail": "picture"}],
    "skipped_count": 1,
    "attempts": 1,
    "collection": "zoo",
    "model": None,
    "result": None,
    "created_at": "2026-03-01T09:30:00Z",
    "started_at": "2026-03-01T09:30:01Z",
    "finished_at": None,
}


class Progress(Answer):
    """How far a job is."""

    done: int
    total: int
    unit: str


class JobError(Answer):
    """An item of a job that failed; the rest goes on."""

    item: str
    type: str
    detail: str


class JobSkipped(Answer):
    """A file of an upload that is no mesh, and in short what it is."""

    item: str
    detail: str


class JobAnswer(Answer):
    """Work that takes longer than a request, in parts."""

    model_config = ConfigDict(json_schema_extra={"examples": [JOB_EXAMPLE]})

    id: str
    kind: JobKind
    state: JobState
    progress: Progress
    step: str | None = Field(
        description="what is done now: `reading`, `simplifying`, `spectrum`, `describing` of a "
        "mesh; `matching` of two; `transforming`, `learning`, `searching`, `measuring`; null if "
        "the job does several things at once, or has ended"
    )
    seconds_left: float | None = Field(
        description="how long it will still take, as estimated when something was done last; null "
        "where that cannot be told"
    )
    errors: list[JobError] = Field(description="the first thousand")
    skipped: list[JobSkipped] = Field(
        description="files beside the meshes of an upload that were left alone; the first thousand"
    )
    skipped_count: int = Field(description="how many those are; `progress` does not count them")
    attempts: int = Field(description="most often that a part of it was begun")
    collection: str | None
    model: str | None
    result: dict[str, Any] | None = Field(
        description="what it found out, where that is stored nowhere else: what a `prune` freed"
    )
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None


class JobAccepted(Answer):
    """The new job, or the one that does this already."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"job": JOB_EXAMPLE}]})

    job: JobAnswer


def answer_job(row: Job) -> JobAnswer:
    """Convert a row."""
    return JobAnswer.model_validate(
        {
            **{name: getattr(row, name) for name in COPIED},
            "progress": {"done": row.done, "total": row.total, "unit": row.unit},
            "created_at": time_from(row.created_at),
            "started_at": time_or_none(row.started_at),
            "finished_at": time_or_none(row.finished_at),
        }
    )
