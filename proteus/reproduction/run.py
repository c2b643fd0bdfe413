"""The steps of a reproduction, in order. Each skips what is done already."""

from pathlib import Path

import numpy as np

from proteus.benchmark.build import Built, build_benchmark
from proteus.benchmark.plan import NULL
from proteus.benchmark.run import upload_benchmark
from proteus.client import Client, Document
from proteus.evaluations import evaluate
from proteus.files import UploadFile
from proteus.reproduction.models import ensure_model, heat_time
from proteus.reproduction.pictures import Signature
from proteus.reproduction.plan import (
    OPEN,
    ModelSpec,
    Plan,
    closed_models,
    first_models,
    heat_models,
)
from proteus.reproduction.results import Results, model_names
from proteus.reproduction.tables import COLUMNS
from proteus.terminal.output import CommandError, Output
from proteus.terminal.waiting import PATIENCE_SECONDS
from proteus.uploads import ensure_collection, upload_files
from proteus.version import program_version
from workers.geometry.formats import parse

SIGNED = ("isometry", "micro-holes", "topology", "sampling", "holes")
"""Transformations for Fig. 5, which shows the first two that the kernel can describe."""
STEPS = 7


class Reproduction:
    """A reproduction that is running.

    Parameters
    ----------
    client : Client
        Of the service that computes.
    output : Output
        Where progress is shown.
    plan : Plan
    processes : int
        For making the benchmark's files.
    """

    def __init__(self, client: Client, output: Output, plan: Plan, *, processes: int) -> None:
        client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
        self._client = client
        self._output = output
        self._plan = plan
        self._processes = processes
        self._step = 0

    def measure(self, facts: Document) -> tuple[Results, list[Signature], Built]:
        """Compute everything; return what Figs. 1 to 5 and the tables are made from."""
        built = self._build()
        models = self._learn()
        self._begin_step("compute the spectra of all shapes")
        collection = self._upload(built, models)
        found = self._evaluate(collection, models, "holes as they are")
        closed = self._learn_closed(heat_time(models["heat-time"]))
        other = self._evaluate(collection, closed, "holes closed")
        signatures = self._sign(built, models)
        versions = {"proteus": program_version(), **models["learned"].get("versions", {})}
        versions |= built.manifest["versions"]
        described = {**facts, "versions": versions, "collection": collection}
        results = Results(described, built.manifest, models, closed, found, other)
        return results, signatures, built

    def _begin_step(self, name: str) -> None:
        self._step += 1
        self._output.say(f"[bold]{self._step} of {STEPS}[/]  {name}")

    def _build(self) -> Built:
        self._begin_step("make the benchmark's files")
        with self._output.progress(unit="files") as bar:
            task = bar.add_task("making", total=None)
            return build_benchmark(
                self._plan.benchmark,
                self._plan.out / "benchmark",
                processes=self._processes,
                advance=lambda done, total: bar.update(task, completed=done, total=total),
            )

    def _learn(self) -> dict[str, Document]:
        """Return all models of open shapes, trained where needed, by key."""
        self._begin_step("learn the kernels")
        models = self._ensure(first_models(self._plan), suffix="")
        best = heat_time(models["heat-time"])
        return models | self._ensure(heat_models(best, OPEN), suffix="")

    def _learn_closed(self, best: float) -> dict[str, Document]:
        self._begin_step("learn the kernels again, holes closed")
        return self._ensure(closed_models(self._plan, best), suffix="-closed")

    def _ensure(self, specs: tuple[ModelSpec, ...], *, suffix: str) -> dict[str, Document]:
        found = {}
        for spec in specs:
            name = self._plan.model_name(spec.key + suffix)
            found[spec.key] = ensure_model(self._client, self._output, self._plan, spec, name)
        return found

    def _upload(self, built: Built, models: dict[str, Document]) -> str:
        """Upload the files to a collection whose model has the open view."""
        collection = f"{self._plan.name}-{built.digest}"
        first = str(models["commute"]["name"])
        result = upload_benchmark(self._client, self._output, built, collection, model=first)
        for error in result.errors:
            self._output.say(f"  [yellow]![/] {error['item']}: {error['detail']}")
        return collection

    def _evaluate(self, collection: str, models: dict[str, Document], title: str) -> Document:
        self._begin_step(f"evaluate, {title}")
        names = model_names(models, COLUMNS)
        ordered = sorted(names, key=lambda key: key != "commute")  # the others against it
        chosen = [names[key] for key in ordered]
        return evaluate(self._client, self._output, collection, chosen, title="ranking")

    # -- Fig. 5 ----------------------------------------------------------------------------

    def _sign(self, built: Built, models: dict[str, Document]) -> list[Signature]:
        """Fetch k(x,x) of the learned kernel on a null shape and two transformations of it."""
        self._begin_step("fetch k(x, x) of the learned kernel")
        model = str(models["learned"]["name"])
        files = _signed_files(built)
        collection = f"{self._plan.name}-{built.digest}-{self._plan.digest}"
        ensure_collection(self._client, collection, model=model)
        sent = [UploadFile(path, "", path.stat().st_size) for path in files]
        upload_files(self._client, self._output, collection, sent)
        shapes = {
            shape["name"]: shape
            for shape in self._client.pages(f"/v1/collections/{collection}/shapes", state="ready")
        }
        found = [_signature(self._client, shapes[p.name]) for p in files if p.name in shapes]
        if len(found) < 2:
            raise CommandError(
                "the learned kernel has no value at the eigenvalues of the shapes for Fig. 5: "
                "they lie outside the range that it was learned on"
            )
        return found[:3]


def _signed_files(built: Built) -> list[Path]:
    """Return a null shape and its chosen transformations at a middle strength."""
    labels = [s["label"] for s in built.manifest["shapes"] if s["role"] == "query"]
    strengths = built.manifest["parameters"]["strengths"]
    middle = strengths[len(strengths) // 2]
    label = next(name for name in labels if built.folder / f"{name}.null.0.ply" in built.files)
    names = [f"{label}.null.0.ply", *(f"{label}.{how}.{middle}.ply" for how in SIGNED)]
    return [built.folder / name for name in names if built.folder / name in built.files]


def _signature(client: Client, shape: Document) -> Signature:
    """Fetch k(x,x) of the collection's model at the vertices of the shape's mesh."""
    path = f"/v1/shapes/{shape['id']}"
    content = client.request("GET", f"{path}/mesh", params={"format": "glb"}).content
    values = np.frombuffer(client.request("GET", f"{path}/signature").content, dtype="<f4")
    how = shape["transformation"]
    name = "null shape" if how == NULL else f"{how}, strength {shape['strength']}"
    return Signature(name, parse(content, filename="shape.glb").mesh, values.astype(np.float64))
