"""``proteus upload``: files and folders into a collection, until every shape is computed."""

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from proteus.cli.connection import Session, connected
from proteus.cli.console import EXIT_FAILED, CommandError, Output
from proteus.cli.files import CountingFile, UploadFile, find_files, make_batches
from proteus.cli.waiting import PATIENCE_SECONDS, errors_table
from proteus.client import Client, Document, JobWatch, ServiceError

POLLED_JOBS = 8
"""Unfinished jobs that are asked after in one round, the oldest first."""


@connected
def upload(
    session: Session,
    paths: Annotated[
        list[Path],
        typer.Argument(exists=True, metavar="PATHS...", help="Meshes, zip archives and folders."),
    ],
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Is made if it is missing.")
    ] = "default",
    label: Annotated[str, typer.Option(help="The label of all shapes.")] = "",
    labels_from_folders: Annotated[
        bool, typer.Option(help="Take the folder's name as label: poses/cat/3.ply is a cat.")
    ] = True,
    wait: Annotated[bool, typer.Option(help="Wait until every shape is computed.")] = True,
) -> None:
    """Upload meshes, and wait until they can be found.

    Formats: OFF, OBJ, PLY, STL, GLB, glTF, 3MF, and zip archives of them. What the collection
    has already is not computed again. Exit code 1 if any shape failed.
    """
    files = find_files(paths, label=label, labels_from_folders=labels_from_folders)
    if not files:
        where = ", ".join(str(path) for path in paths)
        raise CommandError(f"no mesh (off, obj, ply, stl, glb, gltf, 3mf) or zip below {where}")
    model = ensure_collection(session.client, collection)["model"]
    result = upload_files(session.client, session.output, collection, files, wait=wait)
    summary = result.summary(collection, len(files))
    told = f"{summary['shapes']} ready, {len(result.errors)} failed"
    if not wait:
        told = f"{len(files)} files sent; proteus jobs list says how far they are"
    if result.errors and not session.output.as_json:
        session.output.console.print(errors_table(result.errors, title="[red]failed[/]"))
    session.output.show(summary, f"[bold]{escape(collection)}[/] (model {escape(model)}): {told}")
    if result.errors:
        raise typer.Exit(EXIT_FAILED)


def ensure_collection(client: Client, name: str, *, description: str = "") -> Document:
    """Return a collection, making it if it is missing."""
    try:
        return client.get(f"/v1/collections/{name}")
    except ServiceError as error:
        if error.status != 404:
            raise
    body = {"name": name, **({"description": description} if description else {})}
    try:
        client.request("POST", "/v1/collections", json=body)
    except ServiceError as error:
        if error.status != 409:  # somebody made it in the meantime
            raise
    return client.get(f"/v1/collections/{name}")


@dataclass
class UploadResult:
    """What became of an upload.

    Attributes
    ----------
    jobs : list of dict
        The jobs, as they were last seen.
    errors : list of dict
        ``item``, ``type`` and ``detail`` of each file or shape that failed.
    """

    jobs: list[Document] = field(default_factory=list)
    errors: list[Document] = field(default_factory=list)

    def summary(self, collection: str, n_files: int) -> Document:
        """Return it as the document that ``--json`` prints."""
        done = sum(job["progress"]["done"] for job in self.jobs)
        failed = sum(len(job["errors"]) for job in self.jobs)
        return {
            "collection": collection,
            "files": n_files,
            "shapes": max(done - failed, 0),
            "errors": self.errors,
            "jobs": [job["id"] for job in self.jobs],
        }


def upload_files(
    client: Client,
    output: Output,
    collection: str,
    files: Sequence[UploadFile],
    *,
    wait: bool = True,
) -> UploadResult:
    """Send files in batches, and wait until their jobs have ended, with two progress bars."""
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    columns = (
        SpinnerColumn(finished_text="[green]✓[/]"), TextColumn("{task.description:<9}"),
        BarColumn(bar_width=32), TextColumn("{task.percentage:>4.0f} %"),
        TextColumn("{task.fields[text]}"), TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=output.messages, disable=output.as_json) as bars:
        work = _Upload(client, collection, bars, n_files=len(files))
        work.send(files)
        if wait:
            work.wait()
    return work.result()


