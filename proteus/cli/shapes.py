"""``proteus shapes``: list, show, delete, and fetch their meshes and pictures."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from proteus.cli.connection import Session, connected
from proteus.client import Document
from proteus.terminal.tables import cell, facts_table, make_table, state_cell

app = typer.Typer(
    help="Shapes: list, show, delete, save their meshes and pictures.", no_args_is_help=True
)

IdArgument = Annotated[str, typer.Argument(metavar="ID", help="The shape's id.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", dir_okay=False, help="File to write. Default: the shape's name."),
]
COUNTS = ("vertices", "faces")


class MeshFormat(StrEnum):
    """What a mesh can be fetched as."""

    ORIGINAL = "original"
    OFF = "off"
    PLY = "ply"
    OBJ = "obj"
    STL = "stl"
    GLB = "glb"


class ShapeState(StrEnum):
    """States of a shape."""

    QUEUED = "queued"
    PROCESSING = "processing"
    READY = "ready"
    FAILED = "failed"


@app.command("list")
@connected
def list_shapes(
    session: Session,
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Where to look.")
    ] = "default",
    label: Annotated[str, typer.Option(help="Only with this label.")] = "",
    transformation: Annotated[str, typer.Option(help="Only with this transformation.")] = "",
    name: Annotated[str, typer.Option(help="Only with this name.")] = "",
    path: Annotated[
        str, typer.Option(help="Only what lay in this folder, or below it: models/animals.")
    ] = "",
    state: Annotated[ShapeState | None, typer.Option(help="Only in this state.")] = None,
    limit: Annotated[int, typer.Option("--limit", "-n", min=1, help="Most shapes to list.")] = 100,
) -> None:
    """List the shapes of a collection."""
    chosen = {"label": label, "transformation": transformation, "name": name, "path": path}
    found = list(
        session.client.pages(
            f"/v1/collections/{collection}/shapes",
            limit=limit,
            state=state.value if state else None,
            **chosen,
        )
    )
    session.output.show(found, _table(found))


def _table(found: list[Document]) -> Table | str:
    if not found:
        return "No such shapes."
    in_folders = ["path"] if any(shape["path"] != shape["name"] for shape in found) else []
    columns = ["id", "name", *in_folders, "label", "state", *COUNTS, "error"]
    table = make_table(*columns, numbers=COUNTS)
    for shape in found:
        error = (shape["error"] or {}).get("detail")
        table.add_row(
            cell(shape["id"]), cell(shape["name"]), *(cell(shape[name]) for name in in_folders),
            cell(shape["label"]),
            state_cell(shape["state"]),
            cell(shape["n_vertices"]), cell(shape["n_faces"]), cell(error),
        )  # fmt: skip
    return table


@app.command("show")
@connected
def show_shape(session: Session, identifier: IdArgument) -> None:
    """Show one shape in full."""
    found = session.client.get(f"/v1/shapes/{identifier}")
    session.output.show(found, facts_table(found))


@app.command("delete")
@connected
def delete_shapes(
    session: Session,
    identifiers: Annotated[list[str], typer.Argument(metavar="ID", help="Ids of shapes.")],
) -> None:
    """Delete shapes."""
    for identifier in identifiers:
        session.client.request("DELETE", f"/v1/shapes/{identifier}")
    session.output.show({"deleted": identifiers}, f"deleted {len(identifiers)}")


@app.command("mesh")
@connected
def fetch_mesh(
    session: Session,
    identifier: IdArgument,
    out: OutOption = None,
    form: Annotated[
        MeshFormat, typer.Option("--format", "-f", help="Format to convert it to.")
    ] = MeshFormat.ORIGINAL,
) -> None:
    """Save a shape's mesh to a file."""
    path = f"/v1/shapes/{identifier}/mesh"
    answer = session.client.request("GET", path, params={"format": form.value})
    if out is None:
        shape = session.client.get(f"/v1/shapes/{identifier}")
        ending = shape["format"] if form is MeshFormat.ORIGINAL else form.value
        out = Path(f"{Path(str(shape['name'])).stem or identifier}.{ending}")
    _write(session, out, answer.content)


@app.command("thumbnail")
@connected
def fetch_thumbnail(session: Session, identifier: IdArgument, out: OutOption = None) -> None:
    """Save a shape's picture (PNG, 256 by 256)."""
    answer = session.client.request("GET", f"/v1/shapes/{identifier}/thumbnail.png")
    _write(session, out or Path(f"{identifier}.png"), answer.content)


def _write(session: Session, path: Path, content: bytes) -> None:
    path.write_bytes(content)
    document = {"path": str(path), "bytes": len(content)}
    session.output.show(document, f"wrote {escape(str(path))} ({len(content):,} bytes)")
