"""Uploads: files sent to a collection in batches, and followed until every shape is computed."""

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from proteus.client import Client, Document, ServiceError, json_object
from proteus.files import CountingFile, UploadFile, make_batches
from proteus.jobs import JobWatch
from proteus.terminal.output import Output
from proteus.terminal.waiting import PATIENCE_SECONDS

POLLED_JOBS = 8
"""Unfinished jobs that one round asks for, the oldest first."""


def ensure_collection(
    client: Client, name: str, *, description: str = "", model: str = ""
) -> Document:
    """Return a collection, made if it is missing.

    Parameters
    ----------
    client : Client
    name : str
    description, model : str
        Of a collection that is made; an existing one keeps its own.
    """
    try:
        return client.get(f"/v1/collections/{name}")
    except ServiceError as error:
        if error.status != 404:
            raise
    given = {"description": description, "model": model}
    body = {"name": name} | {key: value for key, value in given.items() if value}
    try:
        return client.post("/v1/collections", body)
    except ServiceError as error:
        if error.status != 409:  # another client made it in the meantime
            raise
    return client.get(f"/v1/collections/{name}")


@dataclass
class UploadResult:
    """The outcome of an upload.

    Attributes
    ----------
    jobs : list of dict
        The jobs, as they were last seen.
    errors : list of dict
        ``item``, ``type`` and ``detail`` of each file or shape that failed.
    skipped : list of dict
        ``item`` and ``detail`` of files that are no meshes, as far as the jobs name them.
    skipped_count : int
        How many those are.
    """

    jobs: list[Document] = field(default_factory=list)
    errors: list[Document] = field(default_factory=list)
    skipped: list[Document] = field(default_factory=list)
    skipped_count: int = 0

    def summary(self, collection: str, n_files: int) -> Document:
        """Return the document that ``--json`` prints."""
        done = sum(job["progress"]["done"] for job in self.jobs)
        failed = sum(len(job["errors"]) for job in self.jobs)
        return {
            "collection": collection,
            "files": n_files,
            "shapes": max(done - failed, 0),
            "errors": self.errors,
            "skipped": self.skipped,
            "skipped_count": self.skipped_count,
            "jobs": [job["id"] for job in self.jobs],
        }


def upload_files(
    client: Client,
    output: Output,
    collection: str,
    files: Sequence[UploadFile],
    *,
    wait: bool = True,
    labels_from_folders: bool = True,
) -> UploadResult:
    """Send files in batches, and wait for their jobs, with a progress bar for each of both."""
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    columns = (
        SpinnerColumn(finished_text="[green]✓[/]"), TextColumn("{task.description:<9}"),
        BarColumn(bar_width=32), TextColumn("{task.percentage:>4.0f} %"),
        TextColumn("{task.fields[text]}"), TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=output.messages, disable=output.as_json) as bars:
        fields = {} if labels_from_folders else {"labels_from_folders": "false"}
        work = _Upload(client, collection, bars, n_files=len(files), fields=fields)
        work.send(files)
        if wait:
            work.wait()
    return work.result()


class _Upload:
    """An upload that is going on: the files sent, the jobs they became, their progress."""

    def __init__(
        self, client: Client, collection: str, bars: Progress, *, n_files: int, fields: Document
    ) -> None:
        self._client = client
        self._path = f"/v1/collections/{collection}/shapes"
        self._bars = bars
        self._watches: list[JobWatch] = []
        self._errors: list[Document] = []
        self._unsent = n_files
        self._fields = fields
        self._sent_bar: TaskID = bars.add_task("sending", total=1, text="")
        self._done_bar: TaskID = bars.add_task("computing", total=n_files, text="")
        self._next_poll = 0.0

    def send(self, files: Sequence[UploadFile]) -> None:
        """Send all files, and poll the jobs in between."""
        total = sum(file.sent_size for file in files)
        text = f"{len(files)} files, {total / 1e6:.1f} MB"
        self._bars.update(self._sent_bar, total=max(total, 1), text=text)
        for batch in make_batches(files):
            self._send_batch(batch)
            self._poll()
        self._bars.update(self._sent_bar, completed=max(total, 1))

    def _send_batch(self, batch: Sequence[UploadFile]) -> None:
        """Send one request; if its content is refused, send halves to find the file that is."""
        try:
            answer = self._post(batch)
        except ServiceError as error:
            if error.status not in {400, 413, 415, 422}:
                raise
            if len(batch) == 1:
                problem = {"type": error.problem.get("type"), "detail": str(error)}
                self._errors.append({"item": batch[0].sent_name, **problem})
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
            once = {(one.sent_name, one.path): one for file in batch for one in (file, *file.needs)}
            parts = [
                ("files", (file.sent_name, stack.enter_context(CountingFile(file.path, advance))))
                for file in once.values()
            ]
            data = self._fields | ({"label": batch[0].label} if batch[0].label else {})
            answer = self._client.request("POST", self._path, data=data, files=parts)
            return json_object(answer)

    def wait(self) -> None:
        """Poll the jobs until all have ended."""
        while pause := self._poll():
            time.sleep(pause)
        self._show()

    def _poll(self) -> float:
        """Poll the oldest unfinished jobs; return the seconds to wait, 0 when all have ended."""
        now = time.monotonic()
        open_watches = [watch for watch in self._watches if not watch.ended]
        if now >= self._next_poll:
            for watch in open_watches[:POLLED_JOBS]:
                watch.poll()
            self._show()
            self._next_poll = now + 0.3
        pauses = [watch.pause_seconds for watch in open_watches[:POLLED_JOBS] if not watch.ended]
        return min(pauses, default=0.05 if any(not w.ended for w in self._watches) else 0.0)

    def _show(self) -> None:
        progress = [watch.job["progress"] for watch in self._watches]
        done = sum(part["done"] for part in progress) + len(self._errors)
        total = sum(part["total"] or 0 for part in progress) + len(self._errors) + self._unsent
        failed = len(self._errors) + sum(len(watch.job["errors"]) for watch in self._watches)
        text = f"{done} of {total} shapes" + (f", [red]{failed} failed[/]" if failed else "")
        self._bars.update(self._done_bar, completed=done, total=max(total, 1), text=text)

    def result(self) -> UploadResult:
        """Return the outcome."""
        jobs = [watch.job for watch in self._watches]
        unnamed = [
            {"item": job["id"], "type": None, "detail": f"the job {job['state']}"}
            for job in jobs
            if job["state"] in {"failed", "cancelled"} and not job["errors"]
        ]
        named = [error for job in jobs for error in job["errors"]]
        skipped = [one for job in jobs for one in job.get("skipped", ())]
        count = sum(job.get("skipped_count", 0) for job in jobs)
        return UploadResult(jobs, [*self._errors, *named, *unnamed], skipped, count)
