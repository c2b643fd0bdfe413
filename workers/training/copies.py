"""Descriptors of variants, arranged as shapes and their transformed copies."""

from collections.abc import Sequence

import numpy as np

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import Float32Array
from workers.training.bank_shapes import BankShapes
from workers.training.examples import Variant


def arrange_copies(variants: Sequence[Variant], descriptors: Sequence[Float32Array]) -> BankShapes:
    """Arrange variants as shapes and copies; copies of a shape without a descriptor are left out.

    Parameters
    ----------
    variants : sequence of Variant
        Shapes, and copies of them.
    descriptors : sequence of (d,) float32
        Of each of them, under the same candidates.

    Returns
    -------
    BankShapes
        Shapes and copies in the order of the variants.

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
