"""Waiting for jobs with a progress bar."""

from rich.markup import escape

from proteus.client import Client, Document
from proteus.jobs import JobWatch, failure_of, step_of
from proteus.terminal.output import CommandError, Output

PATIENCE_SECONDS = 120.0
"""How long a command that has begun waits for a service that is starting again."""


def wait_for_job(client: Client, output: Output, job: Document, *, title: str) -> Document:
    """Return the job once it has ended, with a progress bar meanwhile that names its step."""
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    watch = JobWatch(client, job)
    progress = job["progress"]
    with output.progress(unit=progress["unit"] or "") as bar:
        task = bar.add_task(escape(title), total=progress["total"] or None)
        for state in watch.changes():
            done, total = state["progress"]["done"], state["progress"]["total"]
            step = f": {step_of(state)}" if step_of(state) else ""
            shown = escape(f"{title}{step}")
            bar.update(task, completed=done, total=total or None, description=shown)
    return watch.job


def require_success(job: Document) -> None:
    """Raise if an ended job did not succeed.

    Raises
    ------
    CommandError
        With the reason of its first error.
    """
    if job["state"] != "succeeded":
        raise CommandError(failure_of(job))
