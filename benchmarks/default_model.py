"""Trains the model that comes with Proteus, from creatures alone: ``make train-default``.

It starts a service of its own, asks it for a bank over HTTP as anybody could, and writes what came
out into the package. Interrupted, the same command goes on where it was; nothing in it is random.
"""

import argparse
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from proteus.cli.bank import show_bank
from proteus.cli.embedded import service_for
from proteus.cli.errors import guarded
from proteus.client import Client, Document, ServiceError
from proteus.terminal.output import Output
from proteus.terminal.waiting import require_success, wait_for_job
from service.schemas.training import DEFAULT_VIEWS
from workers.creatures import TRAINING_SPECIES, make_creature
from workers.geometry.preparation import PREPARATION_VERSION
from workers.geometry.solution import solve
from workers.retrieval.model import Model, describe
from workers.settings import Settings, load_settings
from workers.storage.database import Database
from workers.storage.shipped_models import FOLDER, write_shipped
from workers.storage.trained_models import get_model
from workers.training.bank import BANK_VERSION, MOST_CHANNELS, POWER
from workers.training.examples import VARIANT_VERSIONS
from workers.training.planned_variants import DEFAULT_CREATURES
from workers.transformations import PAPER_TRANSFORMATIONS, STRENGTHS

WITNESS_VERTICES = 4000
WITNESS_DIGITS = 4


def request_body(
    *,
    creatures: int,
    transformations: Sequence[str],
    strengths: Sequence[int],
    views: Sequence[str],
) -> Document:
    """Return what is asked of the service.

    The name says what is asked, so that what was trained for something else is not taken for it.
    """
    asked: Document = {
        "method": "bank",
        "parameters": {
            "power": POWER,
            "channels": MOST_CHANNELS,
            "views": list(views),
        },
        "training": {
            "collection": None,
            "creatures": creatures,
            "transformations": list(transformations),
            "strengths": list(strengths),
            "seed": 0,
        },
    }
    told = json.dumps([asked, BANK_VERSION, PREPARATION_VERSION, dict(VARIANT_VERSIONS)])
    return {"name": f"bank-{hashlib.sha256(told.encode()).hexdigest()[:12]}", **asked}


def train(client: Client, output: Output, body: Document) -> None:
    """Have the bank trained, or go on with its training.

    Raises
    ------
    CommandError
        The training failed.
    """
    try:
        client.post("/v1/models", body)
    except ServiceError as error:
        if error.status != 409:
            raise
    jobs = [job for job in client.pages("/v1/jobs?kind=train") if job["model"] == body["name"]]
    job = max(jobs, key=lambda job: str(job["created_at"]))
    if job["state"] in {"failed", "cancelled"}:
        job = client.post(f"/v1/jobs/{job['id']}/retry")
    require_success(wait_for_job(client, output, job, title="learning from creatures"))
    if not output.as_json:
        show_bank(output, client.get(f"/v1/models/{body['name']}"))


def trained_definition(settings: Settings, name: str) -> dict[str, Any]:
    """Definition of the trained bank as it is stored."""
    database = Database(settings.resolved_database_url)
    try:
        with database.read() as session:
            return dict(get_model(session, name).row.definition)
    finally:
        database.dispose()


def witnesses(model: Model, species: Sequence[str]) -> list[Mapping[str, Any]]:
    """Descriptors by which a test sees that code and model still belong together."""
    found: list[Mapping[str, Any]] = []
    for name in species:
        mesh = make_creature(name, seed=0, vertices=WITNESS_VERTICES).rest
        vector = describe({view.name: solve(mesh, view) for view in model.views}, model)
        rounded = [round(float(value), WITNESS_DIGITS) for value in vector]
        found.append({"species": name, "vertices": WITNESS_VERTICES, "descriptor": rounded})
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Train the model, and write its file and its report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.default_model", description=__doc__)
    parser.add_argument("--data-dir", type=Path, default=Path("proteus-training"))
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--creatures", type=int, default=DEFAULT_CREATURES)
    parser.add_argument("-t", "--transformation", action="append", dest="transformations")
    parser.add_argument("--strength", action="append", type=int, dest="strengths")
    parser.add_argument("--view", action="append", dest="views")
    parser.add_argument("--working-vertices", type=int, default=None)
    asked = parser.parse_args(arguments)
    body = request_body(
        creatures=asked.creatures,
        transformations=asked.transformations or PAPER_TRANSFORMATIONS,
        strengths=asked.strengths or STRENGTHS,
        views=asked.views or DEFAULT_VIEWS,
    )
    output = Output()
    with guarded(output):
        settings = load_settings(
            data_dir=asked.data_dir,
            port=0,
            worker_processes=asked.workers,
            working_vertices=asked.working_vertices,
        )
        with service_for(settings) as (url, _), Client(url) as client:
            train(client, output, body)
        definition = trained_definition(settings, body["name"])
        report = {
            **definition["training"],
            "request": body,
            "witnesses": witnesses(Model.from_json(definition), TRAINING_SPECIES[:1]),
        }
        write_shipped(definition, report, asked.out)
        output.say(f"[bold]{asked.out}[/] has the model and its report")


if __name__ == "__main__":
    main()
