"""The end of a training: from the moments of all pairs to a model."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from workers.diffusion.learning import learn_kernel
from workers.diffusion.learning_options import LearningOptions
from workers.errors import BlobNotFoundError, InsufficientTrainingDataError
from workers.pipeline.pair import Learnt, load_pair
from workers.pipeline.plans import fit_part
from workers.pipeline.training_pairs import VERSIONS, Pair
from workers.pipeline.training_parts import compute_again, ended_payloads, finite_json
from workers.pipeline.workbench import Workbench
from workers.retrieval.learned import calibrated, learned_model
from workers.retrieval.model import Model
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim, Failure, finish_part, hold_lease
from workers.storage.solutions import load_solution
from workers.storage.trained_models import READY, get_training


@dataclass(frozen=True, eq=False)
class Material:
    """What there is to learn from, in the order of the plan.

    Attributes
    ----------
    pairs : sequence of Pair
        Those that have moments.
    learnt : sequence of Learnt
        Of each of them.
    failures : sequence of Failure
        Of the others.
    missing : frozenset of int
        Numbers of pairs of which nothing is stored.
    """

    pairs: Sequence[Pair]
    learnt: Sequence[Learnt]
    failures: Sequence[Failure]
    missing: frozenset[int]


def fit(bench: Workbench, claim: Claim) -> None:
    """Learn a model's kernel once all pairs have ended; the model is then ready.

    After a retry this may be called while pairs are still computed, or what is stored of some may
    be of an older version: then these are computed first, and it comes again.

    Raises
    ------
    ModelNotReadyError
        Pairs were lost, so that a retry would give another model than this.
    InsufficientTrainingDataError
        Too few pairs have moments.
    ModelNotFoundError
        The model was deleted.
    """
    name = claim.payload["model"]
    payloads = ended_payloads(bench, claim, "pair", fit_part(name))
    if payloads is None:
        return
    pairs = [Pair.from_payload(payload) for payload in payloads]
    with bench.database.read() as session:
        asked = get_training(session, name, job_id=claim.job_id)
    material = _load(bench, pairs)
    if material.missing:
        compute_again(bench, claim, "pair", material.missing, fit_part(name))
        return
    definition = _definition(bench, asked, material)
    with bench.database.begin() as session:
        hold_lease(session, claim)
        row = get_training(session, name, job_id=claim.job_id)
        row.definition, row.state = definition, READY
        parts = finish_part(session, claim)
    bench.send(parts)


def _load(bench: Workbench, planned: Sequence[Pair]) -> Material:
    """Read what is stored of each pair."""
    pairs: list[Pair] = []
    learnt: list[Learnt] = []
    failures: list[Failure] = []
    missing: set[int] = set()
    for pair in planned:
        try:
            found = load_pair(bench, pair)
        except BlobNotFoundError:
            missing.add(pair.number)
            continue
        if isinstance(found, Failure):
            failures.append(found)
        else:
            pairs.append(pair)
            learnt.append(found)
    return Material(pairs, learnt, failures, frozenset(missing))


def _definition(bench: Workbench, asked: TrainedModel, material: Material) -> Json:
    """Definition of the learned model, with the report of its training."""
    parameters = asked.definition["parameters"]
    if not material.pairs:
        first = material.failures[0]
        raise InsufficientTrainingDataError(
            f"all {len(material.failures)} pairs failed; the first, {first.item}: {first.detail}"
        )
    options = LearningOptions.from_json(
        asked.method, {key: value for key, value in parameters.items() if key != "view"}
    )
    learned = learn_kernel(
        [found.moments for found in material.learnt],
        [pair.label for pair in material.pairs],
        options,
    )
    (view, *_) = {pair.view for pair in material.pairs}
    model = learned_model(asked.name, learned, parameters=parameters, view=view, versions=VERSIONS)
    model = _calibrated(bench, model, material)
    definition = {
        **model.to_json(),
        "training": {**asked.definition["training"], **learned.report, **_figures(material, model)},
    }
    return finite_json(definition)


def _calibrated(bench: Workbench, model: Model, material: Material) -> Model:
    """Measure how far the shapes of different classes are apart under the model."""
    (view,) = model.views
    labels = {
        found.sha256: pair.label
        for found, pair in zip(material.learnt, material.pairs, strict=True)
    }
    solutions = [load_solution(bench.blobs, sha256, view) for sha256 in labels]
    return calibrated(model, solutions, list(labels.values()))


def _figures(material: Material, model: Model) -> Json:
    """What the report says of shapes, pairs and versions."""
    shapes = {
        found.sha256: pair.label
        for found, pair in zip(material.learnt, material.pairs, strict=True)
    }
    return {
        "shape_counts": dict(sorted(Counter(shapes.values()).items())),
        "n_failed_pairs": len(material.failures),
        "failed_pairs": [dict(vars(failure)) for failure in material.failures],
        "versions": dict(model.versions),
    }
