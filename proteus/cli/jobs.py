"""``proteus jobs``: list, show, cancel, retry, watch."""

from typing import Annotated

import typer
from rich.table import Table

from proteus.cli.connection import Session, connected
from proteus.client import Document
from proteus.terminal.tables import (
    cell,
    errors_table,
    facts_table,
    make_table,
    state_cell,
    time_cell,
)
from proteus.terminal.waiting import require_success, wait_for_job

app = typer.Typer(help="Jobs: list, show, cancel, retry, watch.", no_args_is_help=True)

IdArgument = Annotated[str, typer.Argument(metavar="ID", help="The job's id.")]


@app.command("list")
@connected
def list_jobs(
    session: Session,
    kind: Annotated[
        str,
        typer.Option(
            help="Only this kind: ingest, query, train, describe, evaluate, prune, correspondence."
        ),
    ] = "",
    state: Annotated[
        str, typer.Option(help="Only this state: queued, running, succeeded, failed, cancelled.")
    ] = "",
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Only of this collection.")
    ] = "",
    limit: Annotated[int, typer.Option("--limit", "-n", min=1, help="Most jobs to list.")] = 50,
) -> None:
    """List jobs."""
    chosen = {"kind": kind, "state": state, "collection": collection}
    found = list(session.client.pages("/v1/jobs", limit=limit, **chosen))
    session.output.show(found, _table(found))


def _table(found: list[Document]) -> Table | str:
    if not found:
        return "No such jobs."
    numbers = ("done", "errors")
    table = make_table(
        "id", "kind", "state", "done", "errors", "collection", "created", numbers=numbers
    )
    for job in found:
        progress = job["progress"]
        table.add_row(
            cell(job["id"]), cell(job["kind"]), state_cell(job["state"]),
            f"{progress['done']}/{progress['total']}", str(len(job["errors"])),
            cell(job["collection"]), time_cell(job["created_at"]),
        )  # fmt: skip
    return table


def _show(session: Session, job: Document) -> None:
    session.output.show(job, facts_table(job, leave_out=["errors", "skipped"]))
    if job["errors"]:
        session.output.table(errors_table(job["errors"], title="errors"))
    if job.get("skipped"):
        session.output.table(errors_table(job["skipped"], title="skipped"))


@app.command("show")
@connected
def show_job(session: Session, identifier: IdArgument) -> None:
    """Show one job, its errors, and the files that it skipped."""
    _show(session, session.client.get(f"/v1/jobs/{identifier}"))


@app.command("cancel")
@connected
def cancel_job(session: Session, identifier: IdArgument) -> None:
    """Cancel a job. What it has done already stays."""
    _show(session, session.client.post(f"/v1/jobs/{identifier}/cancel"))


@app.command("retry")
@connected
def retry_job(session: Session, identifier: IdArgument) -> None:
    """Try the failed parts of a job again."""
    _show(session, session.client.post(f"/v1/jobs/{identifier}/retry"))


@app.command("watch")
@connected
def watch_job(session: Session, identifier: IdArgument) -> None:
    """Watch a job until it ends. The exit code is 1 if it did not succeed."""
    job = session.client.get(f"/v1/jobs/{identifier}")
    title = f"{job['kind']} {job['collection'] or ''}".strip()
    job = wait_for_job(session.client, session.output, job, title=title)
    _show(session, job)
    if job["state"] != "succeeded" and session.output.as_json:
        raise typer.Exit(1)
    require_success(job)
