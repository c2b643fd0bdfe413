"""``proteus correspondence``: which point of one shape is which point of another."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from proteus.cli.connection import Session, connected
from proteus.client import Document, json_object
from proteus.terminal.tables import facts_table
from proteus.terminal.waiting import require_success, wait_for_job

WAIT_SECONDS = 2  # for an answer at once; then there is a bar that says what is done


@connected
def correspondence(
    session: Session,
    first: Annotated[
        str, typer.Argument(metavar="A", help="Id of a stored shape, or of a query by mesh.")
    ],
    second: Annotated[str, typer.Argument(metavar="B", help="Id of another stored shape.")],
    query: Annotated[bool, typer.Option("--query", help="A is the id of a query.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", dir_okay=False, metavar="FILE.npz", help="Save all arrays."),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            dir_okay=False,
            metavar="FILE.png",
            help="Draw both shapes; points that correspond have the same colour.",
        ),
    ] = None,
) -> None:
    """Find the point of shape B for each vertex of shape A."""
    own = f"/v1/{'queries' if query else 'shapes'}/{first}"
    data = fetch_correspondence(session, own, second)
    from proteus import matched_points  # numpy would cost every other command half a second

    if out is not None:
        out.write_bytes(data)
    arrays = matched_points.read(data)
    if picture is not None:
        meshes = fetch_mesh(session, own), fetch_mesh(session, f"/v1/shapes/{second}")
        picture.write_bytes(matched_points.draw([matched_points.Pair(*meshes, arrays)]))
    found = matched_points.summary(arrays)
    session.output.show(found, _table(found))


def fetch_correspondence(session: Session, own: str, second: str) -> bytes:
    """Return the npz of a correspondence, after its job where there is one.

    Parameters
    ----------
    session : Session
        Of the command.
    own : str
        Path of a stored shape or of a query.
    second : str
        Id of a stored shape.

    Raises
    ------
    CommandError
        The job failed.
    """
    path = f"{own}/correspondence"
    wanted = {"shape": second, "format": "npz"}
    answer = session.client.request("GET", path, params={**wanted, "wait": WAIT_SECONDS})
    if answer.status_code == 202:
        job = json_object(answer)["job"]
        title = "correspondence"
        require_success(wait_for_job(session.client, session.output, job, title=title))
        answer = session.client.request("GET", path, params=wanted)
    return answer.content


def fetch_mesh(session: Session, path: str) -> bytes:
    """Return the GLB of a stored shape or a query, by its path."""
    return session.client.request("GET", f"{path}/mesh", params={"format": "glb"}).content


def _table(found: Document) -> Table:
    told = {None: "cannot be told", True: "yes", False: "no"}
    return facts_table(
        {
            "scale": f"{found['scale']:.4g}",
            "mirrored": told[found["mirrored"]],
            "coverage": f"{found['coverage']:.1%}",
            "mean confidence": f"{found['mean_confidence']:.2f}",
            "points": f"{found['points']:,}",
        }
    )
