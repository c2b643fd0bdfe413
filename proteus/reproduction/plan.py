"""The plan of a reproduction: what is made, trained and measured."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from proteus.benchmark.plan import BenchmarkOptions
from workers.errors import InvalidRequestError
from workers.transformations import PAPER_TRANSFORMATIONS, TRANSFORMATION_VERSION

SHORT, LONG = 0.7, 1.7
"""The paper's other two times, 700 and 1700, as shares of its best, 1011."""
FINE = 60
"""Points and splines of Fig. 1: enough to show the effect of smoothness."""
SMOOTHNESS = 1e-5
"""Of Fig. 1."""
RANGE = {"margin": 4.0}
"""K² goes on beyond the eigenvalues learned from by this factor."""
SPLINES: Mapping[str, Any] = {**RANGE, "smoothness": 1e-10, "nonnegative": True}
"""Of every other kernel in splines. All options are sent, so that a model's name, which is made
from them, says what it was learned with."""
OPEN, CLOSED = "open", "closed"


@dataclass(frozen=True)
class Size:
    """The size of a reproduction.

    Attributes
    ----------
    creatures, distractors : int
        Number of query classes and of other targets, where no null shapes are given.
    creature_vertices : int
    working_vertices : int
        Of a service that is started for it.
    strengths : tuple of int
        Of the queries.
    training_shapes : int
        Number of creatures to learn from, of other species than the queries.
    training_strengths : tuple of int
    transformations : tuple of str
        Of queries and training alike; "scale" is among them.
    """

    creatures: int
    distractors: int
    creature_vertices: int
    working_vertices: int
    strengths: tuple[int, ...]
    training_shapes: int
    training_strengths: tuple[int, ...]
    transformations: tuple[str, ...] = PAPER_TRANSFORMATIONS


SIZES: Mapping[str, Size] = {
    "small": Size(6, 24, 2500, 2500, (1, 3, 5), 5, (1, 3, 5)),
    "paper": Size(13, 456, 4000, 5000, (1, 2, 3, 4, 5), 7, (1, 2, 3, 4, 5)),
}


@dataclass(frozen=True)
class ModelSpec:
    """A model of a reproduction.

    Attributes
    ----------
    key : str
        Its name in the plan.
    method : str
    parameters : dict
    transformations : tuple of str
        To train with; empty for a model without training.
    """

    key: str
    method: str
    parameters: dict[str, Any]
    transformations: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """One reproduction.

    Attributes
    ----------
    out : Path
        Folder for everything that is written.
    size : Size
    nulls, poses, distractors : Path, optional
        Folders of the user's own shapes; without them, creatures.
    seed : int
    name : str
        Prefix of the names of collections and models.
    """

    out: Path
    size: Size
    nulls: Path | None = None
    poses: Path | None = None
    distractors: Path | None = None
    seed: int = 0
    name: str = "reproduction"

    def __post_init__(self) -> None:
        """Check that the figures can be made."""
        if "scale" not in self.size.transformations:
            raise InvalidRequestError("a reproduction needs the transformation scale, for Fig. 3")

    @property
    def benchmark(self) -> BenchmarkOptions:
        """Options of the benchmark; all shapes have one area, as the paper's have one unit."""
        own = self.nulls is not None
        return BenchmarkOptions(
            nulls=self.nulls,
            poses=self.poses,
            distractors=self.distractors,
            creatures=0 if own else self.size.creatures,
            creature_distractors=0 if self.distractors else self.size.distractors,
            creature_vertices=self.size.creature_vertices,
            transformations=self.size.transformations,
            strengths=self.size.strengths,
            seed=self.seed,
            normalise="area",
        )

    @property
    def training(self) -> dict[str, Any]:
        """``training`` of a request's body, without the transformations."""
        return {
            "collection": None,
            "strengths": list(self.size.training_strengths),
            "correspondence": "simulated",
            "seed": self.seed,
            "shapes": self.size.training_shapes,
        }

    @property
    def digest(self) -> str:
        """A short digest of everything that decides on the models."""
        decisive = {
            "size": asdict(self.size),
            "seed": self.seed,
            "transformations": TRANSFORMATION_VERSION,
            "models": [asdict(spec) for spec in first_models(self)],
        }
        text = json.dumps(decisive, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:8]

    def model_name(self, key: str) -> str:
        """Return the name of one of its models, unlike any name of another plan."""
        return f"{self.name}-{self.digest}-{key}"


def first_models(plan: Plan) -> tuple[ModelSpec, ...]:
    """Return the models that need no other model: of Figs. 1, 3 and 4, t*, and commute time."""
    every = plan.size.transformations
    paper = paper_parameters(OPEN)
    splines = {**paper, **SPLINES}
    fine = {**splines, "splines": FINE}
    nearest = {**paper, **RANGE, "points": FINE, "interpolation": "nearest"}
    return (
        ModelSpec("commute", "commute-time", {"view": OPEN}),
        ModelSpec("scale-only", "spline", splines, ("scale",)),
        ModelSpec("learned", "spline", splines, every),
        ModelSpec("smooth", "spline", {**fine, "smoothness": SMOOTHNESS}, every),
        ModelSpec("rough", "spline", {**fine, "smoothness": 0.0}, every),
        ModelSpec("grid", "grid", nearest, every),
        ModelSpec("heat-time", "heat-time", {**paper, **RANGE}, every),
        ModelSpec("distance", "spline", distance_parameters(OPEN), every),
    )


def heat_models(best: float, view: str) -> tuple[ModelSpec, ...]:
    """Return the heat kernels at the best time, and at the paper's other times as shares of it."""
    return tuple(
        ModelSpec(key, "heat", {"time": share * best, "unit": "none", "view": view})
        for key, share in (("heat-short", SHORT), ("heat-best", 1.0), ("heat-long", LONG))
    )


def closed_models(plan: Plan, best: float) -> tuple[ModelSpec, ...]:
    """Return the six columns for closed shapes: the same heat times, kernels learned again."""
    every = plan.size.transformations
    splines = {**paper_parameters(CLOSED), **SPLINES}
    return (
        *heat_models(best, CLOSED),
        ModelSpec("learned", "spline", splines, every),
        ModelSpec("commute", "commute-time", {"view": CLOSED}),
        ModelSpec("distance", "spline", distance_parameters(CLOSED), every),
    )


def paper_parameters(view: str) -> dict[str, Any]:
    """Return what the paper learns with: k(x, x′), in the meshes' own unit."""
    return {"criterion": "kernel", "unit": "none", "view": view}


def distance_parameters(view: str) -> dict[str, Any]:
    """Return what the kernel beyond the paper is learned with: distances, in λ/λ₁."""
    return {"criterion": "distance", "unit": "first-eigenvalue", "view": view, **SPLINES}
