"""A part of a bank's training: one variant of a shape, described under every candidate channel."""

import json

import numpy as np

from workers.errors import (
    BlobNotFoundError,
    InvalidMeshError,
    InvalidRequestError,
    KernelDomainError,
    SpectrumError,
)
from workers.geometry.arrays import Float32Array
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.geometry.transformations import transform
from workers.pipeline.training_meshes import load_creature, load_stored
from workers.pipeline.training_pairs import CreatureSource, Simulation
from workers.pipeline.training_variants import Variant
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import describe
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import variant_failure_key, variant_key
from workers.storage.parts import Claim, Failure, finish_part, report_failures

OWN_REASONS = (InvalidMeshError, InvalidRequestError, KernelDomainError, SpectrumError)
"""Why a variant may fail again and again: the training goes on without it."""


def compute_variant(bench: Workbench, claim: Claim) -> None:
    """Store the descriptor of a variant, unless it is there; one that has none is named."""
    variant = Variant.from_payload(claim.payload)
    failures = []
    try:
        if not bench.blobs.exists(variant_key(variant.key)):
            descriptor = _describe(bench, variant)
            bench.blobs.put(variant_key(variant.key), pack({"descriptor": descriptor}))
    except OWN_REASONS as error:
        failure = Failure(variant.item, error.kind, str(error))
        bench.blobs.put(variant_failure_key(variant.key), json.dumps(vars(failure)).encode())
        failures.append(failure)
    with bench.database.begin() as session:
        report_failures(session, claim, failures, are_counted=True)
        parts = finish_part(session, claim)
    bench.send(parts)


def load_variant(bench: Workbench, variant: Variant) -> Float32Array | Failure:
    """Return the descriptor that is stored of a variant, or why there is none.

    Raises
    ------
    BlobNotFoundError
        The variant was not computed.
    """
    try:
        arrays = unpack(bench.blobs.get(variant_key(variant.key)))
    except BlobNotFoundError:
        reason = json.loads(bench.blobs.get(variant_failure_key(variant.key)))
        return Failure(variant.item, reason["type"], reason["detail"])
    descriptor: Float32Array = np.asarray(arrays["descriptor"], dtype=np.float32)
    return descriptor


def _describe(bench: Workbench, variant: Variant) -> Float32Array:
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
