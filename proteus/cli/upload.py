"""``proteus upload``: files and folders into a collection, until every shape is computed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from proteus.cli.connection import Session, connected
from proteus.cli.errors import EXIT_FAILED
from proteus.files import find_files
from proteus.terminal.output import CommandError
from proteus.terminal.tables import errors_table
from proteus.uploads import UploadResult, ensure_collection, upload_files


@connected
def upload(
    session: Session,
    paths: Annotated[
        list[Path],
        typer.Argument(exists=True, metavar="PATH", help="Meshes, archives and folders."),
    ],
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Made if it is missing.")
    ] = "default",
    label: Annotated[str, typer.Option(help="Label of all shapes.")] = "",
    labels_from_folders: Annotated[
        bool, typer.Option(help="Use the folder as label: poses/cat/3.ply is a cat.")
    ] = True,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Name the files that are skipped.")
    ] = False,
    wait: Annotated[bool, typer.Option(help="Wait until every shape is computed.")] = True,
) -> None:
    """Upload meshes, and wait until they can be found.

    Formats: OFF, OBJ, PLY, STL, GLB, glTF, 3MF and more, compressed (gz, bz2, xz) or not, and
    archives of them (zip, tar, tar.gz). A glTF file and the files that it refers to are one shape.
    Pictures, texts and other files beside meshes are skipped. A file that the collection has
    already is not computed again. The exit code is 1 if any shape failed.
    """
    found = find_files(paths, label=label)
    files = found.files
    if not files:
        where = ", ".join(str(path) for path in paths)
        held = f", only {_counted(found.skipped)}" if found.skipped else ""
        raise CommandError(f"no mesh or archive of meshes below {where}{held}")
    model = ensure_collection(session.client, collection)["model"]
    result = upload_files(
        session.client, session.output, collection, files,
        wait=wait, labels_from_folders=labels_from_folders,
    )  # fmt: skip
    here = [{"item": name, "detail": detail} for name, detail in found.skipped]
    result.skipped = [*here, *result.skipped]
    result.skipped_count += len(here)
    summary = result.summary(collection, len(files))
    outcome = f"{summary['shapes']} ready, {len(result.errors)} failed"
    if not wait:
        outcome = f"{len(files)} files sent; proteus jobs list shows their progress"
    if result.errors:
        session.output.table(errors_table(result.errors, title="[red]failed[/]"))
    if result.skipped and verbose:
        session.output.table(errors_table(result.skipped, title="skipped"))
    if result.skipped_count:
        session.output.say(escape(skipped_line(result)))
    text = f"[bold]{escape(collection)}[/] (model {escape(model)}): {outcome}"
    session.output.show(summary, text)
    if result.errors:
        raise typer.Exit(EXIT_FAILED)


def skipped_line(result: UploadResult) -> str:
    """Return in one line how many files were skipped, and what they are."""
    files = "file" if result.skipped_count == 1 else "files"
    kinds = _counted([(one["item"], one["detail"]) for one in result.skipped])
    more = result.skipped_count - len(result.skipped)
    unnamed = f", {more:,} more" if more > 0 else ""
    return f"{result.skipped_count:,} {files} skipped ({kinds}{unnamed})"


def _counted(skipped: Sequence[tuple[str, str]]) -> str:
    from workers.geometry.formats.containers import summarise  # it brings numpy

    return summarise(detail for _, detail in skipped)
