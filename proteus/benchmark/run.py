"""A benchmark on a running service: its collection, its models, its upload."""

import re

from proteus.benchmark.build import Built
from proteus.client import Client, ServiceError
from proteus.files import UploadFile
from proteus.terminal.output import CommandError, Output
from proteus.uploads import UploadResult, ensure_collection, upload_files

VIEWED_METHODS = ("heat", "commute-time", "biharmonic", "shape-dna")
"""Methods that need no training: their models can be made under another view at once."""


def collection_name(built: Built) -> str:
    """Return a name for the collection from the benchmark's folder."""
    name = re.sub(r"[^a-z0-9_-]+", "-", built.folder.absolute().name.lower()).strip("-_")
    return name[:63] or "benchmark"


def ensure_model(client: Client, name: str, view: str | None) -> str:
    """Return the name of a model under a view; a model that needs no training is made.

    Parameters
    ----------
    client : Client
    name : str
        An existing model.
    view : "open", "closed" or None
        None: the model's own views.

    Raises
    ------
    CommandError
        The model has another view, and would have to be trained for this one.
    """
    model = client.get(f"/v1/models/{name}")
    views = {channel["view"] for channel in model["channels"]}
    if view is None or views == {view} or (not views and model["state"] != "ready"):
        return name
    if model["method"] not in VIEWED_METHODS:
        raise CommandError(
            f"the model {name} has the view {', '.join(sorted(views))}; a {model['method']} "
            f"model with the view {view} has to be trained"
        )
    parameters = {**model["parameters"], "view": view}
    body = {"name": f"{name}-{view}", "method": model["method"], "parameters": parameters}
    try:
        client.post("/v1/models", body)
    except ServiceError as error:
        if error.status != 409:  # it was made before
            raise
    return str(body["name"])


def upload_benchmark(
    client: Client, output: Output, built: Built, collection: str, *, model: str
) -> UploadResult:
    """Upload all files of a benchmark to a collection, which is made if it is missing.

    Raises
    ------
    CommandError
        The collection holds other shapes too: they would be evaluated with the rest.
    """
    ensure_collection(client, collection, model=model)
    files = [UploadFile(path, "", path.stat().st_size) for path in built.files]
    result = upload_files(client, output, collection, files)
    held = client.get(f"/v1/collections/{collection}")["shape_count"]
    if held > len(files):
        raise CommandError(
            f"the collection {collection} holds {held} shapes, the benchmark {len(files)}; "
            "name another with --collection"
        )
    return result
