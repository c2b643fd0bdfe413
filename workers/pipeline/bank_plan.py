"""Which variants of shapes a bank learns from; refused before anything is written."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from sqlalchemy.orm import Session

from workers.creatures import TRAINING_SPECIES
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.preparation import View
from workers.pipeline.training_pairs import CreatureSource, Simulation, Source
from workers.pipeline.training_plan import (
    MOST_SHAPES,
    SIMULATED,
    TrainingRequest,
    check_simulations,
    creature_vertices,
    simulations,
)
from workers.pipeline.training_shapes import choose_evenly, counted, ready_shapes
from workers.pipeline.training_variants import Variant

DEFAULT_CREATURES = 60
MOST_VARIANTS = 20_000
MOST_COMPARISONS = 1_000_000  # of a copy with a shape: each takes a kilobyte of memory
UNPOSED = frozenset({"scale"})  # as in the benchmark: decision 7


def plan_variants(
    session: Session,
    request: TrainingRequest,
    *,
    views: Sequence[View],
    working_vertices: int,
) -> list[Variant]:
    """Variants to learn from: every shape, and every transformation of it in every strength.

    Parameters
    ----------
    session : Session
    request : TrainingRequest
        Of a collection's shapes, of so many creatures, or of both.
    views : sequence of View
        Under which they are described.
    working_vertices : int
        Of the service: creatures have no more, if they can.

    Raises
    ------
    CollectionNotFoundError, ShapeNotReadyError
        There is no such collection, or some of its shapes are still being computed.
    InsufficientTrainingDataError
        There are fewer than two shapes, or no transformations.
    InvalidRequestError
        Something is unknown, asked for that does not go together, or too much.
    """
    if request.correspondence != SIMULATED:
        raise InvalidRequestError(
            f"the method 'bank' simulates its transformations, so the correspondence "
            f"{request.correspondence!r} is not for it"
        )
    check_simulations(request)
    planned = [*_creatures(request, working_vertices), *_uploaded(session, request)]
    if len(planned) < 2:
        raise InsufficientTrainingDataError(
            f"{len(planned)} shapes are there to learn from, expected at least 2"
        )
    variants: list[Variant] = []
    for shape, changes in planned:
        reference = len(variants)
        variants.append(replace(shape, number=reference, reference=reference, views=tuple(views)))
        for change in changes:
            item = f"{shape.item} {change.transformation} {change.strength}"
            number = len(variants)
            variants.append(replace(variants[reference], number=number, item=item, change=change))
    if len(variants) > MOST_VARIANTS:
        raise InvalidRequestError(
            f"{len(variants)} variants of shapes are asked for, expected at most {MOST_VARIANTS}; "
            "take fewer shapes, transformations or strengths"
        )
    comparisons = (len(variants) - len(planned)) * len(planned)
    if comparisons > MOST_COMPARISONS:
        raise InvalidRequestError(
            f"{len(variants) - len(planned)} transformed copies of {len(planned)} shapes are asked "
            f"for, which are {comparisons} comparisons, expected at most {MOST_COMPARISONS}; take "
            "fewer shapes, transformations or strengths"
        )
    return variants


_Planned = tuple[Variant, list[Simulation]]
"""A shape as it is, not numbered yet, and its transformations."""


def _creatures(request: TrainingRequest, working_vertices: int) -> Iterator[_Planned]:
    """Individuals of species as far apart as can be, transformed on top of poses.

    Every other species is meshed unevenly, all of its individuals: so twins do not differ in that.
    """
    default = DEFAULT_CREATURES if request.collection is None else 0
    count = default if request.creatures is None else request.creatures
    vertices = creature_vertices(working_vertices)
    n_species = len(TRAINING_SPECIES)
    spread = min(count, n_species)
    for i in range(count):
        place = i % spread
        species = TRAINING_SPECIES[place * n_species // spread]
        individual = request.seed + i // spread
        source = CreatureSource(species, individual, vertices, uneven=place % 2 == 1)
        changes = [
            replace(change, pose=None) if change.transformation in UNPOSED else change
            for _, _, change in simulations(request, f"{species}/{individual}", poses=True)
        ]
        yield _shape(f"{species} {individual}", species, source, lenient=False), changes


def _uploaded(session: Session, request: TrainingRequest) -> Iterator[_Planned]:
    """Shapes of a collection; without a label each is a group of its own."""
    if request.collection is None:
        return
    ready = ready_shapes(session, request.collection)
    if len(ready) < 2 and not request.creatures:
        raise InsufficientTrainingDataError(
            f"{counted(ready)}; at least 2 shapes are needed to learn from"
        )
    for shape in choose_evenly(ready, request.shapes or MOST_SHAPES, at_least=1):
        changes = [change for _, _, change in simulations(request, shape.sha256, poses=False)]
        lenient = shape.label is not None
        yield _shape(shape.name, f"label {shape.kind}", shape.source, lenient=lenient), changes


def _shape(item: str, group: str, source: Source, *, lenient: bool) -> Variant:
    return Variant(0, item, group, lenient, 0, source, None, ())
