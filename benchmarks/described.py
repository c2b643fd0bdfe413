"""The files of a benchmark as descriptors, what a model finds among them, and the table of rows.

What both studies of banks share; `proteus benchmark run` asks a service instead.
"""

import hashlib
import json
import multiprocessing
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from workers.errors import ProteusError
from workers.geometry.arrays import Float32Array, FloatArray
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.formats.naming import read_name
from workers.geometry.solution import Solver
from workers.geometry.views import View
from workers.pipeline.solve import solve_view
from workers.retrieval.bootstrap import difference, mean_of_rows
from workers.retrieval.model import Model, describe
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.training.bank_shapes import BankShapes, search_distances
from workers.training.ranking_loss import ranks_among

CONSOLE = Console(width=220)
PROGRESS = Console(stderr=True)
NOT_COUNTED = ("view", "scan")
"""Rows beside the paper's eleven, shown but not part of the mean."""


def described(
    folder: Path, model: Model, processes: int, solutions: Path | None = None
) -> BankShapes:
    """Descriptors of a benchmark's null shapes and others as references, of its copies as queries.

    They are kept in the folder, by view; what cannot be described is left out.

    Parameters
    ----------
    folder : Path
        Made by ``proteus benchmark build``.
    model : Model
    processes : int
    solutions : Path, optional
        Data directory of a service, whose spectra are taken, and where those missing are stored.
    """
    names = json.loads((folder / "benchmark.json").read_text())["files"]
    rows = np.empty((len(names), model.dimension), dtype=np.float32)
    for view in model.views:
        own = of_view(model, view)
        found = _of_view(folder, names, own, processes, solutions)
        for name, columns in own.slices.items():
            rows[:, model.slices[name]] = found[:, columns]
    return _arranged(names, rows)


def of_view(model: Model, view: View) -> Model:
    """Model of what has one view."""
    return replace(
        model,
        views=(view,),
        channels=tuple(one for one in model.channels if one.view == view.name),
        roughness_limits=tuple(one for one in model.roughness_limits if one.view == view.name),
    )


def _of_view(
    folder: Path, names: Sequence[str], model: Model, processes: int, solutions: Path | None
) -> Float32Array:
    """Descriptors of all files under a model of one view, kept in the folder."""
    content = json.dumps(model.to_json(), sort_keys=True)
    kept = folder / f"described-{hashlib.sha256(content.encode()).hexdigest()[:12]}.npy"
    if not kept.is_file():
        jobs = [(folder / name, content, solutions) for name in names]
        with multiprocessing.get_context("spawn").Pool(processes) as pool:
            ordered = pool.imap(_describe, jobs, chunksize=2)
            told = f"view {model.views[0].name}"
            np.save(kept, np.stack(list(track(ordered, told, len(jobs), console=PROGRESS))))
    rows: Float32Array = np.load(kept, allow_pickle=False)
    return rows


def _describe(job: tuple[Path, str, Path | None]) -> Float32Array:
    """Descriptor of a file; of NaN where it cannot be described."""
    path, model, data_dir = job[0], Model.from_json(json.loads(job[1])), job[2]
    try:
        data = path.read_bytes()
        mesh = clean(parse(data, filename=path.name).mesh).mesh
        if data_dir is None:
            solver = Solver(mesh)
            found = {view.name: solver.under(view) for view in model.views}
        else:
            blobs = BlobStore(Settings(data_dir=data_dir).resolved_blob_url)
            digest = hashlib.sha256(data).hexdigest()
            found = {v.name: solve_view(blobs, digest, mesh, v) for v in model.views}
        return describe(found, model)
    except ProteusError:
        return np.full(model.dimension, np.nan, dtype=np.float32)


def _arranged(names: Sequence[str], rows: Float32Array) -> BankShapes:
    """Tell references from queries by their names, and leave out what was not described."""
    there = ~np.isnan(rows).any(axis=1)
    naming = [read_name(name) for name in names]
    is_query = np.array([one.transformation not in {None, "null"} for one in naming])
    references, queries = np.flatnonzero(there & ~is_query), np.flatnonzero(there & is_query)
    labels = tuple(str(naming[i].label) for i in references.tolist())
    asked = [naming[i] for i in queries.tolist()]
    return BankShapes(
        references=rows[references],
        groups=labels,
        names=labels,
        lenient=(False,) * len(labels),
        queries=rows[queries],
        truth=np.array([labels.index(str(one.label)) for one in asked]),
        transformations=tuple(str(one.transformation) for one in asked),
        strengths=tuple(int(one.strength or 0) for one in asked),
    )


def scores_of(model: Model, shapes: BankShapes) -> FloatArray:
    """Average precision of each query, (q,), in per cent: 100 / rank."""
    scores: FloatArray = 100.0 / ranks_among(search_distances(shapes, model), shapes.truth)
    return scores


def show_rows(
    scores: Mapping[str, FloatArray], channels: Mapping[str, int], shapes: BankShapes
) -> None:
    """Print the rows of every way, and its mean beside that of the first: a paired bootstrap.

    Parameters
    ----------
    scores : Mapping of str to (q,) float64
        By the way's name.
    channels : Mapping of str to int
        How many it has.
    shapes : BankShapes
        Whose queries were asked with.
    """
    names = list(dict.fromkeys(shapes.transformations))
    row_of = np.array([names.index(name) for name in shapes.transformations])
    counted = np.array([name not in NOT_COUNTED for name in shapes.transformations])
    means = mean_of_rows(
        np.stack([of_way[counted] for of_way in scores.values()]),
        np.unique(row_of[counted], return_inverse=True)[1],
        shapes.truth[counted],
        seed=0,
    )
    table = Table("", "channels", *names, "mean", f"minus {next(iter(scores))}")
    for number, (name, of_way) in enumerate(scores.items()):
        rows = [f"{of_way[row_of == row].mean():.1f}" for row in range(len(names))]
        gap = difference(means, number, 0)
        beside = "" if number == 0 else f"{gap.value:+.1f} ({gap.low:+.1f} to {gap.high:+.1f})"
        table.add_row(name, str(channels[name]), *rows, f"{means.values[number]:.1f}", beside)
    CONSOLE.print(table)
