"""k(x,x) of a surface under several kernels, computed together."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workers.diffusion.kernels import Kernel, evaluate
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.channels.normalisation import component_factors

LOG_FLOOR = 1e-9  # keeps the logarithm finite where a kernel leaves nothing, at area 1

_ROWS = 256  # vertices whose squares are multiplied at a time: 0.4 MB, which a cache holds
_COLUMNS = 8  # kernels fill up to a multiple: else BLAS sums the last ones in another order


@dataclass(frozen=True, eq=False)
class Signature:
    """k(x,x) of a connected surface under one kernel, in the scale of a normalisation.

    Attributes
    ----------
    values : (n,) float64
        k(x,x) >= 0 of every vertex, in ascending order but for rounding.
    areas : (n,) float64
        Of the same vertices, in the mesh's own unit.
    area : float
        Of the surface, in the scale of the normalisation.
    rest : float
        See `part_factors`; 0 where the surface is no part of another.
    """

    values: FloatArray
    areas: FloatArray
    area: float
    rest: float

    @property
    def logarithms(self) -> FloatArray:
        """Logarithms of k(x,x), (n,). It is raised by 10⁻⁹ / area, to stay finite."""
        logarithms: FloatArray = np.log(self.values + LOG_FLOOR / self.area)
        return logarithms


class Signatures:
    """k(x,x) of a surface under all kernels that are needed, one product of matrices a component.

    Parameters
    ----------
    solution : Solution
        Of the surface.
    needed : iterable of (str, Kernel)
        Normalisations, and kernels in their unit.
    """

    def __init__(self, solution: Solution, needed: Iterable[tuple[str, Kernel]]) -> None:
        """Note what is needed; nothing is computed before the first of them is asked for."""
        self._solution = solution
        self._keys = list(dict.fromkeys(needed))

    def of(self, normalisation: str, kernel: Kernel) -> list[Signature]:
        """Signatures under one of the kernels that were needed.

        Parameters
        ----------
        normalisation : str
            With which it was needed.
        kernel : Kernel
            In its unit.

        Returns
        -------
        list of Signature
            Of each component, or of the surface alone where it is connected.

        Raises
        ------
        KernelDomainError
            A kernel is not finite, or negative, on the spectrum's eigenvalues.
        """
        return self._found[normalisation, kernel]

    @cached_property
    def _found(self) -> dict[tuple[str, Kernel], list[Signature]]:
        """All that are needed."""
        solution, keys = self._solution, self._keys
        names = {normalisation for normalisation, _ in keys}
        factors = {name: component_factors(solution, name) for name in names}
        components = [part.solution.spectrum for part in solution.parts] or [solution.spectrum]
        found: dict[tuple[str, Kernel], list[Signature]] = {key: [] for key in keys}
        for i, spectrum in enumerate(components):
            scales = [factors[normalisation][i] for normalisation, _ in keys]
            kernels = [(k, factor) for (_, k), (factor, _) in zip(keys, scales, strict=True)]
            values = diagonals(spectrum, kernels)  # (kernels, n)
            order = _ascending(values)
            values, areas = np.take_along_axis(values, order, axis=1), spectrum.areas[order]
            for j, (key, (factor, rest)) in enumerate(zip(keys, scales, strict=True)):
                area = spectrum.area * factor**2
                found[key].append(Signature(values[j], areas[j], area, rest))
        return found


def diagonals(
    spectrum: Spectrum, kernels: Sequence[tuple[Kernel, float]], rows: IntArray | None = None
) -> FloatArray:
    """k(x,x) = Σ K²(λ_i) φ_i(x)² under several kernels, of a surface scaled for each of them.

    Parameters
    ----------
    spectrum : Spectrum
        Of the surface as it is.
    kernels : sequence of (Kernel, float)
        Each with the factor of all lengths in whose scale it is meant.
    rows : (r,) int, optional
        The vertices that are asked for; all n where there are none.

    Returns
    -------
    (kernels, r or n) float64, no entry below 0. Those of a kernel do not depend on the others.

    Raises
    ------
    KernelDomainError
        A kernel is not finite, or negative, on the spectrum's eigenvalues.
    """
    vectors = spectrum.eigenvectors if rows is None else spectrum.eigenvectors[rows]  # (n, k)
    n, k = vectors.shape
    transfers = np.zeros((-(-len(kernels) // _COLUMNS) * _COLUMNS, k))
    for i, (kernel, factor) in enumerate(kernels):
        transfers[i] = evaluate(kernel, spectrum.eigenvalues / factor**2) / factor**2
    values = np.empty((len(transfers), n))
    for start in range(0, n, _ROWS):
        here = slice(start, start + _ROWS)
        np.matmul(transfers, np.square(vectors[here]).T, out=values[:, here])
    return values[: len(kernels)]


def _ascending(values: FloatArray) -> IntArray:
    """Order of the values of each row, (r, n), of which none is below 0.

    Whole numbers are sorted much faster than an order is found. So the last bits of each value
    are replaced by its place: values that differ in these alone stay as they were.
    """
    n = values.shape[1]
    bits = max(n - 1, 1).bit_length()
    keys = values.view(np.int64) >> bits << bits  # ascend as the values do
    keys |= np.arange(n)
    keys.sort(axis=1)
    order: IntArray = keys & ((1 << bits) - 1)
    return order
