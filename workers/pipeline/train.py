"""The end of a training: from the moments of all pairs to a model."""

from collections import Counter
from collections.abc import Sequence

from workers.pipeline.outcome import Outcome
from workers.pipeline.pair import Learnt, learnt_from
from workers.pipeline.plans import fit_part
from workers.pipeline.training_pairs import VERSIONS, Pair
from workers.pipeline.training_parts import PAIR, Material, fit_model
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim
from workers.storage.solutions import load_solution
from workers.training.learned import calibrated, learned_model
from workers.training.learning import learn_kernel
from workers.training.learning_options import LearningOptions


def fit(bench: Workbench, claim: Claim) -> Outcome:
    """Learn a model's kernel once all pairs have ended, see `fit_model`."""

    def define(asked: TrainedModel, material: Material[Pair]) -> Json:
        return _definition(bench, asked, material)

    finale = fit_part(claim.payload["model"])
    return fit_model(bench, claim, PAIR, Pair.from_payload, finale, define)


def _definition(bench: Workbench, asked: TrainedModel, material: Material[Pair]) -> Json:
    """Definition of the learned model, with the report of its training."""
    parameters = asked.definition["parameters"]
    options = LearningOptions.from_json(
        asked.method, {key: value for key, value in parameters.items() if key != "view"}
    )
    learnt = [learnt_from(arrays) for arrays in material.arrays]
    labels = [pair.label for pair in material.planned]
    learned = learn_kernel([found.moments for found in learnt], labels, options)
    (view, *_) = {pair.view for pair in material.planned}
    model = learned_model(asked.name, learned, parameters=parameters, view=view, versions=VERSIONS)
    shapes = _shapes(learnt, labels)
    model = _calibrated(bench, model, shapes)
    report = {
        **asked.definition["training"],
        **learned.report,
        "shape_counts": dict(sorted(Counter(shapes.values()).items())),
        **material.failures_told(PAIR),
        "versions": dict(model.versions),
    }
    return {**model.to_json(), "training": report}


def _shapes(learnt: Sequence[Learnt], labels: Sequence[str]) -> dict[str, str]:
    """Label of each shape, by the content it was solved under."""
    return {found.sha256: label for found, label in zip(learnt, labels, strict=True)}


def _calibrated(bench: Workbench, model: Model, shapes: dict[str, str]) -> Model:
    """Measure how far the shapes of different classes are apart under the model."""
    (view,) = model.views
    solutions = [load_solution(bench.blobs, sha256, view) for sha256 in shapes]
    return calibrated(model, solutions, list(shapes.values()))
