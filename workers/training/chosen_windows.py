"""Which shapes and copies windows are learned from: some of a bank's shapes, copies of their own.

A bank is learned from those transformations that its user names. Windows are there for parts and
views above all. So how far they are trusted is learned from copies of every kind, whatever the bank
itself is to ignore.
"""

from collections.abc import Sequence
from dataclasses import replace

from workers.errors import InsufficientTrainingDataError
from workers.geometry.views import View
from workers.training.examples import Variant
from workers.training.request import TrainingRequest, simulations
from workers.training.sources import CreatureSource, Simulation, Source

COPIES: tuple[tuple[str, tuple[int, ...]], ...] = (
    ("isometry", (2, 4)),
    ("topology", (2, 4)),
    ("holes", (2, 4)),
    ("micro-holes", (3,)),
    ("local-scale", (1, 3, 5)),
    ("sampling", (1, 3, 5)),
    ("noise", (2, 4)),
    ("shot-noise", (3,)),
    ("partial", (1, 2, 3, 4, 5)),
    ("all", (1, 3, 5)),
    ("view", (1, 3, 5)),
)
"""Transformations and strengths of the copies.

No scans: learning from them taught distrust of all sheets (docs/method.md)."""

MOST_SHAPES = 60
"""So many shapes a bank is learned from by default. A search compares 100 candidates closely."""

MOST_COPIES = 540
"""Twenty of each of the 27 kinds: as many as the model `proteus` has learned from."""

SHARE = 0.5
"""At most so many copies for one of the bank's. Measured on 21 creatures with 315 copies: a bank
took 195 s of one processor, and its windows with 147 copies 217 s."""

MOST_PAIRED = 21
"""Shapes whose points are paired, each at the cost of six copies: about 9,000 pairs, for
covariances of seven numbers."""

FEWEST_SHAPES = 8
FEWEST_COPIES = 108
"""Four of each kind. On species held out, trust from 108 copies of 7 species found 0.7 points more
than one from 210 copies of 8 others, and from 54 copies 0.7 less (docs/method.md)."""


def window_variants(
    variants: Sequence[Variant], request: TrainingRequest, view: View
) -> list[Variant]:
    """Choose shapes of a bank, and further copies of them.

    There are at most half as many copies as the bank has, so that they take no longer than it does.
    Every shape has as many, and every kind of copy comes about as often.

    Parameters
    ----------
    variants : sequence of Variant
        All that the bank is learned from.
    request : TrainingRequest
        Its seed counts.
    view : View
        Under which windows are taken.

    Returns
    -------
    list of Variant
        Numbered after those of the bank; none where there are fewer than `FEWEST_SHAPES` shapes or
        `FEWEST_COPIES` copies.
    """
    references = [one for one in variants if one.change is None]
    chosen = evenly(references, MOST_SHAPES)
    kinds = [(name, strength) for name, strengths in COPIES for strength in strengths]
    n_copies = most_copies(len(variants) - len(references))
    each = min(n_copies // max(len(chosen), 1), len(kinds))
    if len(chosen) < FEWEST_SHAPES or each * len(chosen) < FEWEST_COPIES:
        return []
    paired = {one.number for one in evenly(chosen, MOST_PAIRED)}
    found: list[Variant] = []
    turn = 0
    for shape in chosen:
        number = len(variants) + len(found)
        item = f"windows of {shape.item}"
        reference = replace(
            shape,
            number=number,
            item=item,
            reference=number,
            windows=view,
            paired=shape.number in paired,
        )
        found.append(reference)
        for _ in range(each):
            # Every round begins one kind later: else twins would have the same kinds.
            name, strength = kinds[(turn + turn // len(kinds)) % len(kinds)]
            turn += 1
            found.append(
                replace(
                    reference,
                    number=len(variants) + len(found),
                    item=f"{item} {name} {strength}",
                    change=_change(request, shape.source, name, strength),
                    paired=False,
                )
            )
    return found


def most_copies(n_copies: int) -> int:
    """Count the copies that windows may be learned from.

    Parameters
    ----------
    n_copies : int
        Of the bank.

    Returns
    -------
    int
    """
    return min(MOST_COPIES, int(SHARE * n_copies))


def require_enough(n_shapes: int, n_copies: int) -> None:
    """Refuse to learn from too little.

    Parameters
    ----------
    n_shapes, n_copies : int
        How many there are.

    Raises
    ------
    InsufficientTrainingDataError
        With the numbers that are expected.
    """
    if n_shapes < FEWEST_SHAPES or n_copies < FEWEST_COPIES:
        raise InsufficientTrainingDataError(
            f"{n_shapes} shapes and {n_copies} copies are there to learn windows from, expected at "
            f"least {FEWEST_SHAPES} and {FEWEST_COPIES}"
        )


def evenly(some: Sequence[Variant], most: int) -> list[Variant]:
    """Choose variants evenly.

    Parameters
    ----------
    some : sequence of Variant
        In an order in which neighbours are alike, or in turn.
    most : int
        All of them if there are no more.

    Returns
    -------
    list of Variant
        In their order.
    """
    count = min(most, len(some))
    return [some[i * len(some) // count] for i in range(count)]


def _change(request: TrainingRequest, source: Source, name: str, strength: int) -> Simulation:
    """One kind of copy, with seeds that no copy of the bank has."""
    asked = replace(request, transformations=(name,), strengths=(strength,))
    has_poses = isinstance(source, CreatureSource)
    return simulations(asked, f"windows/{source.identity}", poses=has_poses)[0]
