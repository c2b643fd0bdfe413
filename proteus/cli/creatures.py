"""``proteus creatures``: procedural deformable shapes as files, and a sheet of pictures."""

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from proteus.cli.connection import local
from proteus.terminal.output import CommandError, Output

if TYPE_CHECKING:
    from workers.geometry.mesh import TriangleMesh


class FileFormat(StrEnum):
    """What a creature can be written as."""

    OFF = "off"
    PLY = "ply"
    OBJ = "obj"
    STL = "stl"
    GLB = "glb"


@local
def creatures(
    output: Output,
    out: Annotated[
        Path, typer.Argument(file_okay=False, metavar="OUT", help="Folder to write to.")
    ],
    species: Annotated[
        list[str] | None,
        typer.Option("--species", "-s", help="Species to write. Repeatable. Default: all."),
    ] = None,
    individuals: Annotated[int, typer.Option(min=1, help="Individuals of each species.")] = 1,
    poses: Annotated[int, typer.Option(min=1, help="Poses of each individual.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first individual.")] = 0,
    form: Annotated[
        FileFormat, typer.Option("--format", "-f", help="File format.")
    ] = FileFormat.PLY,
    sheet: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="Also draw all into one picture (PNG)."),
    ] = None,
) -> None:
    """Write procedural creatures as mesh files: OUT/species/species-individual-pose.ply.

    All poses of one individual share their vertex order. The same seeds give the same files.
    """
    from workers.creatures import SPECIES
    from workers.geometry.formats import write

    chosen = species or list(SPECIES)
    unknown = sorted(set(chosen) - set(SPECIES))
    if unknown:
        raise CommandError(f"no species {unknown[0]!r}; known are {', '.join(SPECIES)}")
    written: list[Path] = []
    shown: list[tuple[str, TriangleMesh]] = []
    with output.progress(unit="meshes") as bar:
        task = bar.add_task("making", total=len(chosen) * individuals * poses)
        for name in chosen:
            for label, mesh in make_poses(name, seed=seed, individuals=individuals, poses=poses):
                path = out / name / f"{label}.{form.value}"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(write(mesh, form.value))
                written.append(path)
                if sheet is not None:
                    shown.append((label, mesh))
                bar.advance(task)
    if sheet is not None:
        write_sheet(sheet, shown, columns=max(6, individuals * poses), output=output)
    document = {"files": [str(path) for path in written], "sheet": str(sheet) if sheet else None}
    place = f"wrote {len(written)} meshes to {escape(str(out))}"
    output.show(document, place + (f" and a sheet to {escape(str(sheet))}" if sheet else ""))


def make_poses(
    species: str, *, seed: int, individuals: int, poses: int
) -> Iterator[tuple[str, "TriangleMesh"]]:
    """Iterate over named meshes of a species: each individual at rest first, then posed."""
    from workers.creatures import make_creature

    for individual in range(seed, seed + individuals):
        creature = make_creature(species, seed=individual)
        for pose in range(poses):
            mesh = creature.rest if pose == 0 else creature.posed(pose)
            yield f"{species}-{individual + 1:02}-{pose + 1:02}", mesh


def write_sheet(
    path: Path, shown: "list[tuple[str, TriangleMesh]]", *, columns: int, output: Output
) -> None:
    """Draw named meshes into one picture."""
    from workers.rendering.render import contact_sheet, encode_png, render

    with output.progress(unit="pictures") as bar:
        task = bar.add_task("drawing", total=len(shown))
        images = []
        for _, mesh in shown:
            images.append(render(mesh, size=192))
            bar.advance(task)
    picture = contact_sheet(images, columns=columns, labels=[label for label, _ in shown])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode_png(picture))
