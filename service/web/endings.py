"""The page's list of what files are by the ends of their names, generated from the service's.

``src/api/endings.ts`` is written by ``python -m service.web --types`` and checked in.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

from workers.geometry.formats.containers.clutter import NEVER
from workers.geometry.formats.containers.judging import ARCHIVE_ENDINGS
from workers.geometry.formats.naming import COMPRESSED_ENDINGS, MESH_ENDINGS

FOLDER = Path(__file__).parent
ENDINGS = FOLDER / "src" / "api" / "endings.ts"
HEAD = """\
// Written by `python -m service.web --types` from the lists of the service; not to be changed here.
"""


class OutdatedEndingsError(Exception):
    """The page's endings are not those of the service."""


def write_endings() -> None:
    """Write the endings that the service knows."""
    ENDINGS.write_text(generate(), encoding="utf-8")


def check_endings() -> None:
    """Compare the page's endings with the service's.

    Raises
    ------
    OutdatedEndingsError
        They differ.
    """
    found = ENDINGS.read_text(encoding="utf-8") if ENDINGS.is_file() else ""
    if found != generate():
        raise OutdatedEndingsError(
            f"{ENDINGS.name} differs from the service's lists; "
            "python -m service.web --types writes it"
        )


def generate() -> str:
    """Return the endings in TypeScript, the same for the same lists."""
    sets = (
        ("MESHES", "A file of such an ending is tried as a mesh.", MESH_ENDINGS),
        ("ARCHIVES", "Many shapes may come out of it.", ARCHIVE_ENDINGS),
        ("COMPRESSED", "Before it stands the ending of what is compressed.", COMPRESSED_ENDINGS),
    )
    parts = [_set(name, comment, endings) for name, comment, endings in sets]
    comment = "Never a mesh, whatever it holds, and what it is."
    return "\n".join([HEAD, *parts, _record("CLUTTER", comment, NEVER)])


def _set(name: str, comment: str, endings: Iterable[str]) -> str:
    items = ", ".join(f'"{ending}"' for ending in sorted(endings))
    return f"/** {comment} */\nexport const {name}: ReadonlySet<string> = new Set([{items}]);\n"


def _record(name: str, comment: str, kinds: Mapping[str, str]) -> str:
    items = "".join(f'  ["{ending}", "{kinds[ending]}"],\n' for ending in sorted(kinds))
    head = f"/** {comment} */\nexport const {name}: ReadonlyMap<string, string> = new Map([\n"
    return f"{head}{items}]);\n"
