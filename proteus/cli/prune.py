"""``proteus prune``: free what is no longer needed, or show what can be freed."""

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from proteus.cli.checks import Check
from proteus.cli.connection import Session, connected
from proteus.client import Client, Document, ServiceError, UnreachableError
from proteus.terminal.tables import cell, make_table
from proteus.terminal.waiting import require_success, wait_for_job

NUMBERS = ("kept for days", "count", "size")


@connected
def prune(
    session: Session,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only show what can be freed; change nothing.")
    ] = False,
) -> None:
    """Free what is no longer needed: files of deleted shapes, old jobs and queries, caches.

    The settings PROTEUS_KEEP_..._DAYS say how long each kind is kept. Searches and uploads go on
    meanwhile. Needs a key with the scope admin, if the service has keys.
    """
    if dry_run:
        found = session.client.get("/v1/prune")
        session.output.show(found, freeable_table(found))
        return
    job = session.client.request("POST", "/v1/prune").json()["job"]
    job = wait_for_job(session.client, session.output, job, title="prune")
    session.output.show(job, _freed_table(job["result"] or {"kinds": [], "count": 0, "bytes": 0}))
    require_success(job)


def freeable_table(found: Document) -> Table:
    """Return what can be freed, with how long each kind is kept."""
    table = make_table("kind", "what", *NUMBERS, title="can be freed", numbers=NUMBERS)
    for kind in found["kinds"]:
        days = cell(kind["kept_days"])
        size = size_text(kind["bytes"])
        table.add_row(cell(kind["kind"]), cell(kind["what"]), days, str(kind["count"]), size)
    table.add_row("[bold]all[/]", "", "", str(found["count"]), size_text(found["bytes"]))
    return table


def check_freeable(client: Client) -> Iterator[Check]:
    """Check what can be freed; without a service, or a key that may know it, check nothing."""
    try:
        found = client.get("/v1/prune")
    except UnreachableError:
        return
    except ServiceError as error:
        if error.status in {401, 403}:
            yield Check("can be freed", "ok", "not known: this needs a key with the scope admin")
        return
    kinds = [
        f"{kind['kind']} {kind['count']} ({size_text(kind['bytes'])})"
        for kind in found["kinds"]
        if kind["count"]
    ]
    if not kinds:
        yield Check("can be freed", "ok", "nothing")
        return
    text = f"{found['count']} rows and files, {size_text(found['bytes'])}: {', '.join(kinds)}"
    yield Check(
        "can be freed", "ok", text, "the service frees it by itself; at once: proteus prune"
    )


def size_text(n_bytes: int) -> str:
    """Return a number of bytes as people read it."""
    size = float(n_bytes)
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} TB"


def _freed_table(result: Document) -> Table:
    table = make_table("kind", "count", "size", title="freed", numbers=NUMBERS)
    for kind in result["kinds"]:
        table.add_row(cell(kind["kind"]), str(kind["count"]), size_text(kind["bytes"]))
    table.add_row("[bold]all[/]", str(result["count"]), size_text(result["bytes"]))
    return table
