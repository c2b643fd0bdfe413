"""The verb of a variant: a shape or a copy of it, described under every candidate channel.

Where windows are learned from it, these are taken as well.
"""

from collections.abc import Callable
from typing import TypeAlias

from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import TRANSFORMING
from workers.pipeline.training.meshes import load_cleaned_mesh
from workers.pipeline.training.results import Arrays, store_result
from workers.pipeline.workbench import Workbench
from workers.storage.parts import Claim
from workers.training.examples import Variant
from workers.training.sources import CreatureSource, Posing, load_creature, simulate
from workers.training.window_pairs import paired_points
from workers.training.window_shapes import described_mesh

DescribeVariant: TypeAlias = Callable[[Workbench, Variant], Arrays]


def describe_variant(bench: Workbench, variant: Variant) -> Arrays:
    """Make, clean, solve and describe a variant; its spectra are not stored.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    variant : Variant
        A shape and how it is transformed.

    Returns
    -------
    mapping of str to array
        Descriptor under all candidate channels; windows and pairs of points, if it is to have them.

    Raises
    ------
    ProteusError
        Its mesh cannot be read, transformed, solved or described.
    """
    source, change, view = variant.source, variant.change, variant.windows
    if isinstance(source, CreatureSource):
        shape = load_creature(source).rest
    else:
        shape = load_cleaned_mesh(bench, source)
    mesh = shape if change is None else simulate(shape, source, change, posing=Posing.FULL).mesh
    found = described_mesh(mesh, variant.candidates, windows=view, is_copy=change is not None)
    if view is None or not variant.paired:
        return found
    return {**found, **paired_points(source, shape, view).to_arrays()}


def compute_variant(
    bench: Workbench, claim: Claim, *, compute: DescribeVariant = describe_variant
) -> Outcome:
    """Store what is computed of a variant, unless it is there already.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload is the variant.
    compute : callable
        Computes what is stored.

    Returns
    -------
    Outcome
        Names the variant if it has none.

    Raises
    ------
    ProteusError
        It fails for a reason that is not its own.
    """
    variant = Variant.from_payload(claim.payload)
    bench.progress.enter(TRANSFORMING)
    return store_result(bench.blobs, variant, lambda: compute(bench, variant))
