"""The typical distances of ``workers/retrieval/calibration.py``, measured on creatures.

``python -m benchmarks.calibrate``

Two individuals of every species in two poses each are described by the built-in models. Printed
is the table of `TYPICAL_DISTANCES`: the median distance over all pairs of different species, to
three digits, for each model and dissimilarity. The comment in each line is the similarity at which
two poses of one individual come out by it, in the median. Nothing is random: the same code prints
the same table.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from workers.creatures import SPECIES, make_creature
from workers.geometry.arrays import BoolArray, Float32Array, FloatArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.retrieval.builtin import built_in_models
from workers.retrieval.dissimilarity import DISSIMILARITIES, VECTOR_DISSIMILARITIES
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances

INDIVIDUALS, POSES = (0, 1), (0, 1)


def creatures() -> Iterator[tuple[str, int, TriangleMesh]]:
    """Species, seed of the individual, and mesh of every shape that is measured."""
    for species, seed in product(SPECIES, INDIVIDUALS):
        creature = make_creature(species, seed=seed)
        for pose in POSES:
            yield species, seed, creature.posed(pose)


def descriptors(mesh: TriangleMesh, models: tuple[Model, ...]) -> dict[str, Float32Array]:
    """Descriptors of a mesh by the model's name; all models share one view."""
    (view,) = {view for model in models for view in model.views}
    solutions = {view.name: solve(clean(mesh).mesh, view)}
    return {model.name: describe(solutions, model) for model in models}


def pair_distances(rows: Float32Array, model: Model, dissimilarity: str) -> FloatArray:
    """Distances (n, n) between all descriptors, from row to column."""
    return np.stack([distances(row, rows, model, dissimilarity=dissimilarity) for row in rows])


def report(
    model: Model, rows: Float32Array, other_species: BoolArray, same_individual: BoolArray
) -> dict[str, float]:
    """Print a model's part of the table and return it."""
    plain = all(channel.is_distribution for channel in model.channels)
    table = {}
    sys.stdout.write(f'        "{model.method}": {{\n')
    for name in DISSIMILARITIES if plain else VECTOR_DISSIMILARITIES:
        matrix = pair_distances(rows, model, name)
        table[name] = float(f"{np.median(matrix[other_species]):.3g}")
        similar = 2.0 ** -(np.median(matrix[same_individual]) / table[name])
        sys.stdout.write(f'            "{name}": {table[name]},  # poses: {similar:.2f}\n')
    sys.stdout.write("        },\n")
    return table


def main() -> None:
    """Measure and print the table; save it as JSON where ``--out`` says."""
    parser = argparse.ArgumentParser(description="measure typical distances between species")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    models = built_in_models()
    count = len(SPECIES) * len(INDIVIDUALS) * len(POSES)
    species, seeds, rows = [], [], []
    for name, seed, mesh in track(
        creatures(), "describing creatures", count, console=Console(stderr=True)
    ):
        species.append(name)
        seeds.append(seed)
        rows.append(descriptors(mesh, models))
    kinds, individuals = np.array(species), np.array(seeds)
    other_species = kinds[:, None] != kinds  # (n, n)
    same_individual = ~other_species & (individuals[:, None] == individuals)
    np.fill_diagonal(same_individual, val=False)
    table = {}
    for model in models:
        matrix = np.stack([row[model.name] for row in rows])
        table[model.method] = report(model, matrix, other_species, same_individual)
    if options.out is not None:
        options.out.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
