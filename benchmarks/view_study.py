"""Ways of preparing, solving and describing shapes, compared before anything is learned.

``python -m benchmarks.view_study --benchmark bench`` describes a benchmark under all candidate
channels of several views. For each set of views it prints the rows with even weights. Beside their
mean stands the difference from the shipped views, with the 95 per cent interval of a paired
bootstrap over shapes. Scales come from the benchmark's own copies, and the points weigh as much as
twenty other channels. So the means compare sets with each other, not with a trained bank. With
``--shipped`` the shipped model, weights and all, uses two views in place of its own: a hint at what
a new training may give. Descriptors are kept in the benchmark's folder.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.described import described, scores_of, show_rows
from workers.geometry.arrays import Float32Array
from workers.geometry.views import Step, View, named_view
from workers.retrieval.channels import AreaChannel, LogDiagonalChannel, Quantiles
from workers.retrieval.model import Model
from workers.storage.shipped_models import shipped_model
from workers.training.bank import POWER
from workers.training.bank_shapes import (
    BankShapes,
    dissimilarities,
    of_channels,
    typical_scales,
)
from workers.training.candidates import QUANTILE_LEVELS, candidate_model

WEIGHT_OF_POINTS = 20.0


def _changed(view: View, name: str, step: str, *instead: Step) -> View:
    """View with other steps, or none, in the place of the one of this name."""
    steps = [taken for each in view.steps for taken in (instead if each.name == step else (each,))]
    return View(name, tuple(steps), view.eigenpairs)


CLOSED, SMOOTH = named_view("closed"), named_view("smooth")
FAIRED_LITTLE = (Step("fair", {"time": 1e-4}), Step("simplify", {"vertices": 5000}))
VIEWS: Mapping[str, View] = {
    view.name: view
    for view in (
        CLOSED,
        SMOOTH,
        named_view("open"),
        named_view("smooth-open"),
        replace(named_view("closed", working_vertices=2500), name="closed of 2,500"),
        named_view("detailed"),
        _changed(CLOSED, "closed, not doubled", "double"),
        _changed(CLOSED, "closed, faired", "simplify", *FAIRED_LITTLE),
        _changed(SMOOTH, "smooth, not faired", "fair"),
        _changed(SMOOTH, "smooth, faired alone", "smooth"),
        _changed(SMOOTH, "smoother", "smooth", Step("smooth", {"time": 1e-3, "steps": 3})),
    )
}
SHIPPED = "detailed + smooth"
SETS: Mapping[str, tuple[str, ...]] = {
    " + ".join(views): views
    for views in (
        ("closed", "smooth"),
        ("closed",),
        ("smooth",),
        ("closed", "smooth, not faired"),
        ("closed", "smooth, faired alone"),
        ("closed", "smoother"),
        ("closed", "smooth", "smooth, not faired"),
        ("closed, faired", "smooth"),
        ("closed of 2,500", "smooth"),
        ("detailed", "smooth"),
        ("closed, not doubled", "smooth"),
        ("open", "smooth-open"),
        ("open", "closed", "smooth-open", "smooth"),
    )
}
SLOPES = "detailed + smooth, slopes of quantiles too"


def without_area(views: Sequence[View]) -> Model:
    """Candidates under these views, but for the one that sees scale."""
    candidates = candidate_model(views, power=POWER)
    kept = tuple(channel for channel in candidates.channels if not isinstance(channel, AreaChannel))
    return replace(candidates, channels=kept)


def even(shapes: BankShapes, candidates: Model) -> Model:
    """Model of all candidates that tell anything, with even weights."""
    scales = typical_scales(shapes, dissimilarities(shapes, candidates))
    channels = tuple(
        replace(
            channel, scale=float(scale), weight=WEIGHT_OF_POINTS if channel.is_reranked else 1.0
        )
        for channel, scale in zip(candidates.channels, scales, strict=True)
        if scale > 0.0
    )
    return replace(candidates, channels=channels)


def with_slopes(shapes: BankShapes, candidates: Model) -> tuple[BankShapes, Model]:
    """Shapes under one more channel for each of ln k(x,x): the slopes of its quantiles."""
    signatures = [one for one in candidates.channels if isinstance(one, LogDiagonalChannel)]
    slopes = [
        replace(channel, name=f"{channel.name}, slopes", summary=Quantiles(QUANTILE_LEVELS[1:]))
        for channel in signatures
    ]
    steps = np.diff(QUANTILE_LEVELS)
    end = sum(channel.dimension for channel in candidates.channels)  # roughness stands behind

    def longer(rows: Float32Array) -> Float32Array:
        added = [
            np.diff(rows[:, candidates.slices[channel.name]], axis=1) / steps
            for channel in signatures
        ]
        return np.concatenate([rows[:, :end], *added, rows[:, end:]], axis=1, dtype=np.float32)

    more = replace(shapes, references=longer(shapes.references), queries=longer(shapes.queries))
    return more, replace(candidates, channels=(*candidates.channels, *slopes))


def shipped_with(views: Sequence[View]) -> Model:
    """The shipped model with other views in the place of its two, in their order."""
    model = shipped_model()
    instead = dict(zip((view.name for view in model.views), views, strict=True))
    channels = tuple(
        replace(
            channel,
            view=instead[channel.view].name,
            name=channel.name.replace(channel.view, instead[channel.view].name, 1),
        )
        for channel in model.channels
    )
    limits = tuple(replace(one, view=instead[one.view].name) for one in model.roughness_limits)
    return replace(model, views=tuple(views), channels=channels, roughness_limits=limits)


def main() -> None:
    """Describe, measure each set of views, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benchmark", type=Path, required=True)
    parser.add_argument("--solutions", type=Path, help="data directory with spectra")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--set", action="append", choices=[*SETS, SLOPES], help="again for more")
    parser.add_argument("--shipped", action="store_true", help="with the shipped weights")
    options = parser.parse_args()
    known = [name for name in SETS if len(SETS[name]) == 2] if options.shipped else [*SETS, SLOPES]
    found, channels = {}, {}
    for name in dict.fromkeys([SHIPPED, *(options.set or known)]):
        views = [VIEWS[view] for view in SETS.get(name, SETS[SHIPPED])]
        candidates = shipped_with(views) if options.shipped else without_area(views)
        shapes = described(options.benchmark, candidates, options.processes, options.solutions)
        if name == SLOPES:
            shapes, candidates = with_slopes(shapes, candidates)
        model = candidates if options.shipped else even(shapes, candidates)
        found[name] = scores_of(model, of_channels(shapes, candidates, model))
        channels[name] = len(model.channels)
    show_rows(found, channels, shapes)


if __name__ == "__main__":
    main()
