"""Which shapes are queries and targets when models are measured on a labelled collection."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import IntArray, read_only

NULL = "null"
"""What a file's name says of a shape that is not transformed: ``cat.null.0.off``."""

NO_LABEL = "no-label"
NO_RELEVANT_TARGET = "no-relevant-target"
UNLABELLED = -1


@dataclass(frozen=True)
class EvaluatedShape:
    """What an evaluation has to know of a shape.

    Attributes
    ----------
    id, name : str
    label, transformation : str or None
        "" is none.
    strength : int or None
    """

    id: str
    name: str = ""
    label: str | None = None
    transformation: str | None = None
    strength: int | None = None

    @property
    def is_transformed(self) -> bool:
        """Whether a transformation is named, and it is not ``null``."""
        return self.transformation not in {None, "", NULL}


@dataclass(frozen=True)
class LeftOut:
    """A shape that is no query, and the reason: one of those above, or a caller's own."""

    id: str
    name: str
    reason: str


@dataclass(frozen=True, eq=False)
class Protocol:
    """Which shapes are queries and which are targets.

    Attributes
    ----------
    shapes : tuple of n EvaluatedShape
        Ordered by id, so that the order of indices breaks ties as the search does.
    classes : (n,) int64
        Number of each shape's label, -1 where it has none.
    labels : tuple of str
        By number, sorted.
    queries, targets : (q,), (m,) int64
        Indices of shapes, rising.
    leave_one_out : bool
        Every query is a target too, and is left out of its own list.
    left_out : tuple of LeftOut
        Shapes that would have been queries.
    """

    shapes: tuple[EvaluatedShape, ...]
    classes: IntArray
    labels: tuple[str, ...]
    queries: IntArray
    targets: IntArray
    leave_one_out: bool
    left_out: tuple[LeftOut, ...]


def make_protocol(shapes: Iterable[EvaluatedShape]) -> Protocol:
    """Choose queries and targets.

    Where shapes are transformed, those are the queries and all others the targets. Otherwise each
    shape is a query against the rest. A shape without a label is never a query, nor is one whose
    label no other target has. Both are named, and stay among the targets.

    Parameters
    ----------
    shapes : iterable of EvaluatedShape
        In any order, each id once.

    Returns
    -------
    Protocol
        At least one query.

    Raises
    ------
    InvalidRequestError
        There is no query with a relevant target; says what there is and what is needed.
    """
    ordered = tuple(sorted(shapes, key=lambda shape: shape.id))
    labels = tuple(sorted({shape.label for shape in ordered if shape.label}))
    number = {label: i for i, label in enumerate(labels)}
    classes = np.array([number.get(shape.label or "", UNLABELLED) for shape in ordered], dtype=int)
    transformed = np.array([shape.is_transformed for shape in ordered], dtype=bool)
    alone = not transformed.any()
    candidates = np.flatnonzero(transformed | alone)
    targets = np.flatnonzero(~transformed)
    of_label = np.bincount(classes[targets] + 1, minlength=len(labels) + 1)  # targets, from -1 on
    found = of_label[classes[candidates] + 1] - alone  # but for the query itself
    labelled = classes[candidates] != UNLABELLED
    queries = candidates[labelled & (found > 0)]
    if len(queries) == 0:
        raise InvalidRequestError(_what_is_missing(ordered, labels, int(transformed.sum())))
    chosen = set(queries.tolist())
    return Protocol(
        shapes=ordered,
        classes=read_only(classes, np.int64),
        labels=labels,
        queries=read_only(queries, np.int64),
        targets=read_only(targets, np.int64),
        leave_one_out=alone,
        left_out=tuple(
            LeftOut(ordered[i].id, ordered[i].name, NO_RELEVANT_TARGET if has else NO_LABEL)
            for i, has in zip(candidates.tolist(), labelled.tolist(), strict=True)
            if i not in chosen
        ),
    )


def _what_is_missing(
    shapes: tuple[EvaluatedShape, ...], labels: tuple[str, ...], transformed: int
) -> str:
    with_label = sum(bool(shape.label) for shape in shapes)
    return (
        f"found {len(shapes)} shapes that can be compared, {with_label} of them with a label "
        f"({len(labels)} different ones) and {transformed} with a transformation other than "
        f"{NULL!r}; expected a transformed shape and another of its label that is not transformed, "
        "or without transformations two shapes of one label. A file named "
        "<label>.<transformation>.<strength>.off says both, its folder says the label"
    )
