"""The end of a bank's training: from the descriptors of all variants to a model."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from workers.geometry.arrays import Float32Array
from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import fit_bank_part
from workers.pipeline.training.fit import Material, fit_model
from workers.pipeline.training.fit_windows import fit_windows
from workers.pipeline.training.results import Arrays
from workers.pipeline.workbench import Workbench
from workers.storage.models import Json, TrainedModel
from workers.storage.parts import Claim
from workers.training.bank import BankOptions, train_bank
from workers.training.copies import arrange_copies
from workers.training.examples import VARIANT_VERSIONS, Variant
from workers.training.window_shapes import DESCRIPTOR


def fit_bank(bench: Workbench, claim: Claim) -> Outcome:
    """Choose and weigh channels, and learn windows, once all variants have ended.

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
        Nothing can be learned, see `fit_model` and `train_bank`.
    """
    finale = fit_bank_part(claim.payload["model"])
    return fit_model(bench, claim, Variant, finale, partial(_definition, bench))


def descriptors(arrays: Iterable[Arrays]) -> list[Float32Array]:
    """Return the descriptors of variants.

    Parameters
    ----------
    arrays : iterable of mapping
        What is stored of each variant.

    Returns
    -------
    list of (d,) float32
    """
    return [np.asarray(one[DESCRIPTOR], dtype=np.float32) for one in arrays]


def _definition(bench: Workbench, asked: TrainedModel, material: Material[Variant]) -> Json:
    """Definition of the learned model, with the report of its training."""
    parameters = asked.definition["parameters"]
    own = material.only(lambda variant: variant.windows is None)
    shapes = arrange_copies(own.examples, descriptors(own.arrays))
    trained = train_bank(
        asked.name,
        shapes,
        own.examples[0].candidates,
        BankOptions(power=parameters["power"], channels=parameters["channels"]),
        parameters=parameters,
        versions=VARIANT_VERSIONS,
    )
    with_windows = material.only(lambda variant: variant.windows is not None)
    windows, found = fit_windows(bench, trained, shapes, with_windows)
    report = {
        **asked.definition["training"],
        **trained.report,
        "windows": found,
        **material.failure_report(Variant.kind),
        "versions": dict(trained.model.versions),
    }
    return {**replace(trained.model, windows=windows).to_json(), "training": report}
