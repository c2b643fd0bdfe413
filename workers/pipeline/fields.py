"""Functions on a surface, carried from the working mesh to the mesh that people look at."""

import numpy as np

from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import Kernel
from workers.geometry.arrays import Float32Array
from workers.geometry.preparation import View
from workers.geometry.transfer import transfer_to_vertices
from workers.storage.blobs import BlobStore
from workers.storage.solutions import load_cleaned, load_solution


def vertex_signature(blobs: BlobStore, sha256: str, view: View, kernel: Kernel) -> Float32Array:
    """k(x,x) at every vertex of the cleaned mesh, float32 (n,), in 1/area of the file's unit.

    Raises
    ------
    BlobNotFoundError
        The shape was not computed under this view.
    """
    solution = load_solution(blobs, sha256, view)
    values = diagonal_signature(solution.spectrum, kernel)  # (working vertices,)
    cleaned = load_cleaned(blobs, sha256)
    return transfer_to_vertices(solution.mesh, values, cleaned).astype(np.float32)
