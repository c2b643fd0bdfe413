"""Bodies of requests that make a model."""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import (
    ConfigDict,
    Field,
    RootModel,
    StringConstraints,
    field_validator,
    model_validator,
)
from pydantic.config import JsonDict

from service.schemas.collections import CollectionName
from service.schemas.jobs import JOB_EXAMPLE, JobAnswer
from service.schemas.models import MODEL_EXAMPLE, ModelAnswer
from service.schemas.text import Answer, Body, Text
from workers.geometry.views import DETAILED_EIGENPAIRS, LONGEST_LOOP, VIEW_NAMES
from workers.retrieval.builtin import HEAT_TIME, SHAPE_DNA_EIGENVALUES
from workers.training.bank import MOST_CHANNELS, POWER
from workers.training.chosen_variants import DEFAULT_CREATURES
from workers.training.learning_options import LearningOptions
from workers.training.request import MOST_CREATURES, MOST_SHAPES, TrainingRequest
from workers.transformations import STRENGTHS, TRANSFORMATIONS

DEFAULTS = LearningOptions()
DEFAULT_VIEWS = ("detailed", "smooth")
Unit = Literal["none", "area", "first-eigenvalue"]
UNIT = "of the eigenvalues: the meshes' own, or whatever makes area or λ₁ 1"
Transformation = Annotated[
    Text,
    StringConstraints(max_length=40),
    Field(json_schema_extra={"enum": list(TRANSFORMATIONS)}),
]
WHAT_GOES_TOGETHER: JsonDict = {
    "anyOf": [
        {"properties": {"correspondence": {"const": "simulated"}}},
        {
            "required": ["correspondence", "collection"],
            "properties": {
                "collection": {"type": "string"},
                "strengths": {"type": "null"},
                "transformations": {"maxItems": 0},
            },
        },
    ]
}


class ViewParameters(Body):
    """How shapes are prepared before their spectrum is computed."""

    view: Literal["closed", "open"] = Field(
        "closed",
        description="`closed` fills every boundary loop whose length p has p²/area at most "
        f"{LONGEST_LOOP:g}, and glues the mirror image on a mesh with a longer one; `open` does "
        "neither",
    )


class HeatParameters(ViewParameters):
    """K²(λ) = exp(-2tλ)."""

    time: float = Field(HEAT_TIME, gt=0, description="t, in the inverse unit of λ")
    unit: Unit = Field("first-eigenvalue", description=UNIT)


class CommuteTimeParameters(ViewParameters):
    """K²(λ) = 1/λ; its distances have no unit, so the unit changes no ranking."""

    unit: Unit = Field("area", description=UNIT)


class ShapeDnaParameters(ViewParameters):
    """Logarithms of the first eigenvalues at area 1."""

    eigenvalues: int = Field(SHAPE_DNA_EIGENVALUES, ge=1, le=100, description="how many")


class LearningParameters(ViewParameters):
    """What all methods have that learn one kernel."""

    criterion: Literal["kernel", "distance"] = Field(
        DEFAULTS.criterion,  # type: ignore[arg-type]
        description="what should change least under the transformations: k(x,x'), eq. (7), or "
        "d²(x,x')",
    )
    unit: Unit = Field(DEFAULTS.unit, description=UNIT)  # type: ignore[arg-type]
    margin: float = Field(
        DEFAULTS.margin,
        ge=1,
        le=100,
        description="K² goes on by this factor beyond the eigenvalues learned from",
    )


class SplineParameters(LearningParameters):
    """K² in splines of ln λ, eqs. (11) to (13)."""

    splines: int | None = Field(
        DEFAULTS.splines,
        ge=4,
        le=500,
        description="how many, q; by default so many that knots are a factor e apart",
    )
    smoothness: float = Field(
        DEFAULTS.smoothness, ge=0, le=1e6, description="η as a share of trace(P)/trace(R)"
    )
    nonnegative: bool = Field(
        DEFAULTS.nonnegative,
        description="true: K² is at least 0 by its coefficients; false: the closed form of eq. "
        "(13), set to 0 where it is negative",
    )


