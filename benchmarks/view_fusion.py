"""Whether a view that failed should count for less: ``python -m benchmarks.view_fusion``.

A view's part S of the distance counts as m (S/m)^q, with m its median between copies and their own
shapes. With q below 1, a view that noise or holes have ruined cannot outvote the other. Prints the
rows of ``proteus`` on a benchmark for several q; 1 is as shipped.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.described import described, show_rows
from workers.geometry.arrays import FloatArray
from workers.geometry.views import named_view
from workers.retrieval.model import Model
from workers.retrieval.query_weights import weighted_for
from workers.retrieval.scan import distances, rerank
from workers.storage.shipped_models import shipped_model
from workers.training.bank import POWER
from workers.training.bank_shapes import BankShapes, of_channels
from workers.training.candidates import candidate_model

POWERS = (1.0, 0.7, 0.5, 0.35, 0.25)


def parts_of_views(model: Model, shapes: BankShapes) -> FloatArray:
    """What each view adds to the distance from every query to every reference, (v, q, g)."""
    found = np.empty((len(model.views), len(shapes.queries), len(shapes.references)))
    for number, view in enumerate(model.views):
        names = [channel.name for channel in model.scanned if channel.view == view.name]
        for query, row in enumerate(shapes.queries):
            weighted = weighted_for(row, model)
            channels = tuple(channel for channel in weighted.scanned if channel.name in names)
            own = replace(model, views=(view,), channels=channels, roughness_limits=())
            if query == 0:
                seen = of_channels(shapes, model, own)
            found[number, query] = distances(seen.queries[query], seen.references, own)
    return found


def scores_at(power: float, parts: FloatArray, model: Model, shapes: BankShapes) -> FloatArray:
    """Average precision of each query, (q,), in per cent."""
    own = parts[:, np.arange(len(shapes.truth)), shapes.truth]  # (v, q)
    middle = np.median(own, axis=1)[:, None, None]  # (v, 1, 1)
    fused = (middle * (parts / middle) ** power).sum(axis=0)  # (q, g)
    scores = np.empty(len(fused))
    for number, (query, scanned) in enumerate(zip(shapes.queries, fused, strict=True)):
        found = rerank(query, lambda places: shapes.references[places], scanned, model)
        scores[number] = 100.0 / np.count_nonzero(found <= found[shapes.truth[number]])
    return scores


def main() -> None:
    """Describe, measure at each power, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benchmark", type=Path, required=True)
    parser.add_argument("--solutions", type=Path, help="data directory with spectra")
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    model = shipped_model()
    candidates = candidate_model([named_view(view.name) for view in model.views], power=POWER)
    every = described(asked.benchmark, candidates, asked.processes, asked.solutions)
    shapes = of_channels(every, candidates, model)
    parts = parts_of_views(model, shapes)
    found = {f"q = {power:g}": scores_at(power, parts, model, shapes) for power in POWERS}
    show_rows(found, dict.fromkeys(found, len(model.channels)), shapes)


if __name__ == "__main__":
    main()
