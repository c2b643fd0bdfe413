"""A bank's windows: learned in its own job, the same by every way, or the shipped model's."""

import random
import shutil
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from tests.meshes import bumpy_sphere
from tests.pipeline.trainings import (
    begin_bank,
    definition,
    job_row,
    small_bench,
    state,
    variants_for,
    work,
)
from workers.creatures import TRAINING_SPECIES, make_creature
from workers.errors import InvalidMeshError
from workers.geometry.formats import write
from workers.pipeline.outcome import Verb
from workers.pipeline.progress import Progress
from workers.pipeline.training.results import Arrays
from workers.pipeline.training.variant import compute_variant, describe_variant
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.storage.blobs import mesh_key
from workers.storage.collections import create_collection, get_collection
from workers.storage.descriptors import store_descriptors
from workers.storage.jobs import cancel_job, retry_job
from workers.storage.migrate import migrate
from workers.storage.models import Part, Shape
from workers.storage.shapes import NewShape, create_shape
from workers.storage.shipped_models import shipped_model
from workers.storage.trained_models import load_model
from workers.training import chosen_windows
from workers.training.examples import Variant
from workers.training.request import TrainingRequest

N_SHAPES, N_BANK, EACH = 4, 4 + 4 * 2, 4
N_VARIANTS = N_BANK + N_SHAPES * (1 + EACH)
CREATURES = TrainingRequest(transformations=("scale", "noise"), strengths=(2,), creatures=N_SHAPES)

COMPUTED: dict[str, Arrays] = {}


def described(bench: Workbench, variant: Variant) -> Arrays:
    """What is computed of a variant, once for all trainings."""
    if variant.key not in COMPUTED:
        COMPUTED[variant.key] = describe_variant(bench, variant)
    return COMPUTED[variant.key]


QUICK: Mapping[str, Verb] = {**VERBS, "variant": partial(compute_variant, compute=described)}


@pytest.fixture(scope="module", autouse=True)
def few() -> Iterator[None]:
    """Four shapes and sixteen copies of four kinds are enough."""
    with pytest.MonkeyPatch.context() as patch:
        kinds = (("partial", (2, 4)), ("isometry", (3,)), ("sampling", (2,)))
        patch.setattr(chosen_windows, "COPIES", kinds)
        patch.setattr(chosen_windows, "FEWEST_SHAPES", N_SHAPES)
        patch.setattr(chosen_windows, "FEWEST_COPIES", N_SHAPES * EACH)
        patch.setattr(chosen_windows, "SHARE", 2.0)
        yield


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


def failing(*words: str) -> Mapping[str, Verb]:
    """Verbs with which the variants fail whose name has all of these words."""

    def fail(bench: Workbench, variant: Variant) -> Arrays:
        if all(word in variant.item for word in words):
            raise InvalidMeshError("it is torn")
        return described(bench, variant)

    return {**VERBS, "variant": partial(compute_variant, compute=fail)}


def windows_of(bench: Workbench, name: str) -> dict[str, Any]:
    """What the report of a training says of windows."""
    found: dict[str, Any] = definition(bench, name)["training"]["windows"]
    return found


def test_a_bank_learns_its_own_windows(bench: Workbench) -> None:
    report = windows_of(bench, "first")
    assert report["learned"]
    assert (report["n_shapes"], report["n_copies"], report["n_groups"]) == (4, 16, 4)
    assert report["n_pairs"] > 200
    rows = report["rows"]
    assert set(rows["bank"]["map"]) == set(rows["with_windows"]["map"])
    assert set(rows["bank"]["map"]) == {"partial", "isometry", "sampling"}
    assert rows["with_windows"]["map"]["partial"] > 60.0  # chance is 52
    with bench.database.read() as session:
        windows = load_model(session, "first").windows
    shipped = shipped_model(working_vertices=500).windows
    assert windows is not None
    assert shipped is not None
    assert windows.view == shipped.view
    assert windows.version == shipped.version
    assert len(windows.impostor_quantiles) > 10
    assert windows.whitening.to_json() != shipped.whitening.to_json()
    assert windows.trust != shipped.trust


def test_the_bank_itself_does_not_change(bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chosen_windows, "FEWEST_SHAPES", N_SHAPES + 1)
    begin_bank(bench, "plain", CREATURES)
    assert work(bench, verbs=QUICK) == ["variant"] * N_BANK + ["fit-bank"]
    plain, own = definition(bench, "plain"), definition(bench, "first")
    reason = "4 shapes and 16 copies are there to learn windows from, expected at least 5 and 16"
    assert plain["training"]["windows"] == {"learned": False, "reason": reason}
    shipped = shipped_model(working_vertices=500).windows
    assert shipped is not None
    assert plain["windows"] == shipped.to_json()
    assert {**plain, "name": 0, "training": 0, "windows": 0} == {
        **own,
        "name": 0,
        "training": 0,
        "windows": 0,
    }
    assert plain["training"]["rows"] == own["training"]["rows"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("windows of human 0",), "3 shapes and 12 copies are there"),
        (("windows of", "partial"), "4 shapes and 8 copies are there"),
        (("windows of",), "0 shapes and 0 copies are there"),
    ],
)
def test_where_too_little_is_left_windows_are_those_of_the_shipped_model(
    bench: Workbench, words: tuple[str, ...], reason: str
) -> None:
    forget_variants(bench)
    job = begin_bank(bench, "less", CREATURES)
    work(bench, verbs=failing(*words))
    report = windows_of(bench, "less")
    assert not report["learned"]
    assert reason in report["reason"]
    row = job_row(bench, job)
    assert row.state == "succeeded"
    assert row.failed == len(row.errors) > 0
    own, other = definition(bench, "first"), definition(bench, "less")
    assert own["channels"] == other["channels"]


