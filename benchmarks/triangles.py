"""The unevenness of the triangles of meshes: ``python -m benchmarks.triangles FOLDER ...``.

Prints two figures for each mesh below the folders. The first is the standard deviation of its edges
over their mean. The second is the longest edge squared over the area, of its median triangle (1 for
equal sides). Even and uneven creatures of the training stand beside them (decision 12).
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from workers.creatures import make_creature
from workers.creatures.uneven import make_uneven_creature
from workers.errors import ProteusError
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh

EQUAL_SIDES = 4.0 / np.sqrt(3.0)  # longest edge squared over area
SPECIES = ("human", "horse", "octopus")
VERTICES = 4000


def unevenness(mesh: TriangleMesh) -> tuple[float, float]:
    """Variation of edges, and how long the middle triangle is."""
    corners = mesh.vertices[mesh.faces]  # (f, 3, 3)
    sides = corners - np.roll(corners, 1, axis=1)  # (f, 3, 3)
    lengths = np.linalg.norm(sides, axis=2)  # (f, 3)
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)  # (f,)
    long = lengths.max(axis=1) ** 2 / np.maximum(areas, np.finfo(float).tiny)
    return float(lengths.std() / lengths.mean()), float(np.median(long) / EQUAL_SIDES)


def meshes(folders: list[Path]) -> Iterator[tuple[str, TriangleMesh]]:
    """Name and mesh of every file that is one, and of some creatures."""
    for species in SPECIES:
        yield f"even {species}", make_creature(species, seed=0, vertices=VERTICES).rest
        uneven = make_uneven_creature(species, seed=0, vertices=VERTICES)
        yield f"uneven {species}", uneven.rest
    for path in sorted(path for folder in folders for path in folder.rglob("*")):
        if path.is_file():
            try:
                yield path.name, clean(parse(path.read_bytes(), filename=path.name).mesh).mesh
            except ProteusError:
                continue


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="*")
    table = Table("", "vertices", "edges vary by", "middle triangle")
    for name, mesh in meshes(parser.parse_args().folders):
        vary, long = unevenness(mesh)
        table.add_row(name, str(mesh.n_vertices), f"{vary:.2f}", f"{long:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
