"""``proteus query``: the stored shapes most like a mesh, a stored shape, or a region of one."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from proteus.cli.asking import Asked, query_by_mesh, query_by_region
from proteus.cli.connection import Session, connected
from proteus.cli.correspondence import fetch_correspondence, fetch_mesh
from proteus.cli.regions import choose_region
from proteus.client import Document
from proteus.files import content_with_needs
from proteus.terminal.output import CommandError
from proteus.terminal.tables import cell, make_table

PICTURED = 3
"""So many of the first matches are drawn."""

TEXT_FIELDS = frozenset({"label", "name", "path", "transformation"})
BOUNDS = {">=": "gte", "<=": "lte", ">": "gt", "<": "lt"}
_CONDITION = re.compile(
    r"(?P<field>label|name|path|transformation|strength|metadata\.[^=!<>]+)"
    r"(?P<sign>!=|>=|<=|=|<|>)(?P<value>.*)"
)


@connected
def query(
    session: Session,
    mesh: Annotated[
        Path | None,
        typer.Argument(exists=True, dir_okay=False, metavar="MESH", help="A mesh file."),
    ] = None,
    shape: Annotated[
        str, typer.Option("--shape", help="Id of a stored shape, instead of a mesh.")
    ] = "",
    collection: Annotated[
        str, typer.Option("--collection", "-c", help="Where to search.")
    ] = "default",
    limit: Annotated[
        int, typer.Option("--limit", "-n", min=1, max=1000, help="Number of shapes.")
    ] = 10,
    model: Annotated[str, typer.Option(help="Another model than the collection's.")] = "",
    dissimilarity: Annotated[
        str, typer.Option(help="Another dissimilarity than the model's.")
    ] = "",
    filters: Annotated[
        list[str] | None,
        typer.Option(
            "--filter",
            "-f",
            help="label=cat, label=cat,dog, label!=cat, metadata.age>=3. Repeatable.",
        ),
    ] = None,
    path: Annotated[
        str, typer.Option(help="Search only what lay in this folder, or below it: models/animals.")
    ] = "",
    include_self: Annotated[
        bool | None,
        typer.Option(
            help="Allow a stored shape to find itself; a region finds its shape by default.",
            show_default=False,
        ),
    ] = None,
    region_center: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="VERTEX",
            help="Search with a region of the stored shape: all within --region-radius of this "
            "vertex, counted from 0 as in its GLB file.",
        ),
    ] = None,
    region_radius: Annotated[
        float | None,
        typer.Option(metavar="R", help="Along the surface, in the unit of the mesh."),
    ] = None,
    region: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            metavar="FILE",
            help="Search with a region of the stored shape: a file of its vertices, as JSON or "
            "with spaces between.",
        ),
    ] = None,
    part: Annotated[
        bool, typer.Option("--part", help="The query is a part of what is looked for.")
    ] = False,
    whole: Annotated[
        bool, typer.Option("--whole", help="The query is a whole shape, not a part of one.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            dir_okay=False,
            metavar="FILE.png",
            help=f"Draw the query beside each of the first {PICTURED} matches; points that "
            "correspond have the same colour.",
        ),
    ] = None,
) -> None:
    """Find the shapes most like a mesh, a stored shape, or a region of one."""
    if (mesh is None) == (not shape):
        raise typer.BadParameter("give either a mesh file or --shape ID")
    if part and whole:
        raise typer.BadParameter("give at most one of --part and --whole")
    cut = choose_region(region, region_center, region_radius)
    if cut is not None and not shape:
        raise typer.BadParameter("a region needs --shape ID, the stored shape that it is part of")
    options: Document = {"limit": limit}
    options |= {"model": model} if model else {}
    options |= {"dissimilarity": dissimilarity} if dissimilarity else {}
    options |= {"match": "part" if part else "whole"} if part or whole else {}
    wanted = parse_filters(filters or [])
    if path:
        wanted["must"] = [*wanted.get("must", []), {"field": "path", "under": path}]
    options |= {"filter": wanted} if wanted else {}
    if mesh is not None:
        content = content_with_needs(mesh)
        asked = query_by_mesh(
            session.client, session.output, collection, mesh.name, content, options
        )
    elif cut is not None:
        options |= {} if include_self is None else {"include_self": include_self}
        body = {**options, "shape_id": shape, "region": cut}
        asked = query_by_region(session.client, session.output, collection, body)
    else:
        body = {**options, "shape_id": shape, "include_self": bool(include_self)}
        path = f"/v1/collections/{collection}/query"
        asked = Asked(session.client.post(path, body), f"/v1/shapes/{shape}")
    session.output.show(asked.result, matches_table(asked.result))
    if picture is not None:
        _draw(session, asked, picture)


def _draw(session: Session, asked: Asked, path: Path) -> None:
    """Draw where the query lies on the first matches."""
    from proteus import matched_points  # numpy would cost every other command half a second

    own = fetch_mesh(session, asked.place)
    pairs = []
    for match in asked.result["matches"][:PICTURED]:
        shape = match["shape"]
        other = fetch_mesh(session, f"/v1/shapes/{shape['id']}")
        label = f"{match['rank']}. {shape['name']}"
        try:
            arrays = matched_points.read(fetch_correspondence(session, asked.place, shape["id"]))
        except CommandError as error:  # the answer stands, whatever can be drawn of it
            session.output.error(error)
            arrays = None
        pairs.append(matched_points.Pair(own, other, arrays, label))
    if not pairs:
        raise CommandError("nothing was found, so there is nothing to draw")
    path.write_bytes(matched_points.draw(pairs))


def parse_filters(conditions: Sequence[str]) -> Document:
    """Return the contract's filter for conditions such as ``label=cat``.

    Raises
    ------
    CommandError
        A condition is of no known form.
    """
    must: list[Document] = []
    must_not: list[Document] = []
    for condition in conditions:
        match = _CONDITION.fullmatch(condition)
        if match is None:
            raise CommandError(
                f"--filter {condition!r} is not understood; expected FIELD=VALUE, "
                "FIELD=VALUE,VALUE, FIELD!=VALUE, FIELD>=VALUE (or <=, <, >), where FIELD is "
                "label, name, path, transformation, strength or metadata.NAME"
            )
        field, sign = match["field"], match["sign"]
        values = [_value(field, text) for text in match["value"].split(",")]
        if sign in BOUNDS:
            must.append({"field": field, "range": {BOUNDS[sign]: values[0]}})
            continue
        test = {"equals": values[0]} if len(values) == 1 else {"in": values}
        (must if sign == "=" else must_not).append({"field": field, **test})
    parts = {"must": must, "must_not": must_not}
    return {name: tests for name, tests in parts.items() if tests}


def _value(field: str, text: str) -> object:
    """Return a text field's value as it is, another as the number or truth it may be."""
    if field in TEXT_FIELDS:
        return text
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return text if isinstance(value, (dict, list)) else value


def matches_table(result: Document, *, own: str = "", title: str | None = None) -> Table:
    """Return the matches as a table; shapes whose name begins with ``own`` get a tick."""
    numbers = ("rank", "distance", "similarity")
    found = f"{len(result['matches'])} of {result['searched']} shapes, {result['took_ms']:.1f} ms"
    shapes = [match["shape"] for match in result["matches"]]
    is_shown = not own and any(shape["path"] != shape["name"] for shape in shapes)
    in_folders = ["path"] if is_shown else []
    table = make_table(
        "rank", "name", *in_folders, "label", "distance", "similarity", *([""] if own else ["id"]),
        title=title or f"{escape(result['collection'])}, model {escape(result['model'])}: {found}",
        numbers=numbers,
    )  # fmt: skip
    for match in result["matches"]:
        shape = match["shape"]
        tick = "[green]✓[/]" if own and str(shape["name"]).startswith(own) else ""
        table.add_row(
            str(match["rank"]), cell(shape["name"]), *(cell(shape[name]) for name in in_folders),
            cell(shape["label"]),
            f"{match['distance']:.5g}", f"{match['similarity']:.3f}",
            tick if own else cell(shape["id"]),
        )  # fmt: skip
    return table
