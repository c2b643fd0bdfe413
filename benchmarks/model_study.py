"""The model `proteus` on a benchmark beside other models, and the copies that it misses.

``python -m benchmarks.model_study --benchmark bench`` prints the rows of the shipped model, of the
channels of each of its views alone, and of the model with points of ``--points`` times the weight.
``--other FILE`` adds another ``proteus.json``, such as
``git show REVISION:workers/storage/shipped/proteus.json`` gives. Differences have the 95 per cent
interval of a paired bootstrap over shapes. Then come the copies that do not find their shape first,
with strength and rank, and the roughness of shapes and copies.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.described import CONSOLE, described, scores_of, show_rows
from workers.geometry.arrays import FloatArray
from workers.retrieval.model import Model
from workers.storage.shipped_models import shipped_model
from workers.training.bank_shapes import BankShapes, of_channels
from workers.training.candidates import candidate_model


def of_view(model: Model, view: str) -> Model:
    """Model of the channels of one view alone."""
    channels = tuple(channel for channel in model.channels if channel.view == view)
    return replace(model, channels=channels)


def with_heavier_points(model: Model, factor: float) -> Model:
    """Model whose channels of points weigh so many times as much."""
    channels = tuple(
        replace(channel, weight=factor * channel.weight) if channel.is_reranked else channel
        for channel in model.channels
    )
    return replace(model, channels=channels)


def missed(scores: FloatArray, shapes: BankShapes) -> dict[str, list[str]]:
    """Copies whose own shape does not come first, by their transformation."""
    found: dict[str, list[str]] = {}
    for number, score in enumerate(scores.tolist()):
        if score < 100.0:
            name, strength = shapes.names[shapes.truth[number]], shapes.strengths[number]
            told = f"{name} {strength} at rank {100.0 / score:.0f}"
            found.setdefault(shapes.transformations[number], []).append(told)
    return found


def ranges_of_roughness(shapes: BankShapes, model: Model) -> dict[str, str]:
    """Least and greatest roughness of the references, and of the copies by their transformation."""
    column = model.slices[model.roughness_limits[0].name].start
    of_copies: dict[str, dict[int, list[float]]] = {}
    rough = shapes.queries[:, column].tolist()
    for name, strength, value in zip(shapes.transformations, shapes.strengths, rough, strict=True):
        of_copies.setdefault(name, {}).setdefault(strength, []).append(value)
    told = {"as they are": _range(shapes.references[:, column].tolist())}
    for name, by_strength in of_copies.items():
        told[name] = ", ".join(_range(by_strength[strength]) for strength in sorted(by_strength))
    return told


def _range(values: Sequence[float]) -> str:
    return f"{min(values):.2f} to {max(values):.2f}"


def main() -> None:
    """Describe, measure each model, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benchmark", type=Path, required=True)
    parser.add_argument("--solutions", type=Path, help="data directory with spectra")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--points", type=float, action="append", default=[], help="again for more")
    parser.add_argument("--other", type=Path, action="append", default=[], help="again for more")
    asked = parser.parse_args()
    shipped = shipped_model()
    models = {"proteus": shipped}
    models |= {f"{view.name} alone": of_view(shipped, view.name) for view in shipped.views}
    models |= {f"points x {by:g}": with_heavier_points(shipped, by) for by in asked.points}
    models |= {str(path): Model.from_json(json.loads(path.read_text())) for path in asked.other}
    found = {}
    for name, model in models.items():
        candidates = candidate_model(model.views, power=model.fusion_power)
        every = described(asked.benchmark, candidates, asked.processes, asked.solutions)
        shapes = of_channels(every, candidates, model)
        found[name] = scores_of(model, shapes)
        if model is shipped:
            own = shapes
    show_rows(found, {name: len(model.channels) for name, model in models.items()}, own)
    for transformation, copies in missed(found["proteus"], own).items():
        CONSOLE.print(f"{transformation}: {', '.join(copies)}", soft_wrap=True)
    CONSOLE.print("roughness, by strength:")
    for name, told in ranges_of_roughness(own, shipped).items():
        CONSOLE.print(f"{name}: {told}", soft_wrap=True)


if __name__ == "__main__":
    main()