class GridParameters(LearningParameters):
    """K² at the points of a grid in ln λ, eq. (10)."""

    points: int = Field(DEFAULTS.points, ge=2, le=500, description="of the grid, r")
    interpolation: Literal["nearest", "linear"] = DEFAULTS.interpolation  # type: ignore[assignment]


class BankParameters(Body):
    """Channels chosen among kernels, eigenvalues, points and area, fused by Σ w (D/s)^p."""

    views: list[Literal["closed", "open", "smooth", "smooth-open", "detailed"]] = Field(
        list(DEFAULT_VIEWS),  # type: ignore[arg-type]
        min_length=1,
        max_length=len(VIEW_NAMES),
        json_schema_extra={"uniqueItems": True},
        description="how shapes are prepared: `closed` and `open` as for one kernel, `smooth` and "
        "`smooth-open` the same smoothed, `detailed` as `closed` with "
        f"{DETAILED_EIGENPAIRS} eigenpairs instead of 100. Every candidate channel is tried under "
        "each; a view that no channel needs is dropped",
    )
    power: float = Field(POWER, gt=0, le=1, description="p; at most 1 keeps the sum a metric")
    channels: int = Field(MOST_CHANNELS, ge=4, le=200, description="at most so many are chosen")

    @field_validator("views")
    @classmethod
    def _each_once(cls, views: list[str]) -> list[str]:
        if len(set(views)) < len(views):
            raise ValueError(f"the views are {', '.join(views)}, expected each at most once")
        return views


class Training(Body):
    """What to learn from; the seed decides every choice, so the same request learns the same."""

    model_config = ConfigDict(json_schema_extra=WHAT_GOES_TOGETHER)

    collection: CollectionName | None = Field(
        None, description="learn from its shapes; from procedural creatures if left out"
    )
    transformations: list[Transformation] = Field(
        default_factory=list,
        max_length=100,
        description=f"each is applied to every shape: {', '.join(TRANSFORMATIONS)}; leave them "
        "out with `vertex-order`",
    )
    strengths: list[Annotated[int, Field(ge=min(STRENGTHS), le=max(STRENGTHS))]] | None = Field(
        None, min_length=1, max_length=100, description="of each transformation; all if left out"
    )
    correspondence: Literal["simulated", "vertex-order"] = Field(
        "simulated",
        description="`simulated`: transformations are applied here; `vertex-order`: shapes of one "
        "label have the same vertices in the same order, each a transformation of the others",
    )
    seed: int = Field(0, ge=0, le=2**31 - 1)
    shapes: int | None = Field(
        None,
        ge=2,
        le=1000,
        description=f"at most so many, spread evenly over the labels; {MOST_CREATURES} creatures "
        f"or {MOST_SHAPES} shapes of a collection if left out",
    )

    @model_validator(mode="after")
    def _no_strengths_of_nothing(self) -> "Training":
        if self.correspondence == "vertex-order" and self.strengths is not None:
            raise ValueError("with 'vertex-order' nothing is simulated, so there are no strengths")
        return self

    def to_request(self) -> TrainingRequest:
        """Return the request as the planning of the training takes it."""
        return TrainingRequest(
            collection=self.collection,
            transformations=tuple(self.transformations),
            strengths=STRENGTHS if self.strengths is None else tuple(self.strengths),
            correspondence=self.correspondence,
            seed=self.seed,
            shapes=self.shapes,
        )


class BankTraining(Training):
    """What a bank learns from: creatures, a collection, or both; it needs no correspondences."""

    correspondence: Literal["simulated", "vertex-order"] = Field(
        "simulated",
        description="a bank simulates all of its transformations",
        json_schema_extra={"enum": ["simulated"]},
    )
    creatures: int | None = Field(
        None,
        ge=0,
        le=1000,
        description="so many procedural creatures, beside the shapes of a collection or alone; "
        f"if left out, none with a collection and {DEFAULT_CREATURES} without one",
    )

    def to_request(self) -> TrainingRequest:
        """Return the request as the planning of the training takes it."""
        return replace(super().to_request(), creatures=self.creatures)


