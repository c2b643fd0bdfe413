"""Models of the service for a reproduction: made, waited for, reused."""

from proteus.client import Client, Document, ServiceError
from proteus.jobs import failure_of
from proteus.reproduction.plan import ModelSpec, Plan
from proteus.terminal.output import CommandError, Output
from proteus.terminal.waiting import wait_for_job
from workers.diffusion.kernels import Kernel, kernel_from_json


def ensure_model(
    client: Client, output: Output, plan: Plan, spec: ModelSpec, name: str
) -> Document:
    """Return a model of the service that is ready; it is trained if it is missing.

    An existing model is reused: its name depends on everything that it was made with.

    Raises
    ------
    CommandError
        The training failed.
    """
    found = _find(client, name)
    if found is not None and found["state"] == "failed":
        client.request("DELETE", f"/v1/models/{name}")
        found = None
    job: Document | None = None
    if found is None:
        made = _create(client, plan, spec, name)
        found, job = made["model"], made.get("job")
    if found["state"] == "training":
        job = job or _training_job(client, name)
        ended = wait_for_job(client, output, job, title=f"training {spec.key}")
        found = client.get(f"/v1/models/{name}")
        if found["state"] != "ready":
            raise CommandError(f"training {name}: {failure_of(ended)}")
    return found


def _find(client: Client, name: str) -> Document | None:
    try:
        return client.get(f"/v1/models/{name}")
    except ServiceError as error:
        if error.status != 404:
            raise
    return None


def _create(client: Client, plan: Plan, spec: ModelSpec, name: str) -> Document:
    body: Document = {"name": name, "method": spec.method, "parameters": spec.parameters}
    if spec.transformations:
        body["training"] = {**plan.training, "transformations": list(spec.transformations)}
    return client.post("/v1/models", body)


def _training_job(client: Client, name: str) -> Document:
    """Return the training job of a model that another run started."""
    for job in client.pages("/v1/jobs", kind="train"):
        if job["model"] == name:
            return job
    raise CommandError(f"the model {name} is in training, but has no job; delete it")


def heat_time(model: Document) -> float:
    """Return the time of a heat kernel, in the unit of its channel."""
    return float(model["kernels"][0]["parameters"]["time"])


def kernel_of(model: Document) -> Kernel:
    """Return a model's first kernel, for eigenvalues in the unit of its channel."""
    found = model["kernels"][0]
    return kernel_from_json({"kind": found["kind"], "parameters": found["parameters"]})


def trained_range(model: Document) -> tuple[float, float]:
    """Return the smallest and largest eigenvalue that a model was learned from."""
    low, high = model["training"]["trained_range"]
    return float(low), float(high)
