"""``proteus upload``: files and folders into a collection, until every shape is computed."""

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from proteus.cli.connection import Session, connected
from proteus.cli.errors import EXIT_FAILED
from proteus.files import find_files
from proteus.terminal.output import CommandError
from proteus.terminal.tables import errors_table
from proteus.uploads import ensure_collection, upload_files


@connected
def upload(
    session: Session,
    paths: Annotated[
        list[Path],
        typer.Argument(exists=True, metavar="PATH", help="Meshes, zip archives and folders."),
    ],
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Made if it is missing.")
    ] = "default",
    label: Annotated[str, typer.Option(help="Label of all shapes.")] = "",
    labels_from_folders: Annotated[
        bool, typer.Option(help="Use the folder as label: poses/cat/3.ply is a cat.")
    ] = True,
    wait: Annotated[bool, typer.Option(help="Wait until every shape is computed.")] = True,
) -> None:
    """Upload meshes, and wait until they can be found.

    Formats: OFF, OBJ, PLY, STL, GLB, glTF, 3MF, and zip archives of them. A file that the
    collection has already is not computed again. The exit code is 1 if any shape failed.
    """
    files = find_files(paths, label=label, labels_from_folders=labels_from_folders)
    if not files:
        where = ", ".join(str(path) for path in paths)
        raise CommandError(f"no mesh (off, obj, ply, stl, glb, gltf, 3mf) or zip below {where}")
    model = ensure_collection(session.client, collection)["model"]
    result = upload_files(session.client, session.output, collection, files, wait=wait)
    summary = result.summary(collection, len(files))
    outcome = f"{summary['shapes']} ready, {len(result.errors)} failed"
    if not wait:
        outcome = f"{len(files)} files sent; proteus jobs list shows their progress"
    if result.errors:
        session.output.table(errors_table(result.errors, title="[red]failed[/]"))
    text = f"[bold]{escape(collection)}[/] (model {escape(model)}): {outcome}"
    session.output.show(summary, text)
    if result.errors:
        raise typer.Exit(EXIT_FAILED)
