"""Diffusion maps, distances between points, and the diagonal k(x,x)."""

import numpy as np
from scipy.spatial.distance import pdist

from workers.diffusion.kernels import Kernel, evaluate
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.spectrum import Spectrum


def diffusion_map(spectrum: Spectrum, kernel: Kernel, sample: IntArray) -> FloatArray:
    """Coordinates K(λ_i) φ_i(x) of sampled vertices, section 2.3 (Lafon's diffusion map).

    Parameters
    ----------
    spectrum : Spectrum
        k nonzero eigenpairs.
    kernel : Kernel
        Gives K²(λ) >= 0; for ``HeatKernel`` the time has the unit of area, since λ has 1/area.
    sample : (s,) int
        Vertex indices.

    Returns
    -------
    (s, k) float64; Euclidean distances between its rows are diffusion distances.

    Raises
    ------
    KernelDomainError
        The kernel is not finite, or negative, on the spectrum's eigenvalues.
    """
    transfer = np.sqrt(evaluate(kernel, spectrum.eigenvalues))  # (k,)
    coordinates: FloatArray = spectrum.eigenvectors[sample] * transfer  # (s, k)
    return coordinates


def pairwise_diffusion_distances(
    spectrum: Spectrum, kernel: Kernel, sample: IntArray
) -> FloatArray:
    """Diffusion distances of every pair of sampled vertices once, the root of eq. (4); a metric.

    Differences are squared one by one: ``|a|² + |b|² - 2ab`` would lose the small distances.

    Parameters
    ----------
    spectrum : Spectrum
        k nonzero eigenpairs, area-orthonormal.
    kernel : Kernel
        As for `diffusion_map`.
    sample : (s,) int
        Vertex indices.

    Returns
    -------
    (s (s - 1) / 2,) float64, not negative: those of (0, 1), (0, 2), …, (1, 2), …, as of `pdist`.

    Raises
    ------
    KernelDomainError
        The kernel is not finite, or negative, on the spectrum's eigenvalues.
    """
    distances: FloatArray = np.sqrt(pdist(diffusion_map(spectrum, kernel, sample), "sqeuclidean"))
    return distances


def diagonal_signature(spectrum: Spectrum, kernel: Kernel) -> FloatArray:
    """k(x,x) = Σ K²(λ_i) φ_i(x)² at every vertex, section 4 (fourth experiment).

    Parameters
    ----------
    spectrum : Spectrum
        k nonzero eigenpairs, area-orthonormal.
    kernel : Kernel
        As for `diffusion_map`.

    Returns
    -------
    (n,) float64, no entry below 0, in 1/area times the unit of K².

    Raises
    ------
    KernelDomainError
        The kernel is not finite, or negative, on the spectrum's eigenvalues.
    """
    squared = evaluate(kernel, spectrum.eigenvalues)  # (k,)
    signature: FloatArray = (np.square(spectrum.eigenvectors) * squared).sum(axis=1)  # (n,)
    return signature
