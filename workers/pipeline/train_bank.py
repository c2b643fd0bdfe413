"""The end of a bank's training: from the descriptors of all variants to a model."""

from collections.abc import Sequence

import numpy as np

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import Float32Array
from workers.pipeline.outcome import Outcome
from workers.pipeline.plans import fit_bank_part
from workers.pipeline.training_parts import VARIANT, Arrays, Material, fit_model
from workers.pipeline.training_variants import VARIANT_VERSIONS, Variant
from workers.pipeline.variant import DESCRIPTOR
from workers.pipeline.workbench import Workbench
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim
from workers.training.bank import BankOptions, train_bank
from workers.training.bank_shapes import BankShapes


def fit_bank(bench: Workbench, claim: Claim) -> Outcome:
    """Choose and weigh channels once all variants have ended, see `fit_model`."""
    finale = fit_bank_part(claim.payload["model"])
    return fit_model(bench, claim, VARIANT, Variant.from_payload, finale, _definition)


def _definition(asked: TrainedModel, material: Material[Variant]) -> Json:
    """Definition of the learned model, with the report of its training."""
    parameters = asked.definition["parameters"]
    trained = train_bank(
        asked.name,
        bank_shapes(material.planned, descriptors(material.arrays)),
        material.planned[0].candidates,
        BankOptions(power=parameters["power"], channels=parameters["channels"]),
        parameters=parameters,
        versions=VARIANT_VERSIONS,
    )
    report = {
        **asked.definition["training"],
        **trained.report,
        **material.failures_told(VARIANT),
        "versions": dict(trained.model.versions),
    }
    return {**trained.model.to_json(), "training": report}


def descriptors(arrays: Sequence[Arrays]) -> list[Float32Array]:
    """Descriptors of variants, as they are stored."""
    return [np.asarray(one[DESCRIPTOR], dtype=np.float32) for one in arrays]


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
