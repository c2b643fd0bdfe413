"""Which shapes and copies windows are learned from: every kind as often, and not too many."""

from collections import Counter
from dataclasses import replace

import pytest

from workers.errors import InsufficientTrainingDataError
from workers.geometry.views import default_view, window_view
from workers.training.chosen_variants import variants_of
from workers.training.chosen_windows import (
    COPIES,
    FEWEST_COPIES,
    FEWEST_SHAPES,
    MOST_COPIES,
    MOST_PAIRED,
    MOST_SHAPES,
    evenly,
    require_enough,
)
from workers.training.examples import Variant
from workers.training.request import TrainingRequest
from workers.training.shapes import TrainingShape
from workers.training.sources import CreatureSource
from workers.transformations import PAPER_TRANSFORMATIONS

VERTICES = 500
ALL = TrainingRequest(transformations=PAPER_TRANSFORMATIONS)
KINDS = {(name, strength) for name, strengths in COPIES for strength in strengths}


def planned(request: TrainingRequest, shapes: int = 0) -> list[Variant]:
    """Variants of creatures, and of so many shapes of a collection of two labels."""
    stored = [
        TrainingShape(f"{i:064x}", f"{i}.off", f"label {i % 2}", 100, False) for i in range(shapes)
    ]
    asked = replace(request, collection="zoo") if shapes else request
    views = [default_view(working_vertices=VERTICES)]
    return variants_of(asked, stored, views=views, working_vertices=VERTICES)


def with_windows(variants: list[Variant]) -> list[Variant]:
    return [one for one in variants if one.windows is not None]


def kinds_of(variants: list[Variant]) -> Counter[tuple[str, int]]:
    changes = [one.change for one in variants if one.change is not None]
    return Counter((change.transformation, change.strength) for change in changes)


def test_a_bank_by_default_has_every_kind_of_copy_equally_often() -> None:
    found = with_windows(planned(ALL))
    counts = kinds_of(found)
    assert set(counts) == KINDS
    assert set(counts.values()) == {MOST_COPIES // len(KINDS)}
    assert sum(one.change is None for one in found) == MOST_SHAPES
    paired = [one for one in found if one.paired]
    assert len(paired) == MOST_PAIRED
    assert all(one.change is None for one in paired)
    assert {one.windows for one in found} == {window_view(working_vertices=VERTICES)}


def test_copies_are_of_their_shapes_and_numbered_after_the_bank() -> None:
    variants = planned(ALL)
    assert [one.number for one in variants] == list(range(len(variants)))
    for one in with_windows(variants):
        shape = variants[one.reference]
        assert (shape.change, shape.windows, shape.source) == (None, one.windows, one.source)
        assert shape.item in one.item
        assert Variant.from_payload(one.to_payload()) == one


def test_twins_have_other_kinds_of_copies() -> None:
    """Else a kind would be known of a few species alone."""
    kinds: dict[str, dict[int, set[tuple[str, int]]]] = {}
    for one in with_windows(planned(ALL)):
        assert isinstance(one.source, CreatureSource)
        if one.change is not None:
            change = one.change.transformation, one.change.strength
            of_species = kinds.setdefault(one.group, {})
            of_species.setdefault(one.source.seed, set()).add(change)
    twins = [list(one.values()) for one in kinds.values() if len(one) > 1]
    assert twins
    assert all(first != second for first, second, *_ in twins)


@pytest.mark.parametrize("n_creatures", [8, 20, 60, 90])
@pytest.mark.parametrize("strengths", [(1,), (1, 2, 3), (1, 2, 3, 4, 5)])
def test_they_are_at_most_half_as_many_as_the_bank_has(
    n_creatures: int, strengths: tuple[int, ...]
) -> None:
    variants = planned(replace(ALL, creatures=n_creatures, strengths=strengths))
    copies = [one for one in variants if one.change is not None]
    of_windows = with_windows(copies)
    assert len(of_windows) <= min(MOST_COPIES, (len(copies) - len(of_windows)) / 2)
    assert len(of_windows) == 0 or len(of_windows) >= FEWEST_COPIES
    counts = kinds_of(of_windows)
    assert len(of_windows) == 0 or max(counts.values()) - min(counts.values()) <= 1


def test_whatever_the_bank_is_to_ignore_windows_see_all_kinds() -> None:
    request = TrainingRequest(transformations=("noise",), creatures=60)
    variants = planned(request)
    assert set(kinds_of(with_windows(variants))) == KINDS
    of_bank = {one.change for one in variants if one.windows is None}
    assert not of_bank & {one.change for one in with_windows(variants) if one.change}


def test_stored_shapes_have_no_poses_and_may_be_mixed_with_creatures() -> None:
    found = with_windows(planned(replace(ALL, creatures=10), shapes=10))
    creatures = [one for one in found if isinstance(one.source, CreatureSource)]
    assert len(creatures) == len(found) / 2
    for one in found:
        if one.change is not None:
            assert (one.change.pose is not None) == (one in creatures)
    assert {one.lenient for one in found if one not in creatures} == {True}


def test_the_same_request_has_the_same_copies_and_another_seed_others() -> None:
    one, same, other = (
        {variant.key for variant in with_windows(planned(request)) if variant.change is not None}
        for request in (ALL, ALL, replace(ALL, seed=3))
    )
    assert one == same
    assert not one & other


def test_few_shapes_or_copies_have_none() -> None:
    few = FEWEST_SHAPES - 1
    assert not with_windows(planned(replace(ALL, creatures=few)))
    assert with_windows(planned(replace(ALL, creatures=FEWEST_SHAPES)))
    one_kind = TrainingRequest(transformations=("noise",), strengths=(1,), creatures=60)
    assert not with_windows(planned(one_kind))
    with pytest.raises(InsufficientTrainingDataError, match=f"{few} shapes and 100 copies"):
        require_enough(few, 100)
    with pytest.raises(InsufficientTrainingDataError, match=f"at least {FEWEST_SHAPES} and"):
        require_enough(100, FEWEST_COPIES - 1)
    require_enough(FEWEST_SHAPES, FEWEST_COPIES)


def test_what_is_stored_of_a_variant_depends_on_its_windows() -> None:
    """And of one without them, on nothing more than before there were windows."""
    shape = next(one for one in with_windows(planned(ALL)) if one.paired)
    without = replace(shape, windows=None, paired=False)
    other = replace(shape, windows=window_view(working_vertices=600))
    assert len({one.key for one in (shape, without, other, replace(shape, paired=False))}) == 4
    old = {k: v for k, v in without.to_payload().items() if k not in {"windows", "paired"}}
    assert Variant.from_payload(old) == without


def test_some_are_chosen_evenly() -> None:
    shapes = [one for one in planned(ALL) if one.change is None and one.windows is None]
    assert evenly(shapes, 1000) == shapes
    assert evenly(shapes, 3) == [shapes[0], shapes[20], shapes[40]]
    assert evenly([], 3) == []
