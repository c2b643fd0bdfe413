"""The effect of each part of the model `proteus`: banks trained without it, on the same shapes.

``python -m benchmarks.bank_study --training proteus-training --benchmark bench`` reads what
``make train-default`` and ``proteus benchmark build`` stored. For each way of training it prints
the rows on the benchmark. Beside their mean stands the difference from the full bank, with the 95
per cent interval of a paired bootstrap over shapes. Descriptors are kept in the benchmark's folder.
With ``--solutions DIR``, the data directory of a service, spectra that it has are not computed
again.
"""

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.progress import track
from sqlalchemy import select

from benchmarks.described import PROGRESS, described, scores_of, show_rows
from workers.pipeline.training.fit import gather
from workers.pipeline.training.fit_bank import descriptors
from workers.retrieval.channels import (
    Channel,
    EigenvalueChannel,
    KernelChannel,
    LogDiagonalChannel,
)
from workers.retrieval.channels.base import NO_CENTRE
from workers.retrieval.model import Model
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Part
from workers.training.bank import BankOptions, BankShapes, train_bank
from workers.training.bank_shapes import of_channels
from workers.training.candidates import is_resolved
from workers.training.copies import arrange_copies
from workers.training.examples import Variant

BASE = "all together"
FEW_EIGENPAIRS = 100  # of the views but "detailed"

Way = Callable[[BankShapes, Model], tuple[BankShapes, Model, BankOptions]]
"""From all there is to what a bank is trained with."""


def trained_on(folder: Path) -> tuple[BankShapes, Model]:
    """Descriptors that ``make train-default`` stored, and the candidates they are under."""
    settings = Settings(data_dir=folder)
    database = Database(settings.resolved_database_url)
    with database.read() as session:
        newest = (
            select(Part.job_id)
            .where(Part.kind == Variant.kind)
            .order_by(Part.job_id.desc())
            .limit(1)
        )
        payloads = session.scalars(
            select(Part.payload).where(
                Part.kind == Variant.kind, Part.job_id == newest.scalar_subquery()
            )
        ).all()
    database.dispose()
    variants = [one for one in map(Variant.from_payload, payloads) if one.windows is None]
    planned = sorted(variants, key=lambda variant: variant.number)
    material = gather(BlobStore(settings.resolved_blob_url), planned)
    if material.missing:
        raise SystemExit(f"{len(material.missing)} of {len(planned)} variants are not computed")
    shapes = arrange_copies(material.examples, descriptors(material.arrays))
    return shapes, planned[0].candidates


def only(
    keep: Callable[[Channel], bool], options: BankOptions | None = None, *, roughness: bool = True
) -> Way:
    """Train with some of the candidates, and with or without limits of roughness."""

    def restrict(shapes: BankShapes, all_of_them: Model) -> tuple[BankShapes, Model, BankOptions]:
        fewer = replace(
            all_of_them,
            channels=tuple(channel for channel in all_of_them.channels if keep(channel)),
            roughness_limits=all_of_them.roughness_limits if roughness else (),
        )
        return of_channels(shapes, all_of_them, fewer), fewer, options or BankOptions()

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
    "without points": only(lambda channel: not channel.is_reranked),
    "without roughness": only(lambda channel: True, roughness=False),
    "without finer kernels": only(lambda channel: is_resolved(channel, FEW_EIGENPAIRS)),
    "view detailed alone": _of_view("detailed"),
    "view smooth alone": _of_view("smooth"),
    "without eigenvalues": only(lambda channel: not isinstance(channel, EigenvalueChannel)),
    "quantiles alone, uncentred": only(
        lambda channel: not isinstance(channel, LogDiagonalChannel) or channel.centre == NO_CENTRE
    ),
    "heat kernels alone": only(
        lambda channel: isinstance(channel, KernelChannel) and channel.kernel.kind == "heat"
    ),
    "at most 8 channels": only(lambda channel: True, BankOptions(channels=8)),
    "at most 40 channels": only(lambda channel: True, BankOptions(channels=40)),
    "at most 16 channels": only(lambda channel: True, BankOptions(channels=16)),
    "power 1/2": only(lambda channel: True, BankOptions(power=0.5)),
    "power 1": only(lambda channel: True, BankOptions(power=1.0)),
    "half of the shapes": half_of_the_shapes,
}


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
    for name in track(list(ways), "training", console=PROGRESS):
        fewer, chosen_from, bank = WAYS[name](shapes, candidates)
        trained = train_bank("study", fewer, chosen_from, bank, parameters={}, versions={})
        found[name] = scores_of(trained.model, of_channels(benchmark, candidates, trained.model))
        channels[name] = len(trained.model.channels)
    show_rows(found, channels, benchmark)
    if options.out is not None:
        told = {name: scores.tolist() for name, scores in found.items()}
        options.out.write_text(json.dumps(told) + "\n")


if __name__ == "__main__":
    main()
