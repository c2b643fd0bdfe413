"""The verb of a variant: a shape or a copy of it, described under every candidate channel."""

from collections.abc import Callable
from typing import TypeAlias

from workers.geometry.arrays import Float32Array
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import TRANSFORMING
from workers.pipeline.training.meshes import load_cleaned_mesh
from workers.pipeline.training.results import store_result
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import describe
from workers.storage.parts import Claim
from workers.training.examples import Variant
from workers.training.sources import CreatureSource, Posing, load_creature, simulate

DESCRIPTOR = "descriptor"
"""Name of the array that is stored of a variant."""

DescribeVariant: TypeAlias = Callable[[Workbench, Variant], Float32Array]


def describe_variant(bench: Workbench, variant: Variant) -> Float32Array:
    """Make, clean, solve and describe a variant; its spectra are not stored.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    variant : Variant
        A shape and how it is transformed.

    Returns
    -------
    (d,) float32
        Descriptor under all candidate channels.

    Raises
    ------
    ProteusError
        Its mesh cannot be read, transformed, solved or described.
    """
    solver = Solver(clean(_mesh_of(bench, variant)).mesh)
    solutions = {view.name: solver.under(view) for view in variant.views}
    return describe(solutions, variant.candidates)


def compute_variant(
    bench: Workbench, claim: Claim, *, compute: DescribeVariant = describe_variant
) -> Outcome:
    """Store the descriptor of a variant, unless it is there already.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload is the variant.
    compute : callable
        Computes the descriptor.

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
    return store_result(bench.blobs, variant, lambda: {DESCRIPTOR: compute(bench, variant)})


def _mesh_of(bench: Workbench, variant: Variant) -> TriangleMesh:
    """Shape as it is, or transformed."""
    source, change = variant.source, variant.change
    if isinstance(source, CreatureSource):
        mesh = load_creature(source).rest
    else:
        mesh = load_cleaned_mesh(bench, source)
    if change is None:
        return mesh
    return simulate(mesh, source, change, posing=Posing.FULL).mesh
