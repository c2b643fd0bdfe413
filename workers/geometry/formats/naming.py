"""What a file's name says of its shape."""

import re
from dataclasses import dataclass
from pathlib import PurePosixPath

MAX_NAME = 255
_SHREC = re.compile(r"^(?P<label>[^.]+)\.(?P<transformation>[^.\d][^.]*)\.(?P<strength>\d{1,3})$")


@dataclass(frozen=True)
class Naming:
    """Name, label, transformation and strength, as far as the file's name tells them."""

    name: str
    label: str | None = None
    transformation: str | None = None
    strength: int | None = None


def read_name(filename: str) -> Naming:
    """Read a file's name, or its path inside a zip.

    ``<label>.<transformation>.<strength>.<ending>`` is the convention of SHREC, as in
    ``cat.holes.3.off``. Otherwise the folder, if there is one, is the label, as in ``cat/17.ply``.
    Nothing of it is ever used as a path.

    Parameters
    ----------
    filename : str
        As the client or the archive gave it.

    Returns
    -------
    Naming
        Printable text, the name at most 255 characters long.
    """
    printable = "".join(c for c in filename.replace("\\", "/") if c.isprintable())
    path = PurePosixPath(printable)
    name = path.name[-MAX_NAME:] or "unnamed"
    if found := _SHREC.match(PurePosixPath(name).stem):
        return Naming(name, found["label"], found["transformation"], int(found["strength"]))
    folder = path.parent.name
    return Naming(name, folder[:MAX_NAME] if folder not in {"", ".", ".."} else None)
