"""What each part of the model `proteus` gives: banks trained without it, on the same shapes.

``python -m benchmarks.bank_study --training proteus-training --benchmark bench`` takes what
``make train-default`` stored and what ``proteus benchmark build`` made, and prints, for each way of
training, the rows on the benchmark, and their mean beside that of all together with the 95 per
cent interval of a paired bootstrap over shapes. Descriptors of the benchmark are kept in it; with
``--solutions DIR``, the data directory of a service that has it already, nothing is solved twice.
"""

import argparse
import hashlib
import json
import multiprocessing
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from sqlalchemy import select

from workers.errors import ProteusError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.solution import solve
from workers.pipeline.naming import read_name
from workers.pipeline.solve import solve_view
from workers.pipeline.train_bank import bank_shapes, descriptors
from workers.pipeline.training_parts import VARIANT, load_kept
from workers.pipeline.training_variants import Variant
from workers.pipeline.workbench import Workbench
from workers.retrieval.bank import BankOptions, BankShapes, train_bank
from workers.retrieval.bootstrap import difference, mean_of_rows
from workers.retrieval.channels import EIGENVALUES, Channel
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances, with_points
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part
from workers.storage.parts import Failure

BASE = "all together"
NOT_COUNTED = ("view",)
"""Rows beside the paper's eleven, shown but not part of the mean."""


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Descriptors under all candidates of null shapes and others (g, d), and of queries (q, d)."""

    targets: Float32Array
    queries: Float32Array
    truth: IntArray
    transformations: tuple[str, ...]


Way = Callable[[BankShapes, Model], tuple[BankShapes, Model, BankOptions]]
"""From all there is to what a bank is trained with."""


def trained_on(folder: Path) -> tuple[BankShapes, Model]:
    """Descriptors that ``make train-default`` stored, and the candidates they are under."""
    settings = Settings(data_dir=folder)
    database = Database(settings.resolved_database_url)
    bench = Workbench(database, BlobStore(settings.resolved_blob_url), settings, lambda parts: None)
    with database.read() as session:
        newest = (
            select(Part.job_id).where(Part.kind == VARIANT).order_by(Part.job_id.desc()).limit(1)
        )
        payloads = session.scalars(
            select(Part.payload).where(
                Part.kind == VARIANT, Part.job_id == newest.scalar_subquery()
            )
        ).all()
    database.dispose()
    planned = sorted(map(Variant.from_payload, payloads), key=lambda variant: variant.number)
    found = [(variant, load_kept(bench, VARIANT, variant)) for variant in planned]
    there = [(variant, kept) for variant, kept in found if not isinstance(kept, Failure)]
    rows = descriptors([kept for _, kept in there])
    return bank_shapes([variant for variant, _ in there], rows), planned[0].candidates


def described(
    folder: Path, candidates: Model, processes: int, solutions: Path | None = None
) -> Benchmark:
    """Descriptors of a benchmark's files, computed where they are not kept in it already."""
    kept = folder / "candidates.npz"
    names = json.loads((folder / "benchmark.json").read_text())["files"]
    versions = json.dumps(candidates.to_json(), sort_keys=True)
    if kept.is_file():
        with np.load(kept, allow_pickle=False) as arrays:
            if str(arrays["versions"]) == versions:
                return _arranged(names, arrays["rows"])
    jobs = [(folder / name, json.dumps(candidates.to_json()), solutions) for name in names]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        rows = list(
            track(
                pool.imap(_describe, jobs, chunksize=2),
                "describing the benchmark",
                len(jobs),
                console=Console(stderr=True),
            )
        )
    matrix = np.stack(rows)
    np.savez(kept, rows=matrix, versions=np.array(versions))
    return _arranged(names, matrix)


def _describe(job: tuple[Path, str, Path | None]) -> Float32Array:
    """Descriptor of a file; of NaN where it cannot be described."""
    path, candidates, data_dir = job[0], Model.from_json(json.loads(job[1])), job[2]
    try:
        data = path.read_bytes()
        mesh = clean(parse(data, filename=path.name).mesh).mesh
        if data_dir is None:
            found = {view.name: solve(mesh, view) for view in candidates.views}
        else:
            blobs = BlobStore(Settings(data_dir=data_dir).resolved_blob_url)
            digest = hashlib.sha256(data).hexdigest()
            found = {v.name: solve_view(blobs, digest, mesh, v) for v in candidates.views}
        return describe(found, candidates)
    except ProteusError:
        return np.full(candidates.dimension, np.nan, dtype=np.float32)


def _arranged(names: Sequence[str], rows: Float32Array) -> Benchmark:
    """Tell targets from queries by their names, and leave out what was not described."""
    there = ~np.isnan(rows).any(axis=1)
    naming = [read_name(name) for name in names]
    is_query = np.array([one.transformation not in {None, "null"} for one in naming])
    targets, queries = np.flatnonzero(there & ~is_query), np.flatnonzero(there & is_query)
    place = {naming[i].label: n for n, i in enumerate(targets.tolist())}
    return Benchmark(
        rows[targets],
        rows[queries],
        np.array([place[naming[i].label] for i in queries.tolist()]),
        tuple(str(naming[i].transformation) for i in queries.tolist()),
    )


def columns(candidates: Model, channels: Sequence[Channel]) -> IntArray:
    """Where these channels stand in the candidates' descriptors."""
    every = np.arange(candidates.dimension)
    return np.concatenate([every[candidates.slices[channel.name]] for channel in channels])


