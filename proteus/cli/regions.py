"""The region of a stored shape that ``proteus query`` searches with."""

import json
import re
from pathlib import Path

import typer

from proteus.client import Document
from proteus.terminal.output import CommandError


def choose_region(file: Path | None, center: int | None, radius: float | None) -> Document | None:
    """Return the contract's region for the options of the command; None without any.

    Parameters
    ----------
    file : Path or None
        Of vertex indices, see `read_vertices`.
    center, radius : int and float, or None
        Both or neither.

    Raises
    ------
    BadParameter
        A region is given in two ways, or by half.
    CommandError
        The file holds no vertex indices.
    """
    if (center is None) != (radius is None):
        raise typer.BadParameter("--region-center and --region-radius go together")
    if file is not None and center is not None:
        raise typer.BadParameter("give either --region or --region-center with --region-radius")
    if file is not None:
        return {"vertices": read_vertices(file)}
    return None if center is None else {"center": center, "radius": radius}


def read_vertices(file: Path) -> list[int]:
    """Return the vertex indices of a file.

    Parameters
    ----------
    file : Path
        A JSON list, a JSON object with a list ``vertices``, or whole numbers with spaces, commas or
        line breaks between them.

    Raises
    ------
    CommandError
        It holds anything else, or nothing.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise CommandError(f"{file} is no text, expected vertex indices") from None
    try:
        found = json.loads(text)
    except ValueError:
        found = [_number(file, word) for word in re.split(r"[\s,;]+", text) if word]
    if isinstance(found, dict):
        found = found.get("vertices")
    found = [found] if type(found) is int else found
    if not isinstance(found, list) or not all(type(one) is int for one in found):
        raise CommandError(f"{file} holds no list of vertex indices, such as [0, 17, 18]")
    if not found:
        raise CommandError(f"{file} is empty, expected vertex indices")
    return found


def _number(file: Path, word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise CommandError(f"{file} holds {word[:40]!r}, expected vertex indices") from None
