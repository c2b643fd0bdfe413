"""How often windows find the whole of a part among many: ``python -m benchmarks.recall``.

Copies of creatures of the species that nothing was learned from are looked for among 400 shapes
and among 10,000. The table has the share whose whole is among the candidates, those by windows
alone: a search has the nearest hundred by descriptors beside them. Most of the many are creatures
of the same species that were bent: twenty to one that is made. `--learned` takes the species of
training, for choosing.
"""

import argparse
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from proteus.terminal.output import Output
from proteus.terminal.tables import make_table
from workers.creatures import TESTED_SPECIES, TRAINING_SPECIES
from workers.geometry.arrays import IntArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.geometry.views import window_view
from workers.retrieval.windows.candidates import FirstLooks, counting_first
from workers.retrieval.windows.rows import PREFIX_BYTES, write_row
from workers.retrieval.windows.signature import (
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.storage.shipped_models import shipped_model
from workers.training.sources import CreatureSource, Posing, Simulation, load_creature, simulate

SIZES = (400, 10_000)
ASKED = (("partial", (3, 4, 5)), ("view", (1, 3, 5)))
VERTICES = 4000
CROWD_VERTICES = 2500
BENT = 20  # shapes of one creature that is made for the crowd: making costs more than describing
_WAVES, _HEIGHT, _LENGTH, _STRETCH = 4, 0.04, 4.0, 0.12  # of bending, in sizes of the shape


Found = dict[str, list[bool]]
"""Of each kind of copy, whether the whole was among the candidates."""


class Asked(NamedTuple):
    """A copy, and the shape that it is of."""

    kind: str
    signature: Signature
    truth: int


def row(mesh: TriangleMesh) -> NDArray[np.uint8]:
    """The beginning of a shape's row."""
    prepared = Solver(clean(mesh).mesh).prepared(window_view())
    surface = window_surface(prepared, n_vertices=mesh.n_vertices, for_query=False)
    return np.frombuffer(write_row(stored_signature(surface))[:PREFIX_BYTES], dtype=np.uint8)


def bent(mesh: TriangleMesh, rng: np.random.Generator) -> TriangleMesh:
    """Another individual: its space stretched and bent by smooth waves."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    moved = mesh.vertices * np.exp(rng.normal(0.0, _STRETCH, 3))
    for axis in range(3):
        directions = rng.normal(size=(_WAVES, 3)) * (_LENGTH / size)
        phases = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        waves = np.sin(mesh.vertices @ directions.T + phases).sum(axis=1)
        moved[:, axis] += _HEIGHT * size * waves
    return TriangleMesh(moved, mesh.faces)


def crowd(source: CreatureSource) -> NDArray[np.uint8]:
    """Rows (n, bytes) of a creature that is bent in many ways."""
    mesh = load_creature(source).rest
    rng = np.random.default_rng(source.seed)
    return np.array([row(bent(mesh, rng)) for _ in range(BENT)])


def shapes_and_copies(species: str) -> tuple[NDArray[np.uint8], list[tuple[str, Signature]]]:
    """Row of one creature of a species, and its copies."""
    source = CreatureSource(species, 0, VERTICES)
    mesh = load_creature(source).rest
    found = []
    for name, strengths in ASKED:
        for strength in strengths:
            change = Simulation(name, strength, seed=strength, pose=200 + strength)
            copy = clean(simulate(mesh, source, change, posing=Posing.FULL).mesh).mesh
            prepared = Solver(copy).prepared(window_view())
            surface = window_surface(prepared, n_vertices=copy.n_vertices, for_query=True)
            arrays = query_signature(surface).to_arrays()
            found.append((f"{name} {strength}", Signature.from_arrays(arrays)))
    return row(mesh), found


def crowd_sources(species: Sequence[str], n_shapes: int) -> list[CreatureSource]:
    """Creatures that are bent into at least so many shapes, none of which is asked for."""
    wanted = -(-n_shapes // BENT)
    each = ((name, individual) for individual in count(1) for name in species)
    return [CreatureSource(*next(each), CROWD_VERTICES) for _ in range(wanted)]


def measured(asked: Sequence[Asked], rows: NDArray[np.uint8]) -> tuple[Found, float]:
    """What is found, and seconds of CPU a question."""
    windows = shipped_model().windows
    if windows is None:
        raise TypeError("the shipped model compares no windows")
    everything: IntArray = np.arange(len(rows))
    none: IntArray = everything[:0]
    found: Found = {}
    start = time.process_time()
    for one in asked:
        looks = FirstLooks(counting_first(one.signature), windows.whitening)
        chosen = looks.candidates(none, everything, lambda places, size: rows[places, :size])
        found.setdefault(one.kind, []).append(one.truth in chosen.places)
    return found, (time.process_time() - start) / len(asked)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the shapes, look for the copies, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recall", description=__doc__)
    parser.add_argument("--learned", action="store_true", help="species of training")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="N")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args(arguments)
    species = TRAINING_SPECIES if options.learned else TESTED_SPECIES
    sources = crowd_sources(species, max(options.sizes) - len(species))
    with ProcessPoolExecutor(options.processes) as pool:
        own = list(track(pool.map(shapes_and_copies, species), "copies", total=len(species)))
        many = list(track(pool.map(crowd, sources), "crowd", total=len(sources)))
    rows = np.concatenate([np.array([one for one, _ in own]), *many])
    asked = [Asked(*copy, place) for place, (_, copies) in enumerate(own) for copy in copies]
    columns = [measured(asked, rows[:size]) for size in options.sizes]
    names = [f"of {size:,}" for size in options.sizes]
    table = make_table("copies", *names, numbers=names)
    for kind in columns[0][0]:
        table.add_row(kind, *(f"{100 * np.mean(found[kind]):.0f} %" for found, _ in columns))
    table.add_row("CPU seconds a question", *(f"{seconds:.3f}" for _, seconds in columns))
    Output().console.print(table)


if __name__ == "__main__":
    main()
