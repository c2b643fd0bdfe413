"""The end of a kernel's training: from the moments of all pairs to a model."""

from collections import Counter
from functools import partial

from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import fit_part
from workers.pipeline.training.fit import Material, fit_model
from workers.pipeline.training.pair import MeasuredPair
from workers.pipeline.workbench import Workbench
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim
from workers.storage.solutions import load_solution
from workers.training.examples import PAIR_VERSIONS, Pair
from workers.training.learned import calibrated, learned_model
from workers.training.learning import learn_kernel
from workers.training.learning_options import LearningOptions


def fit_kernel(bench: Workbench, claim: Claim) -> Outcome:
    """Learn a model's kernel once all pairs have ended.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the model.

    Returns
    -------
    Outcome
        See `fit_model`.

    Raises
    ------
    ProteusError
        Nothing can be learned, see `fit_model` and `learn_kernel`.
    """
    finale = fit_part(claim.payload["model"])
    return fit_model(bench, claim, Pair, finale, partial(_definition, bench))


def _definition(bench: Workbench, asked: TrainedModel, material: Material[Pair]) -> Json:
    """Definition of the learned model, with the report of its training."""
    parameters = asked.definition["parameters"]
    options = LearningOptions.from_json(
        asked.method, {key: value for key, value in parameters.items() if key != "view"}
    )
    measured = [MeasuredPair.from_arrays(arrays) for arrays in material.arrays]
    labels = [pair.label for pair in material.examples]
    learned = learn_kernel([pair.moments for pair in measured], labels, options)
    view = material.examples[0].view  # that of all pairs
    model = learned_model(
        asked.name, learned, parameters=parameters, view=view, versions=PAIR_VERSIONS
    )
    shapes = {pair.sha256: label for pair, label in zip(measured, labels, strict=True)}
    solutions = [load_solution(bench.blobs, sha256, view) for sha256 in shapes]
    model = calibrated(model, solutions, list(shapes.values()))
    report = {
        **asked.definition["training"],
        **learned.report,
        "shape_counts": dict(sorted(Counter(shapes.values()).items())),
        **material.failure_report(Pair.kind),
        "versions": dict(model.versions),
    }
    return {**model.to_json(), "training": report}
