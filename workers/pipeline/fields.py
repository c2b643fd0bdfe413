"""Functions on a surface, carried from the working mesh to the mesh that people look at."""

import numpy as np

from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import Kernel
from workers.geometry.arrays import Float32Array, FloatArray
from workers.geometry.solution import Solution
from workers.geometry.spectrum import eigenfunction
from workers.geometry.transfer import transfer_to_vertices
from workers.geometry.views import View
from workers.storage.blobs import BlobStore
from workers.storage.solutions import load_cleaned, load_solution


def vertex_signature(blobs: BlobStore, sha256: str, view: View, kernel: Kernel) -> Float32Array:
    """k(x,x) at every vertex of the cleaned mesh.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    view : View
        Under which it was solved.
    kernel : Kernel
        Gives K²(λ).

    Returns
    -------
    (n,) float32
        In 1/area of the file's unit.

    Raises
    ------
    BlobNotFoundError
        The shape was not computed under this view.
    """
    solution = load_solution(blobs, sha256, view)
    return _carried(blobs, sha256, solution, diagonal_signature(solution.spectrum, kernel))


def vertex_eigenfunction(blobs: BlobStore, sha256: str, view: View, number: int) -> Float32Array:
    """Eigenfunction at every vertex of the cleaned mesh.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    view : View
        Under which it was solved.
    number : int
        1 is that of the first nonzero eigenvalue.

    Returns
    -------
    (n,) float32
        In 1/length of the file's unit.

    Raises
    ------
    BlobNotFoundError
        The shape was not computed under this view.
    InvalidRequestError
        The number is below 1 or above the number of eigenpairs.
    """
    solution = load_solution(blobs, sha256, view)
    return _carried(blobs, sha256, solution, eigenfunction(solution.spectrum, number))


def _carried(blobs: BlobStore, sha256: str, solution: Solution, values: FloatArray) -> Float32Array:
    """Values of the working mesh (n_working,) at the vertices of the cleaned one, (n,)."""
    cleaned = load_cleaned(blobs, sha256)
    return transfer_to_vertices(solution.mesh, values, cleaned).astype(np.float32)
