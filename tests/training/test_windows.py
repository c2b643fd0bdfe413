"""Windows are measured on held-out groups, and not held against shapes that are alike."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.retrieval.windows.shapes import EVEN, PLAIN, asked_bumpy, stored_bumpy
from tests.training.test_window_trust import QUERIES, TARGETS, synthetic
from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import BoolArray
from workers.geometry.views import default_view, window_view
from workers.retrieval.builtin import shape_dna_model
from workers.retrieval.model import Model
from workers.retrieval.windows.rows import write_row
from workers.retrieval.windows.trust import Trust
from workers.training import windows
from workers.training.bank_shapes import BankShapes
from workers.training.window_shapes import WindowShapes
from workers.training.window_trust import WindowQueries
from workers.training.windows import (
    FOLDS,
    cross_validated,
    folds_of,
    held_out_distances,
    learn_windows,
    windows_report,
)

VIEW = default_view()
DNA = shape_dna_model(VIEW)
VIEW_OF_WINDOWS = window_view()


def described(groups: tuple[str, ...], *, lenient: bool = False) -> BankShapes:
    """A shape for each group given, and two copies of each; descriptors are random."""
    rng = np.random.default_rng(1)
    references = rng.normal(size=(len(groups), DNA.dimension)).astype(np.float32)
    truth = np.repeat(np.arange(len(groups)), 2)
    return BankShapes(
        references=references,
        groups=groups,
        names=groups,
        lenient=(lenient,) * len(groups),
        queries=references[truth] + np.float32(0.1),
        truth=truth,
        transformations=("noise", "partial") * len(groups),
        strengths=(1,) * len(truth),
    )


def test_a_group_is_in_one_fold_and_folds_are_even() -> None:
    groups = [f"species {i % 7}" for i in range(70)]
    folds = folds_of(groups)
    assert set(folds.tolist()) == set(range(FOLDS))
    assert len({(group, int(fold)) for group, fold in zip(groups, folds, strict=True)}) == 7
    assert folds_of(["b", "a", "b"]).tolist() == [1, 0, 1]


def test_the_bank_has_not_learned_from_the_group_it_is_measured_on() -> None:
    """Each copy's distances are those of the model that was learned without its fold."""
    shapes = described(("ape", "bee", "cat", "dog"))
    groups = ("ape", "bee", "cat", "dog", "dog", "elk")
    asked: list[set[str]] = []

    def relearned(some: BoolArray) -> Model:
        asked.append({group for group, is_in in zip(groups, some, strict=True) if is_in})
        (channel,) = DNA.channels
        return replace(DNA, channels=(replace(channel, weight=float(len(asked))),))

    found = held_out_distances(shapes, DNA, groups, relearned)
    others = [{"bee", "cat"}, {"ape", "cat", "dog"}, {"ape", "bee", "dog"}]
    assert asked == [{*some, "elk"} for some in others]
    own = found[np.arange(8), shapes.truth]  # all copies differ as much from their shapes
    assert_allclose(own / own[0], [1, 1, 2, 2, 3, 3, 1, 1], rtol=1e-4)


def test_shapes_that_a_label_says_are_alike_are_not_compared() -> None:
    shapes = described(("cup", "cup", "jug"), lenient=True)
    groups = shapes.query_groups
    found = held_out_distances(shapes, DNA, groups, lambda _: DNA)
    assert np.isinf(found[:2]).tolist() == [[False, True, False]] * 2
    assert np.isinf(found[4:]).sum() == 0
    rows = [np.frombuffer(write_row(stored_bumpy(seed)), dtype=np.uint8) for seed in (1, 2, 3)]
    asked = tuple(asked_bumpy(1 + seed) for seed in shapes.truth.tolist())
    known = WindowShapes(shapes, np.array(rows), asked).compared(found, PLAIN)
    assert np.isinf(known.around).all(axis=2).tolist() == np.isinf(found).tolist()
    fused = cross_validated(known, folds_of(groups))
    assert np.isinf(fused).tolist() == np.isinf(found).tolist()
    assert (fused.argmin(axis=1) == shapes.truth).all()
    matching = learn_windows(known, PLAIN, VIEW_OF_WINDOWS)
    trusted, _ = known.fused(matching.trust)
    compared = np.isfinite(found)
    compared[np.arange(6), shapes.truth] = False
    assert matching.impostor_quantiles[-1] == pytest.approx(trusted[compared].max(), rel=1e-4)


@pytest.mark.parametrize("lenient", [True, False])
def test_shapes_of_one_group_teach_nothing(*, lenient: bool) -> None:
    shapes = described(("cup",) * 3, lenient=lenient)
    with pytest.raises(InsufficientTrainingDataError, match="copies of the group cup alone"):
        held_out_distances(shapes, DNA, shapes.query_groups, lambda _: DNA)


def test_trust_is_measured_on_folds_that_it_was_not_learned_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known = synthetic(np.random.default_rng(1), useful="windows")
    folds = np.arange(QUERIES) % 3
    taught = np.arange(QUERIES) >= 6
    seen: list[WindowQueries] = []

    def trust_of(number: int) -> Trust:
        return Trust((float(number), 0, 0, 0), (1.0, 0, 0, 0), (0.0,) * 4, (0.0, 0.0), 1.4, 1.3)

    def learn(queries: WindowQueries, start: Trust | None) -> Trust:
        assert start == EVEN
        seen.append(queries)
        return trust_of(len(seen))

    monkeypatch.setattr(windows, "learn_trust", learn)
    fused = cross_validated(known, folds, taught, start=EVEN)
    assert len(seen) == 3
    for fold, queries in enumerate(seen):
        own = folds == fold
        assert np.array_equal(queries.distances, known.distances[taught & ~own])
        assert_allclose(fused[own], known.only(own).fused(trust_of(fold + 1))[0])


def test_what_is_learned_is_what_a_model_keeps() -> None:
    known = synthetic(np.random.default_rng(2), useful="windows")
    one, other = (learn_windows(known, PLAIN, VIEW_OF_WINDOWS) for _ in range(2))
    assert one == other
    assert type(one).from_json(one.to_json()) == one
    assert one.view == VIEW_OF_WINDOWS
    assert len(one.impostor_quantiles) > 10


def test_the_report_says_what_windows_add_on_groups_that_were_held_out() -> None:
    known = synthetic(np.random.default_rng(3), useful="windows")
    names = tuple(f"species {i}" for i in range(TARGETS))
    shapes = replace(
        described(names),
        queries=np.zeros((QUERIES, DNA.dimension), dtype=np.float32),
        truth=known.truth,
        transformations=known.transformations,
        strengths=(1,) * QUERIES,
    )
    report = windows_report(known, shapes)
    assert (report["n_shapes"], report["n_copies"]) == (TARGETS, QUERIES)
    assert report["n_groups"] == len(set(known.truth.tolist()))
    bank, both = report["rows"]["bank"], report["rows"]["with_windows"]
    assert set(bank["map"]) == set(both["map"]) == {"isometry", "partial"}
    assert bank["mean"] < 50.0 < 90.0 < both["mean"]  # chance is a twelfth, windows know all
    own = known.distances[np.arange(QUERIES), known.truth][:, None]
    scores = 100.0 / (known.distances <= own).sum(axis=1)
    assert bank["map"]["isometry"] == pytest.approx(scores[: QUERIES // 2].mean(), abs=0.01)
