"""Which variants of shapes a bank is learned from; refused before anything is written."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from workers.creatures import TRAINING_SPECIES
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.views import View, window_view
from workers.training.chosen_windows import window_variants
from workers.training.examples import Variant
from workers.training.request import (
    MOST_SHAPES,
    SIMULATED,
    TrainingRequest,
    check_simulations,
    creature_vertices,
    simulations,
)
from workers.training.shapes import TrainingShape, choose_evenly, count_of
from workers.training.sources import CreatureSource, Simulation, Source

DEFAULT_CREATURES = 60
MOST_VARIANTS = 20_000
MOST_COMPARISONS = 1_000_000  # of a copy with a shape: each takes a kilobyte of memory
UNPOSED = frozenset({"scale"})  # as in the benchmark: decision 7


def check_variants(request: TrainingRequest) -> None:
    """Refuse what cannot be asked for together, whatever shapes there are.

    Parameters
    ----------
    request : TrainingRequest
        What the client asks for.

    Raises
    ------
    InvalidRequestError
        The correspondence is not simulated, or a transformation or strength is unknown.
    InsufficientTrainingDataError
        No transformation is given.
    """
    if request.correspondence != SIMULATED:
        raise InvalidRequestError(
            f"the method 'bank' simulates its transformations, so the correspondence "
            f"{request.correspondence!r} is not for it"
        )
    check_simulations(request)


def variants_of(
    request: TrainingRequest,
    shapes: Sequence[TrainingShape],
    *,
    views: Sequence[View],
    working_vertices: int,
) -> list[Variant]:
    """Take every shape, and every transformation of it in every strength.

    Parameters
    ----------
    request : TrainingRequest
        `check_variants` accepts it: a collection's shapes, so many creatures, or both.
    shapes : sequence of TrainingShape
        Those of the collection; none without one.
    views : sequence of View
        Under which they are described.
    working_vertices : int
        Of the service: creatures have no more, if they can.

    Returns
    -------
    list of Variant
        Each shape, numbered from 0, and its copies after it. Then those that windows are learned
        from, see `window_variants`.

    Raises
    ------
    InsufficientTrainingDataError
        There are fewer than two shapes.
    InvalidRequestError
        There are too many variants.
    """
    references = [
        *_creatures(request, working_vertices, views),
        *_uploaded(request, shapes, views),
    ]
    if len(references) < 2:
        raise InsufficientTrainingDataError(
            f"{len(references)} shapes are there to learn from, expected at least 2"
        )
    variants: list[Variant] = []
    for shape, changes in references:
        reference = len(variants)
        variants.append(replace(shape, number=reference, reference=reference))
        for change in changes:
            item = f"{shape.item} {change.transformation} {change.strength}"
            number = len(variants)
            variants.append(replace(variants[reference], number=number, item=item, change=change))
    if len(variants) > MOST_VARIANTS:
        raise InvalidRequestError(
            f"{len(variants)} variants of shapes are asked for, expected at most {MOST_VARIANTS}; "
            "take fewer shapes, transformations or strengths"
        )
    n_copies = len(variants) - len(references)
    comparisons = n_copies * len(references)
    if comparisons > MOST_COMPARISONS:
        raise InvalidRequestError(
            f"{n_copies} transformed copies of {len(references)} shapes are asked "
            f"for, which are {comparisons} comparisons, expected at most {MOST_COMPARISONS}; take "
            "fewer shapes, transformations or strengths"
        )
    view = window_view(working_vertices=working_vertices)
    return [*variants, *window_variants(variants, request, view)]


def _creatures(
    request: TrainingRequest, working_vertices: int, views: Sequence[View]
) -> Iterator[tuple[Variant, list[Simulation]]]:
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
            for change in simulations(request, f"{species}/{individual}", poses=True)
        ]
        item = f"{species} {individual}"
        yield _reference(item, species, source, views, lenient=False), changes


def _uploaded(
    request: TrainingRequest, shapes: Sequence[TrainingShape], views: Sequence[View]
) -> Iterator[tuple[Variant, list[Simulation]]]:
    """Shapes of a collection; without a label each is a group of its own."""
    if request.collection is None:
        return
    if len(shapes) < 2 and not request.creatures:
        raise InsufficientTrainingDataError(
            f"{count_of(shapes)}; at least 2 shapes are needed to learn from"
        )
    for shape in choose_evenly(shapes, request.shapes or MOST_SHAPES, at_least=1):
        changes = simulations(request, shape.sha256, poses=False)
        group, lenient = f"label {shape.kind}", shape.label is not None
        yield _reference(shape.name, group, shape.source, views, lenient=lenient), changes


def _reference(
    item: str, group: str, source: Source, views: Sequence[View], *, lenient: bool
) -> Variant:
    """A shape as it is, not numbered yet."""
    return Variant(0, item, source, group, lenient, 0, None, tuple(views))