class _Upload:
    """An upload under way: what was sent, which jobs came of it, how far they are."""

    def __init__(self, client: Client, collection: str, bars: Progress, *, n_files: int) -> None:
        self._client = client
        self._path = f"/v1/collections/{collection}/shapes"
        self._bars = bars
        self._watches: list[JobWatch] = []
        self._errors: list[Document] = []
        self._unsent = n_files
        self._sent_bar: TaskID = bars.add_task("sending", total=1, text="")
        self._done_bar: TaskID = bars.add_task("computing", total=n_files, text="")
        self._next_poll = 0.0

    def send(self, files: Sequence[UploadFile]) -> None:
        """Send all, asking after the jobs in between."""
        total = sum(file.size for file in files)
        text = f"{len(files)} files, {total / 1e6:.1f} MB"
        self._bars.update(self._sent_bar, total=max(total, 1), text=text)
        for batch in make_batches(files):
            self._send_batch(batch)
            self._poll()
        self._bars.update(self._sent_bar, completed=max(total, 1))

    def _send_batch(self, batch: Sequence[UploadFile]) -> None:
        """Send one request; where it is refused for its content, find out for which file."""
        try:
            answer = self._post(batch)
        except ServiceError as error:
            if error.status not in {400, 413, 415, 422}:
                raise
            if len(batch) == 1:
                problem = {"type": error.problem.get("type"), "detail": str(error)}
                self._errors.append({"item": batch[0].path.name, **problem})
                self._unsent -= 1
                return
            for half in (batch[: len(batch) // 2], batch[len(batch) // 2 :]):
                self._send_batch(half)
            return
        self._unsent -= len(batch)
        if answer.get("job"):
            self._watches.append(JobWatch(self._client, answer["job"]))

    def _post(self, batch: Sequence[UploadFile]) -> Document:
        def advance(count: int) -> None:
            self._bars.advance(self._sent_bar, count)

        with contextlib.ExitStack() as stack:
            parts = [
                ("files", (file.path.name, stack.enter_context(CountingFile(file.path, advance))))
                for file in batch
            ]
            data = {"label": batch[0].label} if batch[0].label else {}
            answer: Document = self._client.request(
                "POST", self._path, data=data, files=parts
            ).json()
            return answer

    def wait(self) -> None:
        """Ask after the jobs until all have ended."""
        while pause := self._poll():
            time.sleep(pause)
        self._show()

    def _poll(self) -> float:
        """Ask after the oldest unfinished jobs; return how long to wait, 0 when all are done."""
        now = time.monotonic()
        open_watches = [watch for watch in self._watches if not watch.ended]
        if now >= self._next_poll:
            for watch in open_watches[:POLLED_JOBS]:
                watch.poll()
            self._show()
            self._next_poll = now + 0.3
        asked = [watch.pause_seconds for watch in open_watches[:POLLED_JOBS] if not watch.ended]
        return min(asked, default=0.05 if any(not w.ended for w in self._watches) else 0.0)

    def _show(self) -> None:
        progress = [watch.job["progress"] for watch in self._watches]
        done = sum(part["done"] for part in progress) + len(self._errors)
        total = sum(part["total"] or 0 for part in progress) + len(self._errors) + self._unsent
        failed = len(self._errors) + sum(len(watch.job["errors"]) for watch in self._watches)
        text = f"{done} of {total} shapes" + (f", [red]{failed} failed[/]" if failed else "")
        self._bars.update(self._done_bar, completed=done, total=max(total, 1), text=text)

    def result(self) -> UploadResult:
        """Return what became of it."""
        jobs = [watch.job for watch in self._watches]
        cut_short = [
            {"item": job["id"], "type": None, "detail": f"the job {job['state']}"}
            for job in jobs
            if job["state"] in {"failed", "cancelled"} and not job["errors"]
        ]
        named = [error for job in jobs for error in job["errors"]]
        return UploadResult(jobs, [*self._errors, *named, *cut_short])
