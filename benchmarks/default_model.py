"""Trains the model that comes with Proteus, from creatures alone: ``make train-default``.

It starts a service, requests a bank over HTTP as any client can, and writes the trained model into
the package. After an interruption the same command continues. Nothing in it is random.
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
from workers.geometry.solution import solve
from workers.geometry.views import PREPARATION_VERSION
from workers.retrieval.model import Model, describe
from workers.settings import Settings, load_settings
from workers.storage.database import Database
from workers.storage.shipped_models import FOLDER, write_shipped
from workers.storage.trained_models import get_model
from workers.training.bank import BANK_VERSION, MOST_CHANNELS, POWER
from workers.training.chosen_variants import DEFAULT_CREATURES
from workers.training.examples import VARIANT_VERSIONS
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
    """Return the body of the request for the bank.

    The name is a digest of the request and of the versions of the code, so that another request
    never finds this bank.
    """
    body: Document = {
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
    identity = json.dumps([body, BANK_VERSION, PREPARATION_VERSION, dict(VARIANT_VERSIONS)])
    return {"name": f"bank-{hashlib.sha256(identity.encode()).hexdigest()[:12]}", **body}


def train(client: Client, output: Output, body: Document) -> None:
    """Train the bank, or continue its training.

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
    """Return the definition of the trained bank.

    It comes from the database: ``GET /v1/models/{name}`` leaves out the quantiles of impostors and
    the typical distances, which a model file needs.
    """
    database = Database(settings.resolved_database_url)
    try:
        with database.read() as session:
            return dict(get_model(session, name).row.definition)
    finally:
        database.dispose()


def witnesses(model: Model, species: Sequence[str]) -> list[Mapping[str, Any]]:
    """Return descriptors that a test compares with those of the code as it is."""
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
    options = parser.parse_args(arguments)
    body = request_body(
        creatures=options.creatures,
        transformations=options.transformations or PAPER_TRANSFORMATIONS,
        strengths=options.strengths or STRENGTHS,
        views=options.views or DEFAULT_VIEWS,
    )
    output = Output()
    with guarded(output):
        settings = load_settings(
            data_dir=options.data_dir,
            port=0,
            worker_processes=options.workers,
            working_vertices=options.working_vertices,
        )
        with service_for(settings) as (url, _), Client(url) as client:
            train(client, output, body)
        definition = trained_definition(settings, body["name"])
        report = {
            **definition["training"],
            "request": body,
            "witnesses": witnesses(Model.from_json(definition), TRAINING_SPECIES[:1]),
        }
        write_shipped(definition, report, options.out)
        output.say(f"[bold]{options.out}[/] has the model and its report")


if __name__ == "__main__":
    main()
