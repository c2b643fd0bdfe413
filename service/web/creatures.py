"""The demo collection as an archive: the page loads it by a click, for those without meshes."""

import zipfile
from pathlib import Path

from workers.creatures import CREATURES_VERSION, SPECIES, make_creature
from workers.geometry.formats import write

NAME = "demo.zip"
VERSION = f"1 {CREATURES_VERSION}"
"""Raised when other bytes come out."""

VERTICES = 2000
POSES = (1, 2)
LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the same bytes whenever it is made


def write_archive(path: Path) -> None:
    """Write every other species in two poses, as ``SPECIES/SPECIES-POSE.ply``."""
    with zipfile.ZipFile(path, "w") as archive:
        for species in SPECIES[::2]:
            creature = make_creature(species, seed=1, vertices=VERTICES)
            for pose in POSES:
                entry = zipfile.ZipInfo(f"{species}/{species}-{pose}.ply", LONG_AGO)
                entry.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(entry, write(creature.posed(pose), "ply"))
