"""Shapes of a collection that a model can learn from, and which of them are chosen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workers.errors import InvalidRequestError
from workers.training.sources import StoredSource


@dataclass(frozen=True)
class TrainingShape:
    """A shape of a collection that can be learned from.

    Attributes
    ----------
    sha256 : str
        Of the bytes of its file.
    name : str
        Of its file.
    label : str or None
        Its class, if it has one.
    n_vertices : int
        Of the cleaned mesh.
    was_repaired : bool
        Whether cleaning changed anything.
    """

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


def choose_evenly(
    shapes: Sequence[TrainingShape], most: int, *, at_least: int
) -> list[TrainingShape]:
    """Choose shapes evenly over the classes, ordered by label and content.

    Parameters
    ----------
    shapes : sequence of TrainingShape
        In any order.
    most : int
        So many are chosen, or all if there are fewer.
    at_least : int
        Classes of fewer shapes are passed over.

    Returns
    -------
    list of TrainingShape
        Class after class; the same for the same shapes in any order.
    """
    kinds: dict[tuple[bool, str], list[TrainingShape]] = {}
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
    members: Sequence[TrainingShape],
    count_vertices: Callable[[StoredSource], int],
) -> None:
    """Refuse a label whose files have different numbers of vertices, and so no common order.

    Parameters
    ----------
    label : str
        The class of the shapes.
    members : sequence of TrainingShape
        Its shapes.
    count_vertices : callable
        Number of vertices in a file as it was uploaded; called where cleaning changed something.

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


def count_of(shapes: Sequence[TrainingShape]) -> str:
    """Say how many shapes and labels there are.

    Parameters
    ----------
    shapes : sequence of TrainingShape
        All of a collection that are ready.

    Returns
    -------
    str
        The beginning of a message that refuses them.
    """
    kinds = sorted({shape.kind for shape in shapes})
    named = f" ({kinds[0]!r})" if len(kinds) == 1 else ""
    return f"the collection has {len(shapes)} shapes that are ready, of {len(kinds)} labels{named}"
