"""From variants of shapes to a bank: the same one by every way, or none."""

import random
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from tests.pipeline.trainings import (
    begin_bank,
    definition,
    job_row,
    small_bench,
    state,
    variants_for,
    work,
)
from workers.errors import (
    InsufficientTrainingDataError,
    InvalidMeshError,
    InvalidRequestError,
    ProteusError,
)
from workers.pipeline.outcome import Verb
from workers.pipeline.training.results import Arrays
from workers.pipeline.training.variant import compute_variant, describe_variant
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.storage.jobs import cancel_job, retry_job
from workers.storage.migrate import migrate
from workers.storage.models import Part
from workers.storage.trained_models import load_model
from workers.training.candidates import candidate_model
from workers.training.chosen_variants import DEFAULT_CREATURES
from workers.training.copies import arrange_copies
from workers.training.examples import Variant
from workers.training.request import TrainingRequest
from workers.training.sources import CreatureSource

N_VARIANTS = 4 + 4 * 2
CREATURES = TrainingRequest(transformations=("scale", "noise"), strengths=(2,), creatures=4)


def described(bench: Workbench, variant: Variant) -> Arrays:
    """What is computed of a variant, once for all trainings but that in another order."""
    if variant.key not in COMPUTED:
        COMPUTED[variant.key] = describe_variant(bench, variant)
    return COMPUTED[variant.key]


