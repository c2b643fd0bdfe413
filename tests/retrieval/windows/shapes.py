"""Signatures of small shapes, and a whitening that only scales."""

from functools import lru_cache

import numpy as np

from tests.meshes import bumpy_sphere
from workers.geometry.mesh import TriangleMesh
from workers.retrieval.windows.signature import (
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.retrieval.windows.trust import Trust
from workers.retrieval.windows.whitening import Whitening

PLAIN = Whitening(np.tile(20.0 * np.eye(7), (7, 1, 1)), np.tile(20.0 * np.eye(4), (7, 1, 1)))
"""Numbers of corresponding windows differ by about a twentieth."""

EVEN = Trust((3.0, 0, 0, 0), (3.0, 0, 0, 0), (0.5, 0, 0, 0), (0.0, 0.0), 1.4, 1.3)
"""All evidence counts, whatever the query is."""


def stored(mesh: TriangleMesh) -> Signature:
    """Signature of a working mesh that is searched for."""
    return stored_signature(window_surface(mesh, n_vertices=mesh.n_vertices, for_query=False))


def asked(mesh: TriangleMesh) -> Signature:
    """Signature of a working mesh that is searched with, as it is stored."""
    taken = query_signature(window_surface(mesh, n_vertices=mesh.n_vertices, for_query=True))
    return Signature.from_arrays(taken.to_arrays())


@lru_cache(maxsize=64)
def stored_bumpy(seed: int) -> Signature:
    """Of a sphere with bumps, 642 vertices."""
    return stored(bumpy_sphere(3, seed))


@lru_cache(maxsize=8)
def asked_bumpy(seed: int) -> Signature:
    """Of a sphere with bumps, 642 vertices."""
    return asked(bumpy_sphere(3, seed))
