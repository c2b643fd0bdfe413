"""How a scan differs from a view: ``python -m benchmarks.scans [FILE ...]``.

Prints the medians of five creatures and of the given meshes at strengths 1, 3 and 5.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from workers.creatures import make_creature
from workers.geometry.arrays import FloatArray, lengths
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_edges, count_surface_components
from workers.transformations import transform

NAMES = ("view", "scan")
STRENGTHS = (1, 3, 5)
SPECIES = ("human", "horse", "octopus", "spider", "bird")
MEASURED = ("rim, √A", "pieces", "area left", "vertices", "seconds")


def shapes(files: list[Path]) -> Iterator[TriangleMesh]:
    """Creatures in a pose, and the meshes of the files."""
    for species in SPECIES:
        yield make_creature(species, seed=1, vertices=8000).posed(1)
    for path in files:
        yield clean(parse(path.read_bytes(), filename=path.name).mesh).mesh


def measured(mesh: TriangleMesh, name: str, strength: int, seed: int) -> FloatArray:
    """What `MEASURED` names, (5,)."""
    start = time.perf_counter()
    found = transform(mesh, name, strength, seed=seed).mesh
    seconds = time.perf_counter() - start
    ends = found.vertices[boundary_edges(found)]  # (b, 2, 3)
    rim = lengths(ends[:, 1] - ends[:, 0]).sum() / np.sqrt(mesh.area)
    pieces = count_surface_components(found)
    return np.array([rim, pieces, found.area / mesh.area, found.n_vertices, seconds])


def main() -> None:
    """Measure both at each strength, and print the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    asked = parser.parse_args()
    meshes = list(shapes(asked.files))
    table = Table("transformation", "strength", *MEASURED)
    rows = [(name, strength) for strength in STRENGTHS for name in NAMES]
    for name, strength in track(rows, console=Console(stderr=True)):
        found = [measured(m, name, strength, seed) for m in meshes for seed in range(asked.seeds)]
        values = np.median(found, axis=0)
        table.add_row(name, str(strength), *(f"{value:.3g}" for value in values))
    Console().print(table)


if __name__ == "__main__":
    main()
