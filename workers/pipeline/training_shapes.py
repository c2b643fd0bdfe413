"""Shapes of a collection that a model can learn from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import InvalidRequestError, ShapeNotReadyError
from workers.pipeline.training_pairs import StoredSource
from workers.storage.collections import get_collection
from workers.storage.models import Collection, Shape
from workers.storage.shapes import state_of_shape


@dataclass(frozen=True)
class LabelledShape:
    """A shape of a collection that can be learned from; ``n_vertices`` is of the cleaned mesh."""

    sha256: str
    name: str
    label: str | None
    n_vertices: int
    was_repaired: bool

    @property
    def kind(self) -> str:
        """Its class: the label, or else a class of its own."""
        return f"unlabelled {self.sha256[:12]}" if self.label is None else self.label

    @property
    def source(self) -> StoredSource:
        """Its file."""
        return StoredSource(self.sha256, self.name)


def ready_shapes(session: Session, name: str) -> list[LabelledShape]:
    """Shapes of a collection that were computed, in any order.

    Raises
    ------
    CollectionNotFoundError, ShapeNotReadyError
        There is no such collection, or some of its shapes are still being computed.
    """
    collection = get_collection(session, name)
    columns = (Shape.sha256, Shape.name, Shape.label, Shape.n_vertices, Shape.repairs)
    rows = session.execute(
        select(*columns, state_of_shape().label("state"))
        .join(Collection, Collection.id == Shape.collection_id)
        .where(Shape.collection_id == collection.id)
    ).all()
    waiting = sorted(row.name for row in rows if row.state in {"queued", "processing"})
    if waiting:
        more = f" and {len(waiting) - 1} more" if len(waiting) > 1 else ""
        raise ShapeNotReadyError(
            f"{waiting[0]}{more} of collection {name!r} are still being computed; train when they "
            "are ready"
        )
    return [
        LabelledShape(row.sha256, row.name, row.label, row.n_vertices or 0, bool(row.repairs))
        for row in rows
        if row.state == "ready"
    ]


def choose_evenly(
    shapes: Sequence[LabelledShape], most: int, *, at_least: int
) -> list[LabelledShape]:
    """Choose shapes evenly over the classes, ordered by label and content.

    Parameters
    ----------
    shapes : sequence of LabelledShape
        In any order.
    most : int
        As many, or all there are.
    at_least : int
        Of a class; smaller ones are passed over.
    """
    kinds: dict[tuple[bool, str], list[LabelledShape]] = {}
    for shape in shapes:
        kinds.setdefault((shape.label is None, shape.kind), []).append(shape)
    large = [kinds[key] for key in sorted(kinds) if len(kinds[key]) >= at_least]
    n_kinds = min(len(large), most // at_least)
    groups = [
        sorted(large[i * len(large) // n_kinds], key=lambda shape: (shape.sha256, shape.name))
        for i in range(n_kinds)
    ]
    quotas = [0] * n_kinds
    left = min(most, sum(len(group) for group in groups))
    while left:
        for i, group in enumerate(groups):
            if left and quotas[i] < len(group):
                quotas[i] += 1
                left -= 1
    return [shape for group, quota in zip(groups, quotas, strict=True) for shape in group[:quota]]


def check_vertices(
    label: str,
    members: Sequence[LabelledShape],
    count_vertices: Callable[[StoredSource], int],
) -> None:
    """Refuse a label whose files have different numbers of vertices, and so no common order.

    Parameters
    ----------
    count_vertices : callable
        Number of vertices in a file as it was uploaded; asked where cleaning changed something.

    Raises
    ------
    InvalidRequestError
        With two of the files and their numbers.
    """
    counts = [
        count_vertices(shape.source) if shape.was_repaired else shape.n_vertices
        for shape in members
    ]
    for shape, count in zip(members, counts, strict=True):
        if count != counts[0]:
            raise InvalidRequestError(
                f"shapes labelled {label!r} do not share their vertex order: {members[0].name} "
                f"has {counts[0]} vertices, {shape.name} has {count}"
            )


def counted(shapes: Sequence[LabelledShape]) -> str:
    """How many shapes and labels there are, for a refusal."""
    kinds = sorted({shape.kind for shape in shapes})
    named = f" ({kinds[0]!r})" if len(kinds) == 1 else ""
    return f"the collection has {len(shapes)} shapes that are ready, of {len(kinds)} labels{named}"
