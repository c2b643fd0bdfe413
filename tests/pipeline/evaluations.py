"""A small benchmark of shapes whose descriptors are made up, and its evaluations."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import select

from workers.geometry.arrays import Float32Array
from workers.geometry.formats.naming import read_name
from workers.pipeline.evaluation_plan import (
    EvaluationRequest,
    frame_to_evaluate,
    plan_evaluation,
    store_frame,
)
from workers.pipeline.outcome import Verb
from workers.pipeline.redescribe import redescribe
from workers.pipeline.verbs import VERBS
from workers.pipeline.work import run_part, run_pending
from workers.pipeline.workbench import Workbench
from workers.retrieval.builtin import built_in_models
from workers.retrieval.evaluation import summarise
from workers.retrieval.model import Model
from workers.retrieval.protocol import EvaluatedShape, make_protocol
from workers.retrieval.ranking import rank_queries
from workers.retrieval.scan import distances
from workers.settings import Settings
from workers.storage.arrays import vector_to_bytes
from workers.storage.blobs import BlobStore
from workers.storage.collections import (
    get_collection,
)
from workers.storage.database import Database
from workers.storage.descriptors import store_descriptors
from workers.storage.evaluations import EvaluationView, get_evaluation
from workers.storage.identifiers import new_id
from workers.storage.jobs import get_job
from workers.storage.models import Job, Part, Shape
from workers.storage.shapes import NewShape, create_shape

MODELS = {model.name: model for model in built_in_models()}
BENCHMARK = (
    "cat.null.0.off", "dog.null.0.off", "owl.null.0.off", "chair.off",
    *(f"{label}.{kind}.{n}.off" for label in ("cat", "dog", "owl")
      for kind in ("holes", "all", "isometry") for n in (1, 2)),
)  # fmt: skip


def fake_descriptor(shape: Shape, model: Model) -> Float32Array:
    """Deterministic; shapes whose names begin alike are alike, but not very."""
    own = np.random.default_rng(
        int(sha256(f"{shape.sha256}{model.method}".encode()).hexdigest(), 16)
    )
    kin = np.random.default_rng(int(sha256(shape.name[:3].encode()).hexdigest(), 16))
    vector = own.random(model.dimension) + 0.6 * kin.random(model.dimension)
    described: Float32Array = (vector / vector.sum()).astype(np.float32)
    return described


def fake_description(_: Workbench, shape: Shape, model: Model) -> Float32Array:
    """In the place of what is computed from spectra."""
    return fake_descriptor(shape, model)


DESCRIBED_BY_NAME: Mapping[str, Verb] = {
    **VERBS,
    "describe": partial(redescribe, describe_shape=fake_description),
}
"""All verbs, but descriptors are made up."""


@dataclass
class Zoo:
    """A collection of shapes whose descriptors are made up, and a worker."""

    database: Database
    blobs: BlobStore
    settings: Settings
    verbs: Mapping[str, Verb] = field(default_factory=lambda: DESCRIBED_BY_NAME)

    def with_verb(self, kind: str, verb: Verb) -> "Zoo":
        """The same with another verb for a kind of part."""
        return replace(self, verbs={**self.verbs, kind: verb})

    def add(self, *names: str, described: bool = True) -> list[str]:
        with self.database.begin() as session:
            collection = get_collection(session, "zoo")
            ids = []
            for name in names:
                named = read_name(name)
                shape = NewShape(sha256=sha256(name.encode()).hexdigest(), n_bytes=1, **vars(named))
                ids.append(create_shape(session, collection.id, shape)[0])
            rows = [session.get_one(Shape, i) for i in ids] if described else []
            heat = MODELS["heat"]
            vectors = [(r.id, "heat", vector_to_bytes(fake_descriptor(r, heat))) for r in rows]
            store_descriptors(session, collection.id, vectors)
        return ids

    def ask(self, *models: str, dissimilarity: str | None = None) -> tuple[str, str]:
        request = EvaluationRequest("zoo", models, dissimilarity)
        evaluation_id = new_id()
        with self.database.read() as session:
            frame = frame_to_evaluate(session, request)
        digest = store_frame(self.blobs, evaluation_id, frame)
        with self.database.begin() as session:
            _, job, _ = plan_evaluation(session, request, evaluation_id=evaluation_id, frame=digest)
        return evaluation_id, job.id

    def work(self) -> int:
        return run_pending(self.database, self.blobs, self.settings, verbs=self.verbs)

    @property
    def bench(self) -> Workbench:
        return Workbench(self.database, self.blobs, self.settings, lambda _parts: None)

    def queued(self, job: str) -> list[tuple[str, str]]:
        with self.database.read() as session:
            waiting = select(Part.id, Part.kind).where(Part.job_id == job, Part.state == "queued")
            return [(row.id, row.kind) for row in session.execute(waiting.order_by(Part.id))]

    def run(self, part_id: str) -> None:
        run_part(self.bench, part_id, message="m", verbs=self.verbs)

    def job(self, job_id: str) -> Job:
        with self.database.read() as session:
            return get_job(session, job_id)

    def view(self, evaluation_id: str) -> EvaluationView:
        with self.database.read() as session:
            return get_evaluation(session, evaluation_id)

    def result(self, evaluation_id: str) -> tuple[Any, Any]:
        view = self.view(evaluation_id)
        assert view.state == "succeeded", self.job(view.row.job_id).errors
        return view.row.result, view.row.ranks

    def blob_files(self) -> list[Path]:
        folder = Path(self.settings.data_dir) / "blobs" / "evaluations"
        return [path for path in folder.rglob("*") if path.is_file()]


def expected_result(park: Zoo, *models: str, without: str = "") -> dict[str, Any]:
    """The same figures from a whole matrix of distances."""
    with park.database.read() as session:
        rows = list(session.scalars(select(Shape).where(Shape.id != without)))
    protocol = make_protocol(
        EvaluatedShape(r.id, r.name, r.label, r.transformation, r.strength) for r in rows
    )
    by_id = {row.id: row for row in rows}
    rankings = {}
    for name in models:
        model = MODELS[name]
        matrix = np.stack([fake_descriptor(by_id[s.id], model) for s in protocol.shapes])
        far = np.stack(
            [distances(matrix[q], matrix[protocol.targets], model) for q in protocol.queries]
        )
        rankings[name] = rank_queries(protocol, far.__getitem__)
    return {
        "n_queries": len(protocol.queries),
        "n_targets": len(protocol.targets),
        **summarise(protocol, rankings).to_json(),
    }


def assert_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    assert {name: found[name] for name in expected} == expected
