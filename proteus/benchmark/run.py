"""Measuring a benchmark on a running service: collection, upload, evaluation."""

import re
from collections.abc import Sequence

from proteus.benchmark.build import Built
from proteus.cli.console import CommandError, Output
from proteus.cli.files import UploadFile
from proteus.cli.upload import UploadResult, upload_files
from proteus.cli.waiting import wait_for_job
from proteus.client import Client, Document, ServiceError

VIEWED_METHODS = ("heat", "commute-time", "biharmonic", "shape-dna")
"""Built-in models that there can be under another view without any training."""


def collection_name(built: Built) -> str:
    """Return a name for the collection from the benchmark's folder."""
    name = re.sub(r"[^a-z0-9_-]+", "-", built.folder.absolute().name.lower()).strip("-_")
    return name[:63] or "benchmark"


def ensure_model(client: Client, name: str, view: str | None) -> str:
    """Return the name of the model under a view, made if it is a built-in one under another.

    Parameters
    ----------
    client : Client
    name : str
        A model there is.
    view : "open", "closed" or None
        None: as it is.
    """
    model = client.get(f"/v1/models/{name}")
    views = {channel["view"] for channel in model["channels"]}
    if view is None or views == {view} or (not views and model["state"] != "ready"):
        return name
    if model["method"] not in VIEWED_METHODS:
        raise CommandError(
            f"the model {name} is of view {', '.join(sorted(views))}; of the method "
            f"{model['method']} one of view {view} has to be trained"
        )
    parameters = {**model["parameters"], "view": view}
    return ensure_ready(client, f"{name}-{view}", model["method"], parameters)


def ensure_ready(client: Client, name: str, method: str, parameters: Document) -> str:
    """Make a model that needs no training, unless there is one of this name; return the name."""
    body = {"name": name, "method": method, "parameters": parameters}
    try:
        client.request("POST", "/v1/models", json=body)
    except ServiceError as error:
        if error.status != 409:
            raise
    return name


def make_collection(client: Client, name: str, *, model: str) -> None:
    """Make a collection under a model, unless there is one of this name."""
    try:
        client.request("POST", "/v1/collections", json={"name": name, "model": model})
    except ServiceError as error:
        if error.status != 409:
            raise


def upload_benchmark(
    client: Client, output: Output, built: Built, collection: str, *, model: str
) -> UploadResult:
    """Bring all files of a benchmark into a collection, which is made if it is missing.

    Raises
    ------
    CommandError
        The collection holds other shapes too: they would be evaluated with the rest.
    """
    make_collection(client, collection, model=model)
    files = [UploadFile(path, "", path.stat().st_size) for path in built.files]
    result = upload_files(client, output, collection, files)
    held = client.get(f"/v1/collections/{collection}")["shape_count"]
    if held > len(files):
        raise CommandError(
            f"the collection {collection} holds {held} shapes, the benchmark {len(files)}; "
            "name another with --collection"
        )
    return result


def evaluate(
    client: Client,
    output: Output,
    collection: str,
    models: Sequence[str],
    *,
    dissimilarity: str | None = None,
    title: str = "evaluating",
) -> Document:
    """Have a collection evaluated under models, and return the evaluation once it is there.

    Raises
    ------
    CommandError
        The job failed.
    """
    body: Document = {"collection": collection, "models": list(models)}
    if dissimilarity:
        body["dissimilarity"] = dissimilarity
    begun: Document = client.request("POST", "/v1/evaluations", json=body).json()
    job = wait_for_job(client, output, begun["job"], title=title)
    found = client.get(f"/v1/evaluations/{begun['evaluation']['id']}")
    if found["state"] != "succeeded":
        reasons = [f"{e['item']}: {e['detail']}" for e in job["errors"]] or ["no reason given"]
        raise CommandError(f"the evaluation {found['state']}: {reasons[0]}")
    return found
