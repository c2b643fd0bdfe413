"""What the model `proteus` knows of windows: learned and measured.

``python -m benchmarks.windows`` learns all of it on creatures of the species that banks are trained
on: first the whitening, then how much windows count. It prints a cross-validation over these
species. ``--write`` puts what was learned into the shipped model.
With ``--measure`` creatures of the other species are searched for, which nothing was learned from.
"""

import argparse
import json
import pickle
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from proteus.terminal.output import Output
from proteus.terminal.tables import make_table
from workers.creatures import TESTED_SPECIES, TRAINING_SPECIES, make_creature
from workers.errors import ProteusError
from workers.geometry.arrays import BoolArray, FloatArray
from workers.geometry.views import window_view
from workers.retrieval.calibration import impostor_share
from workers.retrieval.windows.closely import compare_closely
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.whitening import learn_whitening
from workers.storage.shipped_models import FOLDER, shipped_model, shipped_report, write_shipped
from workers.training.bank_shapes import BankShapes, search_distances
from workers.training.chosen_windows import COPIES as TAUGHT
from workers.training.examples import Variant
from workers.training.ranking_loss import ranks_among
from workers.training.sources import CreatureSource, Posing, Simulation, load_creature, simulate
from workers.training.window_pairs import WindowPairs, creature_pairs, fine_vertices
from workers.training.window_shapes import Arrays, WindowShapes, described_mesh
from workers.training.windows import (
    cross_validated,
    folds_of,
    learn_windows,
    windows_report,
)

VERTICES = 4000
FINE_VERTICES = fine_vertices(window_view())
INDIVIDUALS = 4
ASKED = 2
"""Of the individuals of a species so many are asked for."""

ANEW = ", meshed anew"
"""Behind the names of copies that do not have the triangles of their shape."""

TOLD = (0.001, 0.01, 0.05, 0.2)
"""Shares of wrong pairs by which a similarity is checked."""

NOT_LEARNED_FROM = ("scan",)
"""Learning from scans taught distrust of all sheets (docs/method.md). Measured once: views of
strengths 1, 3 and 5 fell from 83, 75 and 64 to 76, 65 and 62 on held-out species of training."""

COPIES = (*TAUGHT, ("scan", (1, 3, 5)))
"""Transformations and strengths of the copies; scans are measured, but not learned from."""


def variants_of(species: Sequence[str]) -> list[Variant]:
    """Return all individuals, then copies of the first two of each in turn.

    Half of the copies are meshed anew: made of a finer mesh of the individual, and simplified. So
    two scans of one thing differ, and a file from its original.
    """
    model, view = shipped_model(), window_view()
    found: list[Variant] = []
    for place, name in enumerate(species):
        for individual in range(INDIVIDUALS):
            source = CreatureSource(name, individual, VERTICES, uneven=place % 2 == 1)
            number, item = len(found), f"{name} {individual}"
            found.append(
                Variant(number, item, source, name, False, number, None, model.views, view)
            )
    for place, name in enumerate(species):
        for number, (transformation, strengths) in enumerate(COPIES):
            for turn, strength in enumerate(strengths):
                individual = (place + number + turn) % ASKED
                shape = found[INDIVIDUALS * place + individual]
                pose = 100 + individual + strength
                change = Simulation(transformation, strength, seed=1000 + pose, pose=pose)
                copied = replace(
                    shape,
                    number=len(found),
                    item=f"{shape.item} {transformation} {strength}",
                    change=change,
                )
                if (place + number + turn) // ASKED % 2 == 1:
                    finer = CreatureSource(name, individual, FINE_VERTICES)
                    copied = replace(copied, item=f"{copied.item}{ANEW}", source=finer)
                found.append(copied)
    return found


def described(payload: dict[str, Any]) -> Arrays | str:
    """Make a variant and describe it; one that cannot be made is named with the reason."""
    variant = Variant.from_payload(payload)
    source, change = variant.source, variant.change
    if not isinstance(source, CreatureSource):
        raise TypeError(f"{variant.item} is no creature")
    mesh = load_creature(source).rest
    try:
        if change is not None:
            mesh = simulate(mesh, source, change, posing=Posing.FULL).mesh
        is_copy = change is not None
        return described_mesh(mesh, shipped_model(), windows=variant.windows, is_copy=is_copy)
    except ProteusError as error:
        return f"{variant.item}: {error}"


def pairs(species: str) -> WindowPairs:
    """Corresponding points of one creature of a species and its copies."""
    rng = np.random.default_rng(TRAINING_SPECIES.index(species))
    creature = make_creature(species, seed=0, vertices=FINE_VERTICES)
    return creature_pairs(creature, window_view(), rng=rng)


def all_pairs(processes: int) -> WindowPairs:
    """Corresponding points of one creature of each species that banks are trained on."""
    with ProcessPoolExecutor(processes) as pool:
        running = pool.map(pairs, TRAINING_SPECIES)
        return WindowPairs.joined(list(track(running, "pairs", total=len(TRAINING_SPECIES))))


def all_described(species: Sequence[str], processes: int) -> list[Arrays | str]:
    """Describe all creatures and copies of some species, or say why not."""
    payloads = [variant.to_payload() for variant in variants_of(species)]
    with ProcessPoolExecutor(processes) as pool:
        running = pool.map(described, payloads, chunksize=2)
        return list(track(running, "creatures", total=len(payloads)))