COMPUTED: dict[str, Arrays] = {}
QUICK: Mapping[str, Verb] = {**VERBS, "variant": partial(compute_variant, compute=described)}
"""All verbs; what is computed again costs nothing, and is stored and counted as before."""


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data directory in which the bank "first" was trained on four creatures."""
    folder = tmp_path_factory.mktemp("stock") / "data"
    bench = small_bench(folder)
    migrate(bench.settings)
    begin_bank(bench, "first", CREATURES)
    assert work(bench, verbs=QUICK) == ["variant"] * N_VARIANTS + ["fit-bank"]
    bench.database.dispose()
    return folder


@pytest.fixture
def bench(stock: Path, tmp_path: Path) -> Iterator[Workbench]:
    """A copy of it."""
    shutil.copytree(stock, tmp_path / "data")
    bench = small_bench(tmp_path / "data")
    yield bench
    bench.database.dispose()


def forget_variants(bench: Workbench) -> None:
    """Have all of them computed again."""
    shutil.rmtree(bench.settings.data_path / "blobs" / "variants")


def failing(error: Exception, *words: str) -> Mapping[str, Verb]:
    """Verbs with which the variants fail whose name has one of these words."""

    def fail(bench: Workbench, variant: Variant) -> Arrays:
        if any(word in variant.item for word in words):
            raise error
        return described(bench, variant)

    return {**VERBS, "variant": partial(compute_variant, compute=fail)}


# -- the plan ---------------------------------------------------------------------------------


def test_a_plan_has_every_shape_and_every_copy_of_it(bench: Workbench) -> None:
    variants = variants_for(bench, CREATURES)
    assert [variant.number for variant in variants] == list(range(N_VARIANTS))
    assert {variant.reference for variant in variants} == {0, 3, 6, 9}
    for variant in variants:
        shape = variants[variant.reference]
        assert (shape.change, shape.reference, shape.source) == (
            None,
            shape.number,
            variant.source,
        )
        assert Variant.from_payload(variant.to_payload()) == variant
    posed = {v.change.transformation: v.change.pose for v in variants if v.change}
    assert posed["scale"] is None  # decision 7
    assert posed["noise"] is not None
    assert len({variant.key for variant in variants}) == N_VARIANTS


def test_creatures_are_spread_over_species_and_then_have_near_twins(bench: Workbench) -> None:
    request = TrainingRequest(transformations=("noise",), strengths=(1,))
    shapes = [v for v in variants_for(bench, request) if v.change is None]
    assert len(shapes) == DEFAULT_CREATURES >= 60
    assert len(set(shapes)) == DEFAULT_CREATURES
    assert sum(shape.group == "human" for shape in shapes) >= 2
    more = variants_for(
        bench, TrainingRequest(transformations=("noise",), strengths=(1,), seed=100)
    )
    assert not {v.key for v in more} & {v.key for v in variants_for(bench, request)}


def test_every_other_species_is_meshed_unevenly_but_twins_alike(bench: Workbench) -> None:
    request = TrainingRequest(transformations=("noise",), strengths=(1,))
    meshed: dict[str, set[bool]] = {}
    for variant in variants_for(bench, request):
        assert isinstance(variant.source, CreatureSource)
        meshed.setdefault(variant.group, set()).add(variant.source.uneven)
    kinds = sorted(list(kind) for kind in meshed.values())
    assert kinds == [[False]] * (len(kinds) - len(kinds) // 2) + [[True]] * (len(kinds) // 2)


@pytest.mark.parametrize(
    ("request_", "error", "words"),
    [
        (TrainingRequest(creatures=4), InsufficientTrainingDataError, "no transformation"),
        (
            TrainingRequest(transformations=("noise",), creatures=1),
            InsufficientTrainingDataError,
            "1 shapes are there",
        ),
        (
            TrainingRequest(transformations=("melt",), creatures=4),
            InvalidRequestError,
            "there is no transformation 'melt'",
        ),
        (
            TrainingRequest(correspondence="vertex-order", creatures=4),
            InvalidRequestError,
            "simulates its transformations",
        ),
        (
            TrainingRequest(transformations=("noise", "holes"), creatures=1000),
            InvalidRequestError,
            "10000000 comparisons, expected at most 1000000",
        ),
        (
            TrainingRequest(transformations=("noise", "holes", "scale", "view"), creatures=1000),
            InvalidRequestError,
            "21000 variants of shapes are asked for, expected at most 20000",
        ),
    ],
)
def test_what_cannot_be_learned_from_is_refused(
    bench: Workbench, request_: TrainingRequest, error: type[ProteusError], words: str
) -> None:
    with pytest.raises(error, match=words):
        variants_for(bench, request_)


# -- the training -----------------------------------------------------------------------------


def test_a_training_ends_with_a_model_that_is_ready(bench: Workbench) -> None:
    report = definition(bench, "first")["training"]
    with bench.database.read() as session:
        model = load_model(session, "first")
    assert (model.method, model.fusion_power) == ("bank", 0.25)
    assert 1 <= len(model.channels) <= 16
    assert sum(channel.weight for channel in model.channels) == pytest.approx(1.0, abs=1e-3)
    assert {view.name for view in model.views} == {c.view for c in model.channels}
    assert {"solver", "preparation", "transformations", "creatures", "variants"} <= set(
        model.versions
    )
    assert (report["n_references"], report["n_queries"], report["n_groups"]) == (4, 8, 4)
    assert len(report["held_out_groups"]) == 1
    assert report["share_that_sees_scale"] == 0.0  # scale was trained
    assert report["failed_variants"] == []
    assert report["rows"]["training"]["map"]["scale"] == 100.0
    assert len(model.impostor_quantiles) > 10


def test_what_is_not_trained_is_not_forgotten(bench: Workbench) -> None:
    """Without the transformation scale, the size of a shape tells who it is."""
    begin_bank(bench, "sized", replace(CREATURES, transformations=("noise",)))
    work(bench, verbs=QUICK)
    found = definition(bench, "sized")
    assert (
        found["training"]["n_candidates"] > definition(bench, "first")["training"]["n_candidates"]
    )


def test_any_order_of_parts_gives_the_same_bytes(bench: Workbench, tmp_path: Path) -> None:
    other = small_bench(tmp_path / "other")
    migrate(other.settings)
    begin_bank(other, "first", CREATURES)
    work(other, order=random.Random(1))
    assert definition(other, "first") == definition(bench, "first")
    other.database.dispose()


def test_a_second_training_on_the_same_shapes_describes_nothing_again(
    bench: Workbench,
) -> None:
    begin_bank(bench, "smaller", CREATURES, channels=4)
    work(bench, verbs=failing(AssertionError("made again"), ""))
    assert len(definition(bench, "smaller")["channels"]) == 4


def test_a_variant_that_fails_by_itself_is_named_and_the_rest_goes_on(
    bench: Workbench,
) -> None:
    forget_variants(bench)
    job = begin_bank(bench, "less", CREATURES)
    work(bench, verbs=failing(InvalidMeshError("it is torn"), "human 0 noise"))
    row = job_row(bench, job)
    named = {"item": "human 0 noise 2", "type": "invalid-mesh", "detail": "it is torn"}
    assert (row.state, row.done, row.failed, row.errors) == ("succeeded", N_VARIANTS, 1, [named])
    report = definition(bench, "less")["training"]
    assert (report["n_queries"], report["failed_variants"]) == (7, [named])


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("",), "all 12 variants failed; the first, human 0: it is torn"),
        (("noise", "scale"), "none of 4 descriptors is of a transformed copy"),
    ],
)
def test_too_few_variants_fail_the_training_and_leave_no_model(
    bench: Workbench, words: tuple[str, ...], reason: str
) -> None:
    forget_variants(bench)
    job = begin_bank(bench, "none", CREATURES)
    work(bench, verbs=failing(InvalidMeshError("it is torn"), *words))
    row = job_row(bench, job)
    assert (row.state, state(bench, "none")) == ("failed", "failed")
    assert row.errors[-1]["type"] == "insufficient-training-data"
    assert reason in row.errors[-1]["detail"]


def test_lost_variants_fail_the_training_and_a_retry_gives_the_undisturbed_model(
    bench: Workbench,
) -> None:
    with bench.database.begin() as session:
        session.query(Part).delete()
    expected = definition(bench, "first")
    forget_variants(bench)
    job = begin_bank(bench, "again", CREATURES)
    work(bench, verbs=failing(MemoryError(), "human 0 noise"))
    row = job_row(bench, job)
    assert (row.state, state(bench, "again")) == ("failed", "failed")
    assert [error["type"] for error in row.errors] == ["internal-error", "model-not-ready"]
    assert "1 of 12 variants were not computed" in row.errors[-1]["detail"]
    with bench.database.begin() as session:
        retry_job(session, job)
    assert work(bench, order=random.Random(5), verbs=QUICK)[-1] == "fit-bank"
    assert {**definition(bench, "again"), "name": "first"} == expected


def test_variants_of_which_nothing_is_stored_are_computed_again(bench: Workbench) -> None:
    """As after an update of the program in the middle of a training."""
    job = begin_bank(bench, "again", CREATURES)
    with bench.database.read() as session:
        parts = session.scalars(select(Part.id).where(Part.state == "queued")).all()
    for part in parts:
        run_part(bench, part, message=part)
    forget_variants(bench)
    assert work(bench, verbs=QUICK) == ["fit-bank", *["variant"] * N_VARIANTS, "fit-bank"]
    assert job_row(bench, job).done == N_VARIANTS
    assert {**definition(bench, "again"), "name": "first"} == definition(bench, "first")


def test_a_cancelled_training_goes_on_when_it_is_retried(bench: Workbench) -> None:
    job = begin_bank(bench, "later", CREATURES)
    with bench.database.begin() as session:
        cancel_job(session, job)
    assert (work(bench), state(bench, "later")) == ([], "failed")
    with bench.database.begin() as session:
        retry_job(session, job)
    work(bench)
    assert {**definition(bench, "later"), "name": "first"} == definition(bench, "first")


def test_copies_of_a_shape_without_a_descriptor_are_left_out(bench: Workbench) -> None:
    variants = variants_for(bench, CREATURES)
    width = candidate_model(variants[0].views, power=0.25).dimension
    descriptors = [np.full(width, variant.number, dtype=np.float32) for variant in variants]
    shapes = arrange_copies(variants[1:], descriptors[1:])
    assert shapes.names == tuple(variants[i].item for i in (3, 6, 9))
    assert shapes.truth.tolist() == [0, 0, 1, 1, 2, 2]
    assert shapes.queries[:, 0].tolist() == [4, 5, 7, 8, 10, 11]