def test_a_copy_that_fails_is_named_and_the_others_teach(
    bench: Workbench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chosen_windows, "FEWEST_COPIES", 15)
    forget_variants(bench)
    job = begin_bank(bench, "less", CREATURES)
    work(bench, verbs=failing("windows of human 0 isometry 3"))
    named = {
        "item": "windows of human 0 isometry 3",
        "type": "invalid-mesh",
        "detail": "it is torn",
    }
    assert job_row(bench, job).errors == [named]
    assert definition(bench, "less")["training"]["failed_variants"] == [named]
    assert windows_of(bench, "less")["n_copies"] == 15


def test_one_process_and_two_give_the_same_bytes(bench: Workbench, tmp_path: Path) -> None:
    """What two processes compute, put together in any order, is what one has computed."""
    other = small_bench(tmp_path / "other")
    migrate(other.settings)
    variants = variants_for(other, CREATURES)
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        payloads = [one.to_payload() for one in variants]
        running = pool.map(computed_apart, payloads, chunksize=3)
        apart = dict(zip((one.key for one in variants), running, strict=True))
    begin_bank(other, "first", CREATURES)
    verb = partial(compute_variant, compute=lambda _, variant: apart[variant.key])
    work(other, order=random.Random(1), verbs={**VERBS, "variant": verb})
    assert definition(other, "first") == definition(bench, "first")
    other.database.dispose()


def computed_apart(payload: dict[str, Any]) -> Arrays:
    """A variant of a creature, in a process that has no database."""
    nowhere: Any = None
    return describe_variant(nowhere, Variant.from_payload(payload))


def test_a_training_that_is_cancelled_in_the_middle_goes_on_when_it_is_retried(
    bench: Workbench,
) -> None:
    forget_variants(bench)
    job = begin_bank(bench, "later", CREATURES)
    queued = select(Part).where(Part.state == "queued").order_by(Part.id)
    with bench.database.read() as session:
        parts = session.scalars(queued).all()
    for part in parts[: N_BANK + 5]:  # a shape with its copies is done
        run_part(bench, part.id, message=part.id, verbs=QUICK)
    with bench.database.begin() as session:
        cancel_job(session, job)
    assert (work(bench), state(bench, "later")) == ([], "failed")
    with bench.database.begin() as session:
        retry_job(session, job)
    assert len(work(bench, verbs=QUICK)) == len(parts) - N_BANK - 5 + 1
    assert {**definition(bench, "later"), "name": "first"} == definition(bench, "first")


def test_a_job_counts_what_it_takes_windows_of_and_says_what_it_does(bench: Workbench) -> None:
    steps: list[str] = []

    class Told(Progress):
        def enter(self, step: str) -> None:
            steps.append(step)

    job = begin_bank(bench, "told", CREATURES)
    work(replace(bench, progress=Told()), verbs=QUICK)
    assert steps == ["transforming"] * N_VARIANTS + ["learning", "searching", "learning"]
    row = job_row(bench, job)
    assert (row.done, row.total) == (N_VARIANTS, N_VARIANTS)


def test_windows_are_learned_from_the_shapes_of_a_collection(bench: Workbench) -> None:
    """Two creatures and two spheres with bumps of one label: these are not told from each other."""
    meshes = [make_creature(name, seed=3, vertices=2000).rest for name in TRAINING_SPECIES[:2]]
    meshes += [bumpy_sphere(4, seed) for seed in (1, 2)]
    labels = (*TRAINING_SPECIES[:2], "ball", "ball")
    with bench.database.begin() as session:
        create_collection(session, name="zoo", description="", model="heat")
        row = get_collection(session, "zoo")
        for number, (mesh, label) in enumerate(zip(meshes, labels, strict=True)):
            data = write(mesh, "ply")
            digest = f"{number:064x}"
            bench.blobs.put(mesh_key(digest), data)
            shape = NewShape(sha256=digest, n_bytes=len(data), name=f"{number}.ply", label=label)
            shape_id, _ = create_shape(session, row.id, shape)
            session.get_one(Shape, shape_id).n_vertices = mesh.n_vertices
            store_descriptors(session, row.id, [(shape_id, "heat", b"\0\0\0\0")])
        assert session.scalar(select(func.count()).select_from(Shape)) == 4
    begin_bank(bench, "own", replace(CREATURES, collection="zoo", creatures=None))
    work(bench)
    report = windows_of(bench, "own")
    assert report["learned"]
    assert (report["n_shapes"], report["n_copies"], report["n_groups"]) == (4, 16, 3)
    assert windows_of(bench, "own") != windows_of(bench, "first")