def arranged(
    species: Sequence[str], found: Sequence[Arrays | str]
) -> tuple[WindowShapes, BoolArray]:
    """Shapes and copies that could be described, and which copies are meshed anew.

    The others are named.
    """
    there = []
    for variant, one in zip(variants_of(species), found, strict=True):
        if isinstance(one, str):
            Output().say(one)
        else:
            there.append((variant, one))
    shapes = WindowShapes.of([variant for variant, _ in there], [arrays for _, arrays in there])
    known = {variant.number for variant, _ in there if variant.change is None}
    copies = [one for one, _ in there if one.change is not None and one.reference in known]
    return shapes, np.array([one.item.endswith(ANEW) for one in copies], dtype=np.bool_)


def searched(shapes: WindowShapes, near: FloatArray, matching: WindowMatching) -> FloatArray:
    """Distances (q, g) as a search has them."""
    return np.array(
        [
            compare_closely(one, matching, row, lambda places: places, shapes.fetch)[0]
            for one, row in zip(shapes.signatures, near, strict=True)
        ]
    )


def show(shapes: BankShapes, anew: BoolArray, near: FloatArray, fused: FloatArray) -> None:
    """Print a row for each transformation and strength: the bank alone, and all evidence.

    Two further columns have all evidence of copies with their shape's triangles, and of others.
    """
    before, after = (1.0 / ranks_among(one, shapes.truth) for one in (near, fused))
    names = list(zip(shapes.transformations, shapes.strengths, strict=True))
    columns = ((before, ~anew | anew), (after, ~anew | anew), (after, ~anew), (after, anew))
    headings = ("bank alone", "with windows", "its triangles", "meshed anew")
    table = make_table("copies", *headings, numbers=headings)
    means = []
    for transformation, strengths in COPIES:
        own = np.array([name == transformation for name, _ in names])
        means.append([ranks[own & chosen].mean() for ranks, chosen in columns])
        for strength in strengths:
            own = np.array([name == (transformation, strength) for name in names])
            found = [ranks[own & chosen].mean() for ranks, chosen in columns]
            table.add_row(f"{transformation} {strength}", *_percent(found))
    table.add_row("mean of the transformations", *_percent(np.mean(means, axis=0)))
    Output().console.print(table)


def _percent(shares: Iterable[float]) -> list[str]:
    return [f"{100 * share:.1f}" for share in shares]


def calibrated(shapes: BankShapes, fused: FloatArray, matching: WindowMatching) -> None:
    """Print how many wrong pairs come closer than a similarity says."""
    wrong = np.ones(fused.shape, dtype=np.bool_)
    wrong[np.arange(len(shapes.truth)), shapes.truth] = False
    shares = impostor_share(fused[wrong], matching.impostor_quantiles)
    told = ", ".join(f"{100 * np.mean(shares <= share):.1f} of {100 * share:g}" for share in TOLD)
    Output().say(f"wrong pairs that come closer, per cent: {told}")


def _kept(folder: Path | None, name: str, make: Callable[[], Any]) -> Any:
    """Return what was made before, or make it and keep it."""
    if folder is None:
        return make()
    path = folder / f"{name}.pickle"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(make()))
    return pickle.loads(path.read_bytes())


def main(arguments: Sequence[str] | None = None) -> None:
    """Learn, measure, and write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.windows", description=__doc__)
    parser.add_argument("--cache", type=Path, default=None, help="folder for what was described")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--measure", action="store_true", help="on the other species, too")
    parser.add_argument("--write", action="store_true", help="into the shipped model")
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args(arguments)
    model = shipped_model()
    points: WindowPairs = _kept(options.cache, "pairs", lambda: all_pairs(options.processes))
    whitening = learn_whitening(points.differences, points.one, points.other)
    training = _kept(
        options.cache, "taught", lambda: all_described(TRAINING_SPECIES, options.processes)
    )
    shapes, anew = arranged(TRAINING_SPECIES, training)
    near = search_distances(shapes.bank, model)
    Output().say("comparing")
    known = shapes.compared(near, whitening)
    taught = ~np.isin(known.transformations, NOT_LEARNED_FROM)
    learned_from = known.only(taught)
    matching = learn_windows(learned_from, whitening, window_view())
    Output().say(json.dumps(matching.trust.to_json()))
    folds = folds_of(shapes.bank.query_groups)
    show(shapes.bank, anew, near, cross_validated(known, folds, taught))
    if options.write:
        found = windows_report(learned_from, shapes.bank.only(taught))
        report = {"learned": True, "n_pairs": len(points.differences), **found}
        written = replace(model, windows=matching)
        write_shipped(written.to_json(), {**shipped_report(), "windows": report}, options.out)
    if not options.measure:
        return
    tested = _kept(
        options.cache, "others", lambda: all_described(TESTED_SPECIES, options.processes)
    )
    others, anew = arranged(TESTED_SPECIES, tested)
    near = search_distances(others.bank, model)
    fused = searched(others, near, matching)
    show(others.bank, anew, near, fused)
    calibrated(others.bank, fused, matching)


if __name__ == "__main__":
    main()
