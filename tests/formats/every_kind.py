"""All kinds of files, from every module of this folder that registers some."""

import importlib
from pathlib import Path

from tests.formats.kinds import REGISTER, Kind


def every_kind() -> list[Kind]:
    """Import the modules ``*_files.py`` beside this one; their kinds, module after module.

    The order is the same whichever module was imported first.
    """
    for path in sorted(Path(__file__).parent.glob("*_files.py")):
        importlib.import_module(f"tests.formats.{path.stem}")
    return sorted(REGISTER.kinds, key=lambda kind: kind.build.__module__)