def only(keep: Callable[[Channel], bool], options: BankOptions | None = None) -> Way:
    """Train with some of the candidates."""

    def restrict(shapes: BankShapes, all_of_them: Model) -> tuple[BankShapes, Model, BankOptions]:
        kept = tuple(channel for channel in all_of_them.channels if keep(channel))
        chosen = columns(all_of_them, kept)
        fewer = replace(
            shapes, references=shapes.references[:, chosen], queries=shapes.queries[:, chosen]
        )
        return fewer, replace(all_of_them, channels=kept), options or BankOptions()

    return restrict


def half_of_the_shapes(
    shapes: BankShapes, candidates: Model
) -> tuple[BankShapes, Model, BankOptions]:
    """Train with every other shape."""
    kept = np.arange(0, len(shapes.references), 2)
    asked = np.flatnonzero(shapes.truth % 2 == 0)
    names = ("groups", "names", "lenient")
    fewer = replace(
        shapes,
        references=shapes.references[kept],
        queries=shapes.queries[asked],
        truth=shapes.truth[asked] // 2,
        **{name: tuple(getattr(shapes, name)[i] for i in kept) for name in names},
        **{
            name: tuple(getattr(shapes, name)[i] for i in asked)
            for name in ("transformations", "strengths")
        },
    )
    return fewer, candidates, BankOptions()


def _of_view(name: str) -> Way:
    return only(lambda channel: channel.view == name)


WAYS: Mapping[str, Way] = {
    BASE: only(lambda channel: True),
    "without points": only(lambda channel: not channel.is_of_points),
    "view closed alone": _of_view("closed"),
    "view smooth alone": _of_view("smooth"),
    "without eigenvalues": only(lambda channel: channel.feature != EIGENVALUES),
    "quantiles alone, uncentred": only(lambda channel: channel.centre == "none"),
    "heat kernels alone": only(
        lambda channel: channel.kernel is not None and channel.kernel.kind == "heat"
    ),
    "at most 8 channels": only(lambda channel: True, BankOptions(channels=8)),
    "at most 100 channels": only(lambda channel: True, BankOptions(channels=100)),
    "at most 16 channels": only(lambda channel: True, BankOptions(channels=16)),
    "power 1/2": only(lambda channel: True, BankOptions(power=0.5)),
    "power 1": only(lambda channel: True, BankOptions(power=1.0)),
    "half of the shapes": half_of_the_shapes,
}


def scores_of(model: Model, candidates: Model, benchmark: Benchmark) -> FloatArray:
    """Average precision of each query, (q,), in per cent: 100 / rank."""
    chosen = columns(candidates, model.channels)
    targets = benchmark.targets[:, chosen]
    scores = np.empty(len(benchmark.queries))
    for number, (query, own) in enumerate(
        zip(benchmark.queries[:, chosen], benchmark.truth.tolist(), strict=True)
    ):
        far = distances(query, targets, model)
        far = with_points(query, lambda places: targets[places], far, model)
        scores[number] = 100.0 / np.count_nonzero(far <= far[own])
    return scores


def main() -> None:
    """Train each way, measure, print, and save what was measured where ``--out`` says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--training", type=Path, required=True)
    parser.add_argument("--benchmark", type=Path, required=True)
    parser.add_argument("--solutions", type=Path, help="data directory with spectra")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--way", action="append", choices=[*WAYS], help="again for more")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    shapes, candidates = trained_on(options.training)
    benchmark = described(options.benchmark, candidates, options.processes, options.solutions)
    ways = dict.fromkeys([BASE, *(options.way or WAYS)])
    found, channels = {}, {}
    for name in track(list(ways), "training", console=Console(stderr=True)):
        fewer, chosen_from, bank = WAYS[name](shapes, candidates)
        trained = train_bank("study", fewer, chosen_from, bank, parameters={}, versions={})
        found[name] = scores_of(trained.model, candidates, benchmark)
        channels[name] = len(trained.model.channels)
    _print(found, channels, benchmark)
    if options.out is not None:
        told = {name: scores.tolist() for name, scores in found.items()}
        options.out.write_text(json.dumps(told) + "\n")


def _print(
    found: Mapping[str, FloatArray], channels: Mapping[str, int], benchmark: Benchmark
) -> None:
    """Show the rows of every way, and its mean beside that of the first."""
    names = list(dict.fromkeys(benchmark.transformations))
    row_of = np.array([names.index(name) for name in benchmark.transformations])
    counted = np.array([name not in NOT_COUNTED for name in benchmark.transformations])
    means = mean_of_rows(
        np.stack([scores[counted] for scores in found.values()]),
        np.unique(row_of[counted], return_inverse=True)[1],
        benchmark.truth[counted],
        seed=0,
    )
    table = Table("", "channels", *names, "mean", f"minus {BASE}")
    for number, (name, scores) in enumerate(found.items()):
        rows = [f"{scores[row_of == row].mean():.1f}" for row in range(len(names))]
        beside = difference(means, number, 0)
        gap = (
            "" if number == 0 else f"{beside.value:+.1f} ({beside.low:+.1f} to {beside.high:+.1f})"
        )
        table.add_row(name, str(channels[name]), *rows, f"{means.values[number]:.1f}", gap)
    Console(width=220).print(table)


if __name__ == "__main__":
    main()
