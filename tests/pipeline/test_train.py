"""From pairs of shapes to a model: the same one by every way, or none."""

import random
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sqlalchemy import select

from tests.pipeline.trainings import (
    begin_training,
    definition,
    job_row,
    pairs_for,
    small_bench,
    state,
    stored_at,
    work,
)
from workers.errors import BlobNotFoundError, ConflictError, NameTakenError, SpectrumError
from workers.pipeline.outcome import Verb
from workers.pipeline.training.pair import (
    MeasuredPair,
    compute_pair,
    measure_pair,
    points_of_pair,
)
from workers.pipeline.training.results import load_result
from workers.pipeline.training.training_plan import add_untrained
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.retrieval.builtin import built_in_models
from workers.retrieval.calibration import typical_distance
from workers.retrieval.model import Model
from workers.storage.jobs import cancel_job, retry_job
from workers.storage.migrate import migrate
from workers.storage.models import Part
from workers.storage.parts import Failure
from workers.storage.trained_models import delete_model, load_model
from workers.training.examples import Pair

N_PAIRS = 6


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data directory in which the model "first" was trained on six pairs."""
    folder = tmp_path_factory.mktemp("stock") / "data"
    bench = small_bench(folder)
    migrate(bench.settings)
    begin_training(bench, "first")
    assert work(bench) == ["pair"] * N_PAIRS + ["fit"]
    bench.database.dispose()
    return folder


@pytest.fixture
def bench(stock: Path, tmp_path: Path) -> Iterator[Workbench]:
    """A copy of it."""
    shutil.copytree(stock, tmp_path / "data")
    bench = small_bench(tmp_path / "data")
    yield bench
    bench.database.dispose()


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Workbench]:
    """Nothing but the built-in models."""
    bench = small_bench(tmp_path / "empty")
    migrate(bench.settings)
    yield bench
    bench.database.dispose()


def forget_pairs(bench: Workbench) -> None:
    """Have the moments computed again; spectra stay."""
    shutil.rmtree(bench.settings.data_path / "blobs" / "pairs")


def failing(error: Exception, *words: str) -> Mapping[str, Verb]:
    """Verbs with which the pairs fail whose name has one of these words."""

    def fail(bench: Workbench, pair: Pair) -> MeasuredPair:
        if any(word in pair.item for word in words):
            raise error
        return measure_pair(bench, pair)

    return {**VERBS, "pair": partial(compute_pair, measure=fail)}


def test_a_training_ends_with_a_model_that_is_ready(bench: Workbench) -> None:
    found = definition(bench, "first")
    with bench.database.read() as session:
        model = load_model(session, "first")
    (channel,) = model.channels
    assert (model.method, model.parameters["view"], channel.normalisation) == (
        "spline",
        "closed",
        "first-eigenvalue",
    )
    assert {"solver", "preparation", "transformations", "creatures"} <= model.versions.keys()
    report = found["training"]
    assert (report["n_pairs"], report["n_failed_pairs"], report["failed_pairs"]) == (6, 0, [])
    assert list(report["shape_counts"].values()) == [1, 1, 1]
    assert report["transformations"] == ["scale", "noise"]
    assert report["criterion"]["training"]["learned"] < report["criterion"]["training"]["heat"]


def test_similarity_of_a_learned_model_has_its_own_scale(bench: Workbench) -> None:
    model = Model.from_json(definition(bench, "first"))
    assert set(model.typical_distances) >= {"l1", "l2", "earth-movers"}
    assert typical_distance(model, "l2") == model.typical_distances["l2"] > 0.0
    assert typical_distance(model) == model.typical_distances["l1"] <= 2.0


def test_any_order_of_parts_gives_the_same_bytes(empty: Workbench, bench: Workbench) -> None:
    begin_training(empty, "first")
    work(empty, order=random.Random(1))
    assert definition(empty, "first") == definition(bench, "first")


def test_a_second_training_on_the_same_shapes_solves_nothing_again(
    bench: Workbench,
) -> None:
    spectra = stored_at(bench, "spectra")
    begin_training(bench, "kernels", criterion="kernel")  # other moments of the same spectra
    assert work(bench) == ["pair"] * N_PAIRS + ["fit"]
    assert definition(bench, "kernels")["training"]["n_pairs"] == N_PAIRS
    moments = stored_at(bench, "pairs")
    begin_training(bench, "gridded", method="grid")  # another method on the same moments
    begin_training(bench, "timed", method="heat-time")
    work(bench)
    assert len(moments) == 2 * N_PAIRS
    assert (stored_at(bench, "spectra"), stored_at(bench, "pairs")) == (spectra, moments)
    report = definition(bench, "timed")["training"]
    assert report["heat_time"] == definition(bench, "gridded")["training"]["heat_time"]
    assert definition(bench, "timed")["channels"][0]["kernel"] == {
        "kind": "heat",
        "parameters": {"time": report["heat_time"]},
    }


def test_a_pair_that_fails_by_itself_is_named_and_the_rest_goes_on(bench: Workbench) -> None:
    forget_pairs(bench)
    job = begin_training(bench, "less")
    work(bench, verbs=failing(SpectrumError("no eigenpairs"), "human 0 noise"))
    row = job_row(bench, job)
    assert (row.state, row.done, row.failed) == ("succeeded", 6, 1)
    named = {"item": "human 0 noise 3", "type": "spectrum", "detail": "no eigenpairs"}
    assert row.errors == [named]
    report = definition(bench, "less")["training"]
    assert (report["n_pairs"], report["failed_pairs"]) == (5, [named])


def test_too_few_pairs_fail_the_training_and_leave_no_model(bench: Workbench) -> None:
    forget_pairs(bench)
    job = begin_training(bench, "none")
    work(bench, verbs=failing(SpectrumError("no eigenpairs"), " 0 "))
    row = job_row(bench, job)
    assert (row.state, state(bench, "none")) == ("failed", "failed")
    assert row.errors[-1]["type"] == "insufficient-training-data"
    with bench.database.begin() as session:
        delete_model(session, "none")
    begin_training(bench, "none")  # the name is free again


def test_lost_pairs_fail_the_training_and_a_retry_gives_the_undisturbed_model(
    bench: Workbench,
) -> None:
    """Were it fitted without them, the model would depend on which worker died when."""
    with bench.database.begin() as session:
        session.query(Part).delete()
    expected = definition(bench, "first")
    forget_pairs(bench)
    job = begin_training(bench, "again")
    work(bench, verbs=failing(MemoryError(), "human 0 noise"))
    row = job_row(bench, job)
    assert (row.state, state(bench, "again")) == ("failed", "failed")
    assert [error["type"] for error in row.errors] == ["internal-error", "model-not-ready"]
    with bench.database.begin() as session:
        retry_job(session, job)
    assert state(bench, "again") == "training"
    kinds = work(bench, order=random.Random(5))  # the fit may come before the last pair
    assert kinds[-1] == "fit"
    assert job_row(bench, job).state == "succeeded"
    assert {**definition(bench, "again"), "name": "first"} == expected


def test_a_cancelled_training_goes_on_when_it_is_retried(bench: Workbench) -> None:
    job = begin_training(bench, "later")
    with bench.database.begin() as session:
        cancel_job(session, job)
    assert (work(bench), state(bench, "later")) == ([], "failed")
    with bench.database.begin() as session:
        retry_job(session, job)
    work(bench)
    assert {**definition(bench, "later"), "name": "first"} == definition(bench, "first")


def test_a_name_is_taken_while_its_model_is_trained(bench: Workbench) -> None:
    job = begin_training(bench, "mine")
    with pytest.raises(NameTakenError, match="in training"):
        begin_training(bench, "mine")
    with bench.database.begin() as session, pytest.raises(ConflictError, match=job):
        delete_model(session, "mine")
    with bench.database.begin() as session:
        cancel_job(session, job)
    with pytest.raises(NameTakenError, match="failed; delete it"):
        begin_training(bench, "mine")


def test_pairs_of_which_nothing_is_stored_are_computed_again(bench: Workbench) -> None:
    """As after an update of the program in the middle of a training."""
    job = begin_training(bench, "again")
    with bench.database.read() as session:
        pairs = session.scalars(select(Part.id).where(Part.state == "queued")).all()
    for part in pairs:
        run_part(bench, part, message=part)
    forget_pairs(bench)
    assert work(bench) == ["fit", *["pair"] * N_PAIRS, "fit"]
    row = job_row(bench, job)
    assert (row.state, row.done, row.total) == ("succeeded", N_PAIRS, N_PAIRS)
    assert {**definition(bench, "again"), "name": "first"} == definition(bench, "first")


def test_a_pair_that_is_computed_again_is_not_counted_as_failed_before(bench: Workbench) -> None:
    """It failed once; then nothing was stored of any pair, and it failed again or did not."""
    for verbs, failed in ((failing(SpectrumError("no eigenpairs"), "noise"), 3), (VERBS, 0)):
        forget_pairs(bench)
        job = begin_training(bench, f"failed-{failed}")
        with bench.database.read() as session:
            pairs = session.scalars(select(Part.id).where(Part.state == "queued")).all()
        for part in pairs:
            run_part(
                bench, part, message=part, verbs=failing(SpectrumError("no eigenpairs"), "noise")
            )
        assert job_row(bench, job).failed == 3
        forget_pairs(bench)
        assert work(bench, verbs=verbs) == ["fit", *["pair"] * N_PAIRS, "fit"]
        row = job_row(bench, job)
        assert (row.done, row.failed, len(row.errors)) == (N_PAIRS, failed, failed)


def test_a_model_that_was_deleted_is_not_brought_back_by_a_retry(bench: Workbench) -> None:
    job = begin_training(bench, "gone")
    with bench.database.begin() as session:
        cancel_job(session, job)
        delete_model(session, "gone")
    other = built_in_models(working_vertices=500)[1]
    with bench.database.begin() as session:
        add_untrained(session, replace(other, name="gone"))
        retry_job(session, job)
    work(bench)
    assert job_row(bench, job).errors[-1]["type"] == "model-not-found"
    assert definition(bench, "gone")["method"] == other.method


def test_points_of_a_scaled_creature_correspond_exactly(bench: Workbench) -> None:
    """φ of αX is φ/α, at the same points up to the precision in which eigenvectors are stored."""
    scales = [pair for pair in pairs_for(bench) if " scale " in pair.item]
    assert len(scales) == N_PAIRS // 2
    for pair in scales:
        found = load_result(bench.blobs, pair)
        assert not isinstance(found, Failure)
        moments = MeasuredPair.from_arrays(found).moments
        points = points_of_pair(bench, pair)
        ratio = moments.transformed_area / moments.area
        assert_allclose(moments.eigenvalues, moments.transformed_eigenvalues, rtol=0.05)
        first = np.abs(points.points[:, 0])
        second = np.abs(points.transformed_points[:, 0]) * np.sqrt(ratio)
        assert_allclose(first, second, atol=0.02 * first.max())
        assert_allclose(points.weights.sum(), 1.0)


def test_errors_say_what_was_found(bench: Workbench) -> None:
    """A blob that is gone is no reason of the pair's own: the training waits for a retry."""
    job = begin_training(bench, "broken")
    forget_pairs(bench)
    work(bench, verbs=failing(BlobNotFoundError("the store is gone"), ""))
    assert {error["type"] for error in job_row(bench, job).errors} == {
        "blob-not-found",
        "model-not-ready",
    }
    assert state(bench, "broken") == "failed"
