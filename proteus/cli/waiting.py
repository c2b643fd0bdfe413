"""Waiting for jobs with a progress bar."""

from rich.markup import escape
from rich.table import Table

from proteus.cli.console import CommandError, Output, cell, make_table
from proteus.client import Client, Document, JobWatch

PATIENCE_SECONDS = 120.0
"""How long a command that has begun puts up with a service that is starting again."""


def wait_for_job(client: Client, output: Output, job: Document, *, title: str) -> Document:
    """Return the job once it has ended, showing its progress meanwhile."""
    client.patience_seconds = max(client.patience_seconds, PATIENCE_SECONDS)
    watch = JobWatch(client, job)
    progress = job["progress"]
    with output.progress(unit=progress["unit"] or "") as bar:
        task = bar.add_task(escape(title), total=progress["total"] or None)
        for state in watch.changes():
            done, total = state["progress"]["done"], state["progress"]["total"]
            bar.update(task, completed=done, total=total or None)
    return watch.job


def demand_success(job: Document) -> None:
    """Raise if an ended job did not succeed.

    Raises
    ------
    CommandError
        With the reason of its first error.
    """
    if job["state"] != "succeeded":
        reasons = [f"{e['item']}: {e['detail']}" for e in job["errors"]] or ["no reason given"]
        more = f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else ""
        raise CommandError(f"the job {job['id']} {job['state']}: {reasons[0]}{more}")


def errors_table(errors: list[Document], *, title: str) -> Table:
    """Return what went wrong with which item, as a table."""
    table = make_table("item", "reason", title=title)
    for error in errors:
        table.add_row(cell(error.get("item")), cell(error.get("detail") or error.get("type")))
    return table
