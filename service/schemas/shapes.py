"""Bodies of shapes, and of what was computed of them."""

from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict, Field, field_validator
from pydantic.config import JsonDict

from service.schemas.jobs import JOB_EXAMPLE, JobAnswer
from service.schemas.pages import time_from
from service.schemas.text import Answer, Body, Label, Metadata, Name
from workers.retrieval.channels import Axis
from workers.storage.shapes import ShapeView

ShapeState = Literal["queued", "processing", "ready", "failed"]
SHAPE_EXAMPLE: JsonDict = {
    "id": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c",
    "collection": "zoo",
    "name": "cat.holes.3.off",
    "path": "animals/cat.holes.3.off",
    "label": "cat",
    "transformation": "holes",
    "strength": 3,
    "metadata": {"scanner": "A", "year": 2025},
    "sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    "format": "off",
    "n_vertices": 27894,
    "n_faces": 55712,
    "area": 1.83,
    "n_components": 1,
    "n_boundary_loops": 3,
    "repairs": ["merged 512 duplicate vertices"],
    "found": ["vertex colours"],
    "state": "ready",
    "error": None,
    "created_at": "2026-03-01T09:30:00Z",
}

NOT_YET_KNOWN: JsonDict = {
    **{"state": "queued", "format": None, "n_vertices": None, "n_faces": None, "area": None},
    **{"n_components": None, "n_boundary_loops": None, "repairs": [], "found": []},
}
COPIED = (
    *("id", "name", "path", "label", "transformation", "strength", "sha256", "format"),
    *("n_vertices", "n_faces", "area", "n_components", "n_boundary_loops", "repairs", "found"),
)


class ShapeError(Answer):
    """Why a shape could not be computed."""

    type: str = Field(examples=["invalid-mesh"])
    detail: str


class ShapeAnswer(Answer):
    """A mesh in a collection, and what was computed of it."""

    model_config = ConfigDict(json_schema_extra={"examples": [SHAPE_EXAMPLE]})

    id: str
    collection: str
    name: str
    path: str = Field(
        description="where it lay: the folders of its file name, or those within its archive, and "
        "its name; a shape that is renamed keeps it"
    )
    label: str | None
    transformation: str | None
    strength: int | None
    metadata: dict[str, Any]
    sha256: str = Field(
        description="of the file as it was uploaded; of the GLB that a glTF file and the files it "
        "refers to were joined to"
    )
    format: str | None = Field(description="by the file's content; null until it was read")
    n_vertices: int | None
    n_faces: int | None
    area: float | None = Field(description="in the file's unit, squared")
    n_components: int | None
    n_boundary_loops: int | None
    repairs: list[str] = Field(
        description="what reading and cleaning did, and what was unusual in solving"
    )
    found: list[str] = Field(description="what else the file holds and what is left alone")
    state: ShapeState
    error: ShapeError | None
    created_at: datetime


class ShapeChange(Body):
    """What is to change; a field that is left out stays as it is."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"label": "cat", "metadata": {"scanner": "B"}}]}
    )

    label: Label | None = Field(None, description="null removes it")
    metadata: Metadata | None = Field(None, description="replaces all of it; null empties it")
    name: Name = Field("", validate_default=False)


class UploadFields(Body):
    """Texts that go with uploaded files, for all of them."""

    label: Label | None = None
    metadata: Metadata | None = None
    labels_from_folders: bool = True

    @field_validator("labels_from_folders", mode="before")
    @classmethod
    def _true_or_false(cls, value: object) -> object:
        if isinstance(value, str) and value not in {"true", "false"}:
            raise ValueError(f"expected true or false, found {value[:20]!r}")
        return value


class UploadAnswer(Answer):
    """The job that computes an upload, and its shapes. Shapes of a zip appear during the job."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "job": JOB_EXAMPLE,
                    "shapes": [{**SHAPE_EXAMPLE, **NOT_YET_KNOWN}],
                }
            ]
        }
    )

    job: JobAnswer
    shapes: list[ShapeAnswer]


class SpectrumAnswer(Answer):
    """Nonzero Laplace-Beltrami eigenvalues of the shape's working mesh, the smallest first."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "eigenvalues": [1.92, 4.07, 5.31],
                    "area": 1.83,
                    "unit": "u is the file's unit of length: area in u², eigenvalues in 1/u²",
                }
            ]
        }
    )

    eigenvalues: list[float]
    area: float
    unit: str


class DistributionAxis(Answer):
    """Where the values of a distribution stand."""

    kind: Literal["edges", "levels", "index", "times"] = Field(
        description="`edges` of bins (one more than values), quantile `levels`, the `index` of an "
        "eigenvalue, or the `times` of ln k(x,x) at a point, of which the values have one after "
        "the other"
    )
    values: list[float]


class DistributionAnswer(Answer):
    """One channel of a shape's descriptor: what the search compares."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "shape_id": SHAPE_EXAMPLE["id"],
                    "model": "heat",
                    "channel": "distances",
                    "feature": "distance-distribution",
                    "normalisation": "first-eigenvalue",
                    "axis": {"kind": "edges", "values": [0.0, 0.5, 1.0]},
                    "values": [0.62, 0.38],
                }
            ]
        }
    )

    shape_id: str
    model: str
    channel: str
    feature: str
    normalisation: str
    axis: DistributionAxis
    values: list[float]


def answer_shape(view: ShapeView) -> ShapeAnswer:
    """Convert a row."""
    return ShapeAnswer.model_validate(
        {
            **{name: getattr(view.row, name) for name in COPIED},
            "collection": view.collection,
            "metadata": view.row.attributes,
            "state": view.state,
            "error": view.row.error if view.state == "failed" else None,
            "created_at": time_from(view.row.created_at),
        }
    )


def answer_axis(axis: Axis) -> DistributionAxis:
    """Convert where a channel's values stand."""
    return DistributionAxis(kind=axis.kind, values=list(axis.values))
