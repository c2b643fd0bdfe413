"""The end of a bank's training: from the descriptors of all variants to a model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.errors import BlobNotFoundError, InsufficientTrainingDataError
from workers.geometry.arrays import Float32Array
from workers.pipeline.plans import fit_bank_part
from workers.pipeline.training_parts import compute_again, ended_payloads, finite_json
from workers.pipeline.training_variants import VARIANT_VERSIONS, Variant
from workers.pipeline.variant import load_variant
from workers.pipeline.workbench import Workbench
from workers.retrieval.bank import BankOptions, train_bank
from workers.retrieval.bank_shapes import BankShapes
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim, Failure, finish_part, hold_lease
from workers.storage.trained_models import READY, get_training


@dataclass(frozen=True, eq=False)
class Material:
    """What there is to learn from, in the order of the plan.

    Attributes
    ----------
    variants : sequence of Variant
        Those that have a descriptor.
    descriptors : sequence of (d,) float32
        Of each of them, under all candidates.
    failures : sequence of Failure
        Of the others.
    missing : frozenset of int
        Numbers of variants of which nothing is stored.
    """

    variants: Sequence[Variant]
    descriptors: Sequence[Float32Array]
    failures: Sequence[Failure]
    missing: frozenset[int]


def fit_bank(bench: Workbench, claim: Claim) -> None:
    """Choose and weigh channels once all variants have ended; the model is then ready.

    After a retry this may be called while variants are still computed, or what is stored of some
    may be of an older version: then these are computed first, and it comes again.

    Raises
    ------
    ModelNotReadyError
        Variants were lost, so that a retry would give another model than this.
    InsufficientTrainingDataError
        Too few shapes have a descriptor, or they are all the same.
    ModelNotFoundError
        The model was deleted.
    """
    name = claim.payload["model"]
    payloads = ended_payloads(bench, claim, "variant", fit_bank_part(name))
    if payloads is None:
        return
    with bench.database.read() as session:
        asked = get_training(session, name, job_id=claim.job_id)
    material = _load(bench, [Variant.from_payload(payload) for payload in payloads])
    if material.missing:
        compute_again(bench, claim, "variant", material.missing, fit_bank_part(name))
        return
    definition = _definition(asked, material)
    with bench.database.begin() as session:
        hold_lease(session, claim)
        row = get_training(session, name, job_id=claim.job_id)
        row.definition, row.state = definition, READY
        parts = finish_part(session, claim)
    bench.send(parts)


def _load(bench: Workbench, planned: Sequence[Variant]) -> Material:
    """Read what is stored of each variant."""
    variants: list[Variant] = []
    descriptors: list[Float32Array] = []
    failures: list[Failure] = []
    missing: set[int] = set()
    for variant in planned:
        try:
            found = load_variant(bench, variant)
        except BlobNotFoundError:
            missing.add(variant.number)
            continue
        if isinstance(found, Failure):
            failures.append(found)
        else:
            variants.append(variant)
            descriptors.append(found)
    return Material(variants, descriptors, failures, frozenset(missing))


def _definition(asked: TrainedModel, material: Material) -> Json:
    """Definition of the learned model, with the report of its training."""
    if not material.variants:
        first = material.failures[0]
        raise InsufficientTrainingDataError(
            f"all {len(material.failures)} variants failed; the first, {first.item}: {first.detail}"
        )
    parameters = asked.definition["parameters"]
    trained = train_bank(
        asked.name,
        bank_shapes(material.variants, material.descriptors),
        material.variants[0].candidates,
        BankOptions(power=parameters["power"], channels=parameters["channels"]),
        parameters=parameters,
        versions=VARIANT_VERSIONS,
    )
    failures = [dict(vars(failure)) for failure in material.failures]
    definition = {
        **trained.model.to_json(),
        "training": {
            **asked.definition["training"],
            **trained.report,
            "n_failed_variants": len(failures),
            "failed_variants": failures,
            "versions": dict(trained.model.versions),
        },
    }
    return finite_json(definition)


def bank_shapes(variants: Sequence[Variant], descriptors: Sequence[Float32Array]) -> BankShapes:
    """Arrange variants as shapes and copies; copies of a shape that has no descriptor are left out.

    Parameters
    ----------
    variants : sequence of Variant
    descriptors : sequence of (d,) float32
        Of each of them, under the same candidates.

    Raises
    ------
    InsufficientTrainingDataError
        No copy is left whose shape has a descriptor too.
    """
    rows = [i for i, variant in enumerate(variants) if variant.change is None]
    places = {variants[row].number: place for place, row in enumerate(rows)}
    copies = [
        (descriptor, places[variant.reference], variant.change)
        for variant, descriptor in zip(variants, descriptors, strict=True)
        if variant.change is not None and variant.reference in places
    ]
    if not copies:
        raise InsufficientTrainingDataError(
            f"none of {len(variants)} descriptors is of a transformed copy of a shape that has one "
            "itself"
        )
    references = [variants[row] for row in rows]
    return BankShapes(
        references=np.stack([descriptors[row] for row in rows]),
        groups=tuple(reference.group for reference in references),
        names=tuple(reference.item for reference in references),
        lenient=tuple(reference.lenient for reference in references),
        queries=np.stack([descriptor for descriptor, _, _ in copies]),
        truth=np.array([truth for _, truth, _ in copies]),
        transformations=tuple(change.transformation for _, _, change in copies),
        strengths=tuple(change.strength for _, _, change in copies),
    )
