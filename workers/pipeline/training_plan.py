"""Which pairs of shapes a model learns from; refused before anything is written."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from workers.creatures import TRAINING_SPECIES
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.preparation import View
from workers.pipeline.training_pairs import (
    Change,
    CreatureSource,
    Pair,
    Simulation,
    Source,
    StoredSource,
)
from workers.pipeline.training_shapes import (
    LabelledShape,
    check_vertices,
    choose_evenly,
    counted,
    ready_shapes,
)
from workers.transformations import STRENGTHS, TRANSFORMATIONS

SIMULATED, VERTEX_ORDER = "simulated", "vertex-order"
CORRESPONDENCES = (SIMULATED, VERTEX_ORDER)
MOST_CREATURES, MOST_SHAPES = 12, 50  # unless more are asked for
FEWEST_VERTICES, MOST_VERTICES = 2000, 4000  # of a creature
MOST_PAIRS = 5000  # their moments, 0.3 MB each, are in memory at once


@dataclass(frozen=True)
class TrainingRequest:
    """From what to learn.

    Attributes
    ----------
    collection : str or None
        Whose shapes; procedural creatures without one.
    transformations : tuple of str
        Each is applied to every shape.
    strengths : tuple of int
        Each transformation is applied in all of them.
    correspondence : str
        "simulated", or "vertex-order": shapes of one label are each other's transformations.
    seed : int
        Of creatures, poses and transformations.
    shapes : int or None
        At most so many.
    creatures : int or None
        So many of them, for a bank, beside the collection's shapes or alone.
    """

    collection: str | None = None
    transformations: tuple[str, ...] = ()
    strengths: tuple[int, ...] = STRENGTHS
    correspondence: str = SIMULATED
    seed: int = 0
    shapes: int | None = None
    creatures: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain JSON, as it is shown with a model."""
        return {
            **{key: value for key, value in vars(self).items() if key != "creatures"},
            **({} if self.creatures is None else {"creatures": self.creatures}),
            "transformations": list(self.transformations),
            "strengths": list(self.strengths),
        }


def plan_pairs(
    session: Session,
    request: TrainingRequest,
    *,
    view: View,
    criterion: str,
    working_vertices: int,
    count_vertices: Callable[[StoredSource], int],
) -> list[Pair]:
    """Pairs to learn from, in an order that does not depend on that of the uploads.

    Parameters
    ----------
    session : Session
    request : TrainingRequest
    view : View
        Under which shapes are solved.
    criterion : str
        Of the learning.
    working_vertices : int
        Of the service: creatures have no more, if they can.
    count_vertices : callable
        Number of vertices in a file as it was uploaded.

    Raises
    ------
    CollectionNotFoundError, ShapeNotReadyError
        There is no such collection, or some of its shapes are still being computed.
    InsufficientTrainingDataError
        There are too few shapes, classes or transformations.
    InvalidRequestError
        A transformation or strength is unknown, vertex counts differ, or something was asked for
        that does not go together.
    """
    _check(request)
    if request.collection is None:
        found = _simulated_creatures(request, creature_vertices(working_vertices))
    else:
        shapes = ready_shapes(session, request.collection)
        most = request.shapes or MOST_SHAPES
        if request.correspondence == VERTEX_ORDER:
            found = _neighbours(shapes, most, count_vertices)
        else:
            found = _simulated(choose_evenly(shapes, most, at_least=1), request)
    if len(found) > MOST_PAIRS:
        raise InvalidRequestError(
            f"{len(found)} pairs of shapes are asked for, expected at most {MOST_PAIRS}; take "
            "fewer shapes, transformations or strengths"
        )
    return [
        Pair(number, item, label, source, change, view, criterion)
        for number, (item, label, source, change) in enumerate(found)
    ]


def creature_vertices(working_vertices: int) -> int:
    """Vertices of a creature: those of working meshes, as far as it can have so many."""
    return min(MOST_VERTICES, max(FEWEST_VERTICES, working_vertices))


_Planned = tuple[str, str, Source, Change]
"""Name, class, shape and transformation."""


