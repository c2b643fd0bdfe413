"""Which pairs of shapes a kernel is learned from; refused before anything is written."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from workers.creatures import TRAINING_SPECIES
from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.views import View
from workers.training.examples import Pair
from workers.training.request import (
    CORRESPONDENCES,
    MOST_CREATURES,
    MOST_SHAPES,
    VERTEX_ORDER,
    TrainingRequest,
    check_simulations,
    creature_vertices,
    simulations,
)
from workers.training.shapes import TrainingShape, check_vertices, choose_evenly, count_of
from workers.training.sources import Change, CreatureSource, Source, StoredSource

MOST_PAIRS = 5000  # their moments, 0.3 MB each, are in memory at once


def check_pairs(request: TrainingRequest) -> None:
    """Refuse what cannot be asked for together, whatever shapes there are.

    Parameters
    ----------
    request : TrainingRequest
        What the client asks for.

    Raises
    ------
    InvalidRequestError
        The correspondence, a transformation or a strength is unknown, or does not fit the others.
    InsufficientTrainingDataError
        No transformation is given.
    """
    if request.correspondence not in CORRESPONDENCES:
        raise InvalidRequestError(
            f"there is no correspondence {request.correspondence!r}; there are "
            f"{', '.join(CORRESPONDENCES)}"
        )
    if request.correspondence != VERTEX_ORDER:
        check_simulations(request)
    elif request.collection is None:
        raise InvalidRequestError("the correspondence 'vertex-order' needs a collection")
    elif request.transformations:
        raise InvalidRequestError(
            "with the correspondence 'vertex-order' shapes of one label are each other's "
            "transformations, so no others can be given"
        )


def pairs_of(
    request: TrainingRequest,
    shapes: Sequence[TrainingShape],
    *,
    view: View,
    criterion: str,
    working_vertices: int,
    count_vertices: Callable[[StoredSource], int],
) -> list[Pair]:
    """Choose pairs, in an order that does not depend on that of the uploads.

    Parameters
    ----------
    request : TrainingRequest
        `check_pairs` accepts it.
    shapes : sequence of TrainingShape
        Those of the collection; without a collection creatures are made.
    view : View
        Under which shapes are solved.
    criterion : str
        Of the learning.
    working_vertices : int
        Of the service: creatures have no more, if they can.
    count_vertices : callable
        Number of vertices in a file as it was uploaded.

    Returns
    -------
    list of Pair
        Numbered from 0.

    Raises
    ------
    InsufficientTrainingDataError
        There are too few shapes or classes.
    InvalidRequestError
        Vertex counts differ, or there are too many pairs.
    """
    most = request.shapes or MOST_SHAPES
    if request.collection is None:
        found = _pairs_of_creatures(request, creature_vertices(working_vertices))
    elif request.correspondence == VERTEX_ORDER:
        found = _neighbours(shapes, most, count_vertices)
    else:
        found = _simulated(choose_evenly(shapes, most, at_least=1), request)

    def pair(item: str, label: str, source: Source, change: Change) -> Pair:
        return Pair(0, item, source, label, change, view, criterion)

    pairs = [pair(*content) for content in found]
    if len(pairs) > MOST_PAIRS:
        raise InvalidRequestError(
            f"{len(pairs)} pairs of shapes are asked for, expected at most {MOST_PAIRS}; take "
            "fewer shapes, transformations or strengths"
        )
    return [replace(one, number=number) for number, one in enumerate(pairs)]


_Content = tuple[str, str, Source, Change]
"""Item, label, source and change of a pair."""


def _pairs_of_creatures(request: TrainingRequest, vertices: int) -> Iterator[_Content]:
    """Every transformation in every strength of creatures of species as far apart as can be."""
    count = request.shapes or MOST_CREATURES
    poses = "isometry" in request.transformations  # decision 7
    n_species = len(TRAINING_SPECIES)
    spread = min(count, n_species)
    for i in range(count):
        species = TRAINING_SPECIES[i % spread * n_species // spread]
        individual = request.seed + i // spread
        source = CreatureSource(species, individual, vertices)
        for change in simulations(request, f"{species}/{individual}", poses=poses):
            item = f"{species} {individual} {change.transformation} {change.strength}"
            yield item, species, source, change


def _simulated(shapes: Sequence[TrainingShape], request: TrainingRequest) -> Iterator[_Content]:
    """Every transformation in every strength of every shape."""
    if len({shape.kind for shape in shapes}) < 2:
        raise InsufficientTrainingDataError(
            f"{count_of(shapes)}; at least 2 of different labels are needed to learn from"
        )
    for shape in shapes:
        for change in simulations(request, shape.sha256, poses=False):
            item = f"{shape.name} {change.transformation} {change.strength}"
            yield item, shape.kind, shape.source, change


def _neighbours(
    shapes: Sequence[TrainingShape], most: int, count_vertices: Callable[[StoredSource], int]
) -> Iterator[_Content]:
    """Each shape with the next of its label by name, and the last with the first."""
    kinds: dict[str, list[TrainingShape]] = {}
    for shape in choose_evenly(shapes, most, at_least=2):
        kinds.setdefault(shape.kind, []).append(shape)
    if len(kinds) < 2:
        raise InsufficientTrainingDataError(
            f"{count_of(shapes)}; at least 2 labels of at least 2 shapes each are needed to learn "
            "from shapes that share their vertex order"
        )
    for kind, members in kinds.items():
        members = sorted(members, key=lambda shape: (shape.name, shape.sha256))
        check_vertices(kind, members, count_vertices)
        for shape, following in zip(members, [*members[1:], members[0]], strict=True):
            yield f"{shape.name} and {following.name}", kind, shape.source, following.source
