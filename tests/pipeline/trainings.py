"""Trainings as the API makes them, without the API."""

import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import select

from workers.geometry.views import default_view
from workers.pipeline.outcome import Verb
from workers.pipeline.solve import parse_upload
from workers.pipeline.training.training_plan import choose_pairs, choose_variants, plan_training
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.jobs import get_job
from workers.storage.models import Job, Part
from workers.storage.trained_models import get_model
from workers.training.examples import Pair, Variant
from workers.training.learning_options import LearningOptions
from workers.training.request import TrainingRequest
from workers.training.sources import StoredSource

CREATURES = TrainingRequest(transformations=("scale", "noise"), strengths=(3,), shapes=3)


def small_bench(folder: Path) -> Workbench:
    """Rows and blobs in a folder; working meshes are small."""
    settings = Settings(data_dir=folder, working_vertices=500, worker_processes=1)
    database = Database(settings.resolved_database_url)
    return Workbench(database, BlobStore(settings.resolved_blob_url), settings, lambda parts: None)


def pairs_for(
    bench: Workbench, request: TrainingRequest = CREATURES, *, criterion: str = "distance"
) -> list[Pair]:
    """Pairs that a request leads to."""

    def count_vertices(source: StoredSource) -> int:
        parsed = parse_upload(
            bench.blobs, source.sha256, filename=source.name, settings=bench.settings
        )
        return parsed.mesh.n_vertices

    with bench.database.read() as session:
        return choose_pairs(
            session,
            request,
            view=default_view(working_vertices=bench.settings.working_vertices),
            criterion=criterion,
            working_vertices=bench.settings.working_vertices,
            count_vertices=count_vertices,
        )


def begin_training(
    bench: Workbench,
    name: str,
    request: TrainingRequest = CREATURES,
    *,
    method: str = "spline",
    **options: Any,
) -> str:
    """Commit a training; returns its job, nothing is computed yet."""
    parameters = LearningOptions.from_json(method, options).to_json()
    pairs = pairs_for(bench, request, criterion=parameters["criterion"])
    with bench.database.begin() as session:
        job, _ = plan_training(
            session,
            name=name,
            method=method,
            parameters={**parameters, "view": "closed"},
            training=request.to_json(),
            pairs=pairs,
        )
    return job.id


def variants_for(bench: Workbench, request: TrainingRequest) -> list[Variant]:
    """Variants that a request leads to, under one view."""
    vertices = bench.settings.working_vertices
    with bench.database.read() as session:
        return choose_variants(
            session,
            request,
            views=[default_view(working_vertices=vertices)],
            working_vertices=vertices,
        )


def begin_bank(bench: Workbench, name: str, request: TrainingRequest, *, channels: int = 16) -> str:
    """Commit the training of a bank; returns its job, nothing is computed yet."""
    variants = variants_for(bench, request)
    with bench.database.begin() as session:
        job, _ = plan_training(
            session,
            name=name,
            method="bank",
            parameters={"views": ["closed"], "power": 0.25, "channels": channels},
            training=request.to_json(),
            variants=variants,
        )
    return job.id


def work(
    bench: Workbench,
    *,
    order: random.Random | None = None,
    verbs: Mapping[str, Verb] = VERBS,
) -> list[str]:
    """Run all that is queued, each time one chosen at random; returns what was run."""
    done: list[str] = []
    while True:
        with bench.database.read() as session:
            queued: Sequence[Part] = session.scalars(
                select(Part).where(Part.state == "queued").order_by(Part.id)
            ).all()
        if not queued:
            return done
        part = order.choice(queued) if order else queued[0]
        run_part(bench, part.id, message=f"in-process-{part.id}", verbs=verbs)
        done.append(part.kind)


def stored_at(bench: Workbench, folder: str) -> dict[str, int]:
    """When each blob of a folder was stored, in nanoseconds: a second time changes it."""
    root = bench.settings.data_path / "blobs" / folder
    return {str(path): path.stat().st_mtime_ns for path in root.rglob("*") if path.is_file()}


def definition(bench: Workbench, name: str) -> dict[str, Any]:
    """Definition of a model that is ready."""
    with bench.database.read() as session:
        view = get_model(session, name)
    assert view.state == "ready"
    return view.row.definition


def state(bench: Workbench, name: str) -> str:
    """State of a model."""
    with bench.database.read() as session:
        return get_model(session, name).state


def job_row(bench: Workbench, job_id: str) -> Job:
    """A job as it is now."""
    with bench.database.read() as session:
        return get_job(session, job_id)
