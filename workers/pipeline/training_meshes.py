"""Meshes that models are learned from: creatures, and what was uploaded."""

from functools import lru_cache

from workers.creatures import Creature, make_creature, make_uneven_creature
from workers.errors import BlobNotFoundError
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.solve import read_mesh
from workers.pipeline.training_pairs import CreatureSource, StoredSource
from workers.pipeline.workbench import Workbench
from workers.storage.solutions import load_cleaned


@lru_cache(maxsize=2)
def load_creature(source: CreatureSource) -> Creature:
    """Return the individual; the last two are kept."""
    make = make_uneven_creature if source.uneven else make_creature
    return make(source.species, seed=source.seed, vertices=source.vertices)


def load_stored(bench: Workbench, source: StoredSource) -> TriangleMesh:
    """Return the cleaned mesh of what was uploaded.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        It is no mesh that can be used.
    """
    try:
        return load_cleaned(bench.blobs, source.sha256)
    except BlobNotFoundError:
        return read_mesh(
            bench.blobs, source.sha256, filename=source.name, settings=bench.settings
        ).mesh