def _check(request: TrainingRequest) -> None:
    """Refuse what does not go together, whatever shapes there are."""
    if request.correspondence not in CORRESPONDENCES:
        raise InvalidRequestError(
            f"there is no correspondence {request.correspondence!r}; there are "
            f"{', '.join(CORRESPONDENCES)}"
        )
    if request.correspondence == VERTEX_ORDER:
        if request.collection is None:
            raise InvalidRequestError("the correspondence 'vertex-order' needs a collection")
        if request.transformations:
            raise InvalidRequestError(
                "with the correspondence 'vertex-order' shapes of one label are each other's "
                "transformations, so no others can be given"
            )
        return
    check_simulations(request)


def check_simulations(request: TrainingRequest) -> None:
    """Refuse transformations and strengths that are none.

    Raises
    ------
    InvalidRequestError, InsufficientTrainingDataError
        One is unknown; there are no transformations at all.
    """
    known = ", ".join(TRANSFORMATIONS)
    unknown = [name for name in request.transformations if name not in TRANSFORMATIONS]
    if unknown:
        raise InvalidRequestError(f"there is no transformation {unknown[0]!r}; there are {known}")
    if not request.transformations:
        raise InsufficientTrainingDataError(
            f"no transformation is given to learn from; there are {known}"
        )
    if not request.strengths or not set(request.strengths) <= set(STRENGTHS):
        raise InvalidRequestError(
            f"the strengths are {list(request.strengths)}, expected some of {list(STRENGTHS)}"
        )


def _simulated_creatures(request: TrainingRequest, vertices: int) -> list[_Planned]:
    """Every transformation in every strength of creatures of species as far apart as can be."""
    count = request.shapes or MOST_CREATURES
    n_species = len(TRAINING_SPECIES)
    spread = min(count, n_species)
    planned: list[_Planned] = []
    for i in range(count):
        species = TRAINING_SPECIES[i % spread * n_species // spread]
        individual = request.seed + i // spread
        source = CreatureSource(species, individual, vertices)
        planned += [
            (f"{species} {individual} {name} {strength}", species, source, change)
            for name, strength, change in simulations(
                request, f"{species}/{individual}", poses="isometry" in request.transformations
            )
        ]
    return planned


def _simulated(shapes: Sequence[LabelledShape], request: TrainingRequest) -> list[_Planned]:
    """Every transformation in every strength of every shape."""
    if len({shape.kind for shape in shapes}) < 2:
        raise InsufficientTrainingDataError(
            f"{counted(shapes)}; at least 2 of different labels are needed to learn from"
        )
    return [
        (f"{shape.name} {name} {strength}", shape.kind, shape.source, change)
        for shape in shapes
        for name, strength, change in simulations(request, shape.sha256, poses=False)
    ]


def simulations(
    request: TrainingRequest, shape: str, *, poses: bool
) -> list[tuple[str, int, Simulation]]:
    """Each transformation and strength with seeds of its own."""
    chosen = [name for name in TRANSFORMATIONS if name in request.transformations]
    return [
        (
            name,
            strength,
            Simulation(
                name,
                strength,
                seed=seed_of(request.seed, shape),
                pose=seed_of(request.seed, shape, "pose", name, strength) if poses else None,
            ),
        )
        for name in chosen
        for strength in sorted(set(request.strengths))
    ]


def seed_of(*content: object) -> int:
    """Seed below 2³¹ that follows from some content."""
    text = "/".join(str(part) for part in content)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little") >> 1


def _neighbours(
    shapes: Sequence[LabelledShape], most: int, count_vertices: Callable[[StoredSource], int]
) -> list[_Planned]:
    """Each shape with the next of its label by name, and the last with the first."""
    kinds: dict[str, list[LabelledShape]] = {}
    for shape in choose_evenly(shapes, most, at_least=2):
        kinds.setdefault(shape.kind, []).append(shape)
    if len(kinds) < 2:
        raise InsufficientTrainingDataError(
            f"{counted(shapes)}; at least 2 labels of at least 2 shapes each are needed to learn "
            "from shapes that share their vertex order"
        )
    planned: list[_Planned] = []
    for kind, members in kinds.items():
        members = sorted(members, key=lambda shape: (shape.name, shape.sha256))
        check_vertices(kind, members, count_vertices)
        for shape, following in zip(members, [*members[1:], members[0]], strict=True):
            item = f"{shape.name} and {following.name}"
            planned.append((item, kind, shape.source, following.source))
    return planned
