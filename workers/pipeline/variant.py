"""A part of a bank's training: one variant of a shape, described under every candidate channel."""

from collections.abc import Callable

from workers.geometry.arrays import Float32Array
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.pipeline.outcome import Outcome
from workers.pipeline.training_meshes import load_creature, load_stored
from workers.pipeline.training_pairs import CreatureSource, Simulation
from workers.pipeline.training_parts import VARIANT, compute_kept
from workers.pipeline.training_variants import Variant
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import describe
from workers.storage.parts import Claim
from workers.transformations import transform

DESCRIPTOR = "descriptor"


def compute_variant(
    bench: Workbench, claim: Claim, *, compute: "DescribeVariant | None" = None
) -> Outcome:
    """Store the descriptor of a variant, unless it is there; one that has none is named."""
    variant = Variant.from_payload(claim.payload)
    compute = compute or describe_variant
    return compute_kept(bench, VARIANT, variant, lambda: {DESCRIPTOR: compute(bench, variant)})


DescribeVariant = Callable[[Workbench, Variant], Float32Array]


def describe_variant(bench: Workbench, variant: Variant) -> Float32Array:
    """Make, clean, solve and describe it; spectra of variants are not kept."""
    mesh = clean(_mesh_of(bench, variant)).mesh
    solutions = {view.name: solve(mesh, view) for view in variant.views}
    return describe(solutions, variant.candidates)


def _mesh_of(bench: Workbench, variant: Variant) -> TriangleMesh:
    """Shape as it is, or transformed, on top of a pose if it is a creature that has one."""
    source, change = variant.source, variant.change
    if isinstance(source, CreatureSource):
        mesh = load_creature(source).rest
    else:
        mesh = load_stored(bench, source)
    if change is None:
        return mesh
    pose = _pose(source, change) if isinstance(source, CreatureSource) else None
    return transform(mesh, change.transformation, change.strength, seed=change.seed, pose=pose).mesh


def _pose(source: CreatureSource, change: Simulation) -> TriangleMesh | None:
    """Pose of a creature; where parts are to be welded, one in which limbs touch."""
    if change.pose is None:
        return None
    creature = load_creature(source)
    if change.transformation == "topology":
        return creature.touching(change.pose)
    return creature.posed(change.pose)
