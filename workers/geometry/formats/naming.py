"""What a file's name says of its shape."""

import re
import unicodedata
from dataclasses import dataclass
from pathlib import PurePosixPath

MAX_NAME = 255
MAX_PATH = 1024
MESH_ENDINGS = frozenset(
    {
        *("off", "obj", "ply", "stl", "glb", "gltf", "3mf", "amf", "dae"),
        *("vtk", "vtp", "vtu", "vts", "gii", "msh", "mesh"),
    }
)
"""Of files that can be read. Other names are read too, where the content says what it is."""

COMPRESSED_ENDINGS = frozenset({"gz", "gzip", "bz2", "xz", "lzma"})
_DRIVE = re.compile(r"[A-Za-z]:")
_SHREC = re.compile(r"^(?P<label>[^.]+)\.(?P<transformation>[^.\d][^.]*)\.(?P<strength>\d{1,3})$")


@dataclass(frozen=True)
class Naming:
    """Name, label, transformation and strength, as far as the file's name tells them.

    Attributes
    ----------
    path : str
        Folders and name, with ``/`` between them: where the file lay.
    """

    name: str
    label: str | None = None
    transformation: str | None = None
    strength: int | None = None
    path: str = ""


def read_name(filename: str, *, folder_is_label: bool = True) -> Naming:
    """Read a file's name, or its path inside a folder or archive.

    ``<label>.<transformation>.<strength>.<ending>`` is the convention of SHREC, as in
    ``cat.holes.3.off``. Otherwise the folder, if there is one, is the label, as in ``cat/17.ply``.
    Nothing of it is ever used as a path.

    Parameters
    ----------
    filename : str
        As the client or the archive gave it.
    folder_is_label : bool
        Whether a folder is a label.

    Returns
    -------
    Naming
        Printable text, the name at most 255 and the path at most 1024 characters long.
    """
    path = clean_path(filename)
    name = path.rpartition("/")[2]
    if found := _SHREC.match(PurePosixPath(inner_name(name)).stem):
        named = (found["label"], found["transformation"], int(found["strength"]))
        return Naming(name, *named, path=path)
    folder = path.rpartition("/")[0].rpartition("/")[2] if folder_is_label else ""
    return Naming(name, folder[:MAX_NAME] or None, path=path)


def clean_path(filename: str) -> str:
    """Write a path as it is stored: printable, with ``/`` between names, and relative.

    Drives, ``.`` and ``..`` are left out. Of a path that is too long, the first folders are.

    Parameters
    ----------
    filename : str
        As the client or the archive gave it.

    Returns
    -------
    str
        Folders and the name, ``unnamed`` where there is none.
    """
    composed = unicodedata.normalize("NFC", filename)  # one way to write ä, whoever archived it
    printable = "".join(c for c in composed.replace("\\", "/") if c.isprintable())
    parts = [part for part in printable.split("/") if part not in {"", ".", ".."}]
    if parts and _DRIVE.fullmatch(parts[0]):
        del parts[0]
    name = parts.pop()[-MAX_NAME:] if parts else "unnamed"
    length = len(name)
    kept = [name]
    for folder in reversed(parts):
        length += 1 + len(folder)
        if length > MAX_PATH:
            break
        kept.append(folder)
    return "/".join(reversed(kept))


def inner_name(filename: str) -> str:
    """Return the name of a compressed file's content: ``cat.ply`` for ``cat.ply.gz``.

    Parameters
    ----------
    filename : str
        Name of any file.

    Returns
    -------
    str
        The name without the ending that says how it is compressed, if it has one.
    """
    stem, dot, ending = filename.rpartition(".")
    return stem if dot and stem and ending.lower() in COMPRESSED_ENDINGS else filename
