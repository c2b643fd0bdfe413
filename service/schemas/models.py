"""Bodies of models."""

from datetime import datetime
from typing import Any, Literal

from pydantic import ConfigDict, Field
from pydantic.config import JsonDict

from service.schemas.pages import time_from
from service.schemas.text import Answer
from workers.retrieval.kernel_curves import kernel_curves
from workers.retrieval.model import Model
from workers.storage.trained_models import READY, ModelView

ModelState = Literal["training", "ready", "failed"]
MODEL_EXAMPLE: JsonDict = {
    "name": "heat",
    "method": "heat",
    "state": "ready",
    "parameters": {"time": 0.15},
    "channels": [
        {
            "name": "distances",
            "view": "closed",
            "kernel": {"kind": "heat", "parameters": {"time": 0.15}},
            "feature": "distance-distribution",
            "normalisation": "first-eigenvalue",
            "edges": [0.0, 0.5, 1.0],
            "dissimilarity": "l1",
            "scale": 1.0,
            "weight": 1.0,
        }
    ],
    "views": [
        {
            "name": "closed",
            "steps": [{"name": "simplify", "parameters": {"vertices": 5000.0}}],
            "eigenpairs": 100,
        }
    ],
    "fusion": {"power": 1.0},
    "versions": {"solver": "1"},
    "kernels": [
        {
            "name": "distances",
            "kind": "heat",
            "eigenvalues": [1.0, 2.0],
            "squared_transfer": [0.74, 0.55],
            "parameters": {"time": 0.15},
        }
    ],
    "training": None,
    "created_at": "2026-03-01T09:30:00Z",
}


class ChannelAnswer(Answer):
    """One vector of a descriptor, and how two of them are compared."""

    model_config = ConfigDict(extra="allow")

    name: str
    view: str
    kernel: dict[str, Any] | None
    feature: str
    normalisation: str
    edges: list[float] | None = Field(None, description="bounds of a histogram's bins")
    levels: list[float] | None = Field(
        None,
        description="levels of quantiles, numbers of eigenvalues, or multiples of a point's time",
    )
    dissimilarity: str
    scale: float
    weight: float


class StepAnswer(Answer):
    """One step of a view."""

    name: str
    parameters: dict[str, float]


class ViewAnswer(Answer):
    """How a mesh is prepared before its spectrum is computed, step by step."""

    name: str
    steps: list[StepAnswer]
    eigenpairs: int


class Fusion(Answer):
    """Distance = sum over channels of weight * (dissimilarity / scale) ** power.

    Where a channel of `roughness` finds a query rough, the channels of its view weigh less, and
    the others as much more.
    """

    power: float


class KernelAnswer(Answer):
    """A channel's transfer function K², to be drawn."""

    name: str
    kind: str
    eigenvalues: list[float] = Field(description="in the unit of the channel's normalisation")
    squared_transfer: list[float]
    parameters: dict[str, Any]


class ModelAnswer(Answer):
    """How shapes are described and compared; immutable once it is ready."""

    model_config = ConfigDict(json_schema_extra={"examples": [MODEL_EXAMPLE]})

    name: str
    method: str
    state: ModelState
    parameters: dict[str, Any]
    views: list[ViewAnswer] = Field(description="the preparations that channels name")
    channels: list[ChannelAnswer]
    fusion: Fusion
    versions: dict[str, str] = Field(description="what its descriptors depend on")
    kernels: list[KernelAnswer]
    training: dict[str, Any] | None = Field(
        description="what it learns from, and then the report; of a kernel: the criterion of this "
        "and other kernels on the classes learned from and on those held out, t*, the slope of "
        "ln K², the range learned from, pairs that failed; of a bank: rows on the groups learned "
        "from and on those held out, the ablation of each channel, how similarity kept its word, "
        "variants that failed"
    )
    created_at: datetime


def answer_model(view: ModelView) -> ModelAnswer:
    """Convert a row; one that is not ready has no channels yet."""
    row, definition = view.row, view.row.definition
    ready = view.state == READY
    return ModelAnswer.model_validate(
        {
            "name": row.name,
            "method": row.method,
            "state": view.state,
            "parameters": definition.get("parameters", {}),
            "views": definition.get("views", []),
            "channels": definition.get("channels", []),
            "fusion": definition.get("fusion", {"power": 1.0}),
            "versions": definition.get("versions", {}),
            "kernels": list(_kernels(definition)) if ready else [],
            "training": definition.get("training"),
            "created_at": time_from(row.created_at),
        }
    )


def _kernels(definition: dict[str, Any]) -> list[KernelAnswer]:
    return [
        KernelAnswer(
            name=curve.name,
            kind=curve.kind,
            eigenvalues=curve.eigenvalues.tolist(),
            squared_transfer=curve.squared_transfer.tolist(),
            parameters=dict(curve.parameters),
        )
        for curve in kernel_curves(Model.from_json(definition))
    ]