class _Untrained(Body):
    name: CollectionName
    training: None = Field(None, description="nothing is trained")


class NewHeat(_Untrained):
    """The heat kernel at a given time."""

    method: Literal["heat"]
    parameters: HeatParameters = Field(default_factory=HeatParameters)


class NewCommuteTime(_Untrained):
    """The commute-time kernel."""

    method: Literal["commute-time"]
    parameters: CommuteTimeParameters = Field(default_factory=CommuteTimeParameters)


class NewBiharmonic(_Untrained):
    """The biharmonic kernel."""

    method: Literal["biharmonic"]
    parameters: ViewParameters = Field(default_factory=ViewParameters)


class NewShapeDna(_Untrained):
    """The eigenvalues themselves, as in ShapeDNA."""

    method: Literal["shape-dna"]
    parameters: ShapeDnaParameters = Field(default_factory=ShapeDnaParameters)


class _Trained(Body):
    name: CollectionName
    training: Training = Field(default_factory=Training)


class NewHeatTime(_Trained):
    """The heat kernel at the time that minimises the criterion."""

    method: Literal["heat-time"]
    parameters: LearningParameters = Field(default_factory=LearningParameters)


class NewSpline(_Trained):
    """A kernel in splines."""

    method: Literal["spline"]
    parameters: SplineParameters = Field(default_factory=SplineParameters)


class NewGrid(_Trained):
    """A kernel on a grid."""

    method: Literal["grid"]
    parameters: GridParameters = Field(default_factory=GridParameters)


class NewBank(_Trained):
    """Channels chosen and weighted so that a changed copy finds its own shape first."""

    method: Literal["bank"]
    parameters: BankParameters = Field(default_factory=BankParameters)
    training: BankTraining = Field(default_factory=BankTraining)


Untrained = NewHeat | NewCommuteTime | NewBiharmonic | NewShapeDna
Learned = NewHeatTime | NewSpline | NewGrid
CREATURES: JsonDict = {"transformations": ["isometry", "noise", "holes"], "strengths": [1, 3, 5]}
NEW_MODEL_EXAMPLES: list[JsonDict] = [
    {
        "name": "learned",
        "method": "spline",
        "parameters": {"splines": 12, "smoothness": 1e-10},
        "training": {"collection": None, **CREATURES, "seed": 0},
    },
    {
        "name": "gridded",
        "method": "grid",
        "parameters": {"points": 30, "interpolation": "linear", "criterion": "kernel"},
        "training": {"collection": "zoo", "transformations": ["scale"], "strengths": [1, 2, 3]},
    },
    {
        "name": "best-time",
        "method": "heat-time",
        "training": {"collection": "zoo", "correspondence": "vertex-order", "shapes": 20},
    },
    {
        "name": "bank-of-mine",
        "method": "bank",
        "parameters": {"views": ["detailed", "smooth"], "channels": 16},
        "training": {"collection": "zoo", "creatures": 20, **CREATURES},
    },
    {"name": "short-heat", "method": "heat", "parameters": {"time": 0.05}},
    {"name": "open-commute-time", "method": "commute-time", "parameters": {"view": "open"}},
    {"name": "open-biharmonic", "method": "biharmonic", "parameters": {"view": "open"}},
    {"name": "dna-40", "method": "shape-dna", "parameters": {"eigenvalues": 40}},
]


class NewModel(RootModel[Annotated[Untrained | Learned | NewBank, Field(discriminator="method")]]):
    """A model to make; one with nothing to learn is ready at once."""

    model_config = ConfigDict(json_schema_extra={"examples": list(NEW_MODEL_EXAMPLES)})


class ModelAccepted(Answer):
    """The model that was made, and the job that trains it."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "model": MODEL_EXAMPLE,
                    "job": {
                        **JOB_EXAMPLE,
                        "kind": "train",
                        "progress": {"done": 18, "total": 180, "unit": "pairs"},
                        "errors": [],
                        "collection": None,
                        "model": "learned",
                    },
                }
            ]
        }
    )

    model: ModelAnswer
    job: JobAnswer
