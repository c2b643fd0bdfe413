"""The smallest eigenpairs of W φ = λ A φ on one connected surface, certified by inertia."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import sparse

from workers.errors import SpectrumError
from workers.geometry.arrays import FloatArray
from workers.geometry.certificate import RESIDUAL, Candidate, is_certified, is_complete, polished
from workers.geometry.inertia import ShiftedFactor, factorise, factorise_between
from workers.geometry.lanczos import BlockLanczos, RitzPairs

DENSE_VERTICES = 300
"""Up to so many vertices LAPACK computes all eigenpairs: measured, faster from 34 pairs on."""

_DENSE_SHARE = 4  # where more than a fourth of all eigenpairs are wanted LAPACK computes all
_LAST_RESORT_VERTICES = 4000  # the most that LAPACK is given when all else failed; chosen, 30 s
_START_SEED = 20140717  # of the first Lanczos block: the same mesh gives the same bits
_MOST_REFUSALS = 3  # by the certificate, before the next strategy is tried; chosen, not measured
_USUAL_SLOPE = 1.8  # measured: the fall of the logarithm of the last pair's residual, a step
_ZERO = 1e-10  # at area 1 a second eigenvalue below this is a second zero mode


@dataclass(frozen=True)
class Strategy:
    """One way to search.

    Attributes
    ----------
    block : int
        Columns of a Lanczos block; 0 for some more than the pairs wanted.
    position : float
        Of the shift, in units of Weyl's estimate 4πk of the k-th eigenvalue at area 1.
    """

    block: int
    position: float


FEW = 16
"""For fewer pairs than this the first strategy is `FOR_FEW`."""

FOR_FEW = Strategy(block=4, position=1.2)
"""Beyond the wanted range: one factor searches and certifies, for some more steps of the search."""

STRATEGIES = (
    Strategy(block=8, position=0.6),
    Strategy(block=8, position=0.5),
    Strategy(block=32, position=0.41),
    Strategy(block=0, position=-0.02),
)
"""From the fastest to the surest: ``python -m benchmarks.spectrum --strategies`` compares others.

Below the spectrum (the last) the factor is definite, and a block wider than k finds every copy of
a multiple eigenvalue.
"""


def smallest_eigenpairs(
    stiffness: sparse.csc_array,
    areas: FloatArray,
    n_eigenpairs: int,
    *,
    strategies: Sequence[Strategy] | None = None,
    last_resort: int = _LAST_RESORT_VERTICES,
) -> tuple[FloatArray, FloatArray]:
    """Smallest nonzero eigenpairs of W φ = λ A φ of one connected component, eq. (9).

    Area is scaled to 1 inside. Small problems are solved densely, others by shift-and-invert
    block Lanczos with the shift inside the wanted range. Its result is returned only if it is
    certified: by Sylvester's law of inertia, no eigenvalue below the last one is missing.

    Parameters
    ----------
    stiffness : (n, n) sparse
        W, symmetric, positive semidefinite, with the constants as its only kernel.
    areas : (n,) float64
        Positive diagonal of A.
    n_eigenpairs : int
        k; all n - 1 where there are fewer.
    strategies : sequence of Strategy
        Tried in turn until one is certified; None for `STRATEGIES`, after `FOR_FEW` where that is
        fast.
    last_resort : int
        Most vertices that are solved densely where no strategy was certified.

    Returns
    -------
    eigenvalues : (k,) float64
        Ascending, positive, in 1/area; the zero mode is dropped.
    eigenvectors : (n, k) float64
        Area-orthonormal: ``eigenvectors.T @ (areas * eigenvectors) = I``.

    Raises
    ------
    SpectrumError
        No strategy gave eigenpairs that could be certified, or the surface is not connected.
    """
    if strategies is None:
        strategies = (FOR_FEW, *STRATEGIES) if n_eigenpairs < FEW else STRATEGIES
    n_vertices = len(areas)
    count = min(n_eigenpairs, n_vertices - 1)
    if count < 1:
        return np.empty(0), np.empty((n_vertices, 0))
    total = float(areas.sum())
    masses = areas / total  # (n,)
    if n_vertices <= DENSE_VERTICES or _DENSE_SHARE * count > n_vertices:
        values, vectors = _dense_eigenpairs(stiffness, masses, count)
    else:
        values, vectors = _certified_eigenpairs(stiffness, masses, count, strategies, last_resort)
    if values[0] <= _ZERO:
        raise SpectrumError(
            f"the second eigenvalue is {values[0]:.1e} at area 1: the surface is not connected, "
            "expected one connected component"
        )
    return values / total, vectors / np.sqrt(total)


def _dense_eigenpairs(
    stiffness: sparse.csc_array, masses: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """All eigenpairs by LAPACK, of which the smallest nonzero are returned.

    Solved as A φ = μ (W + sA) φ, μ = 1/(λ + s): the wanted λ are the largest μ, and keep
    their digits even where slivers give S a huge norm.
    """
    offset = 4.0 * np.pi * count
    pencil = stiffness.toarray() + np.diag(offset * masses)
    try:
        inverses, vectors = scipy.linalg.eigh(np.diag(masses), pencil)
    except np.linalg.LinAlgError as error:
        raise SpectrumError(
            "the stiffness matrix is not positive semidefinite; expected a clean mesh"
        ) from error
    chosen = np.arange(len(masses) - 2, len(masses) - 2 - count, -1)  # past the zero mode
    vectors = vectors[:, chosen] / np.sqrt(inverses[chosen])
    values = 1.0 / inverses[chosen] - offset
    return values, vectors


def _certified_eigenpairs(
    stiffness: sparse.csc_array,
    masses: FloatArray,
    count: int,
    strategies: Sequence[Strategy],
    last_resort: int,
) -> tuple[FloatArray, FloatArray]:
    """Try the strategies in turn until one is certified."""
    # The standard form S = A^-1/2 W A^-1/2 has the same eigenvalues, without products with A.
    roots = np.sqrt(masses)  # (n,) also the zero mode of S
    scaling = sparse.diags_array(1.0 / roots)
    matrix = sparse.csc_array(scaling @ stiffness @ scaling)
    for strategy in strategies:
        found = _attempt(matrix, roots, count, strategy)
        if found is not None:
            values, vectors = found
            return values, vectors / roots[:, None]
    if len(masses) <= last_resort:
        return _dense_eigenpairs(stiffness, masses, count)
    raise SpectrumError(
        f"{count} eigenpairs of {len(masses)} vertices could not be certified: the number found "
        "differs from the inertia under every strategy"
    )


def _attempt(
    matrix: sparse.csc_array, zero_mode: FloatArray, count: int, strategy: Strategy
) -> tuple[FloatArray, FloatArray] | None:
    """Eigenpairs of S by one strategy, certified, or None."""
    n_rows = len(zero_mode)
    factor = place_shift(matrix, count, strategy.position)
    if factor is None:
        return None
    block = strategy.block or count + 8
    wanted = max(count, factor.n_below - 1)  # all below the shift: then its inertia certifies them
    capacity = min(8 * wanted + 12 * block, n_rows - 2 - 2 * block)
    if capacity < wanted + 2:
        return None
    process = BlockLanczos(
        factor.solve,
        n_rows=n_rows,
        block=block,
        capacity=capacity,
        deflated=(zero_mode / np.linalg.norm(zero_mode))[:, None],
        rng=np.random.Generator(np.random.PCG64(_START_SEED)),
    )
    forecast = _Forecast(process, factor, wanted)
    refusals = 0
    while not process.is_full and refusals < _MOST_REFUSALS:
        process.step()
        if not (forecast.is_due() or process.is_full):
            continue
        ritz = process.ritz_pairs()
        candidate = _converged(ritz, factor, wanted)
        if candidate is None:
            continue
        if (
            factor.n_below > count and is_complete(matrix, zero_mode, candidate, factor)
        ) or is_certified(matrix, zero_mode, candidate, count):
            found = polished(matrix, factor, ritz.vectors(candidate.indices[:count]))
            if found is not None:
                return found
        refusals += 1  # a larger Krylov space may hold what is missing
    return None


class _Forecast:
    """Tells when a Krylov space is large enough for a check, which costs as much as many steps.

    The wanted eigenvalue farthest from the shift converges last. Its residual alone is cheap, and
    falls evenly from some point on: two of them tell the size at which it is small enough.
    """

    def __init__(self, process: BlockLanczos, factor: ShiftedFactor, count: int) -> None:
        """Wait until there may be something to see."""
        self._process = process
        self._factor = factor
        self._count = count
        self._next = int(1.5 * count) + 10 * process.block
        self._seen: tuple[int, float] | None = None
        self._fulfilled = False

    def is_due(self) -> bool:
        """Whether the farthest wanted eigenvalue has converged; after that every few steps."""
        process = self._process
        if process.size < self._next:
            return False
        if self._fulfilled:
            self._next = process.size + max(process.block, self._count // 8)
            return True
        excess = self._excess()
        if excess <= 0.0:
            self._fulfilled = True
            return True
        slope = _USUAL_SLOPE / process.block
        if self._seen is not None and self._seen[1] > excess:
            slope = (self._seen[1] - excess) / (process.size - self._seen[0])
        self._seen = process.size, excess
        wait = min(excess / slope, 0.5 * self._count + process.block)
        self._next = process.size + int(np.ceil(wait))
        return False

    def _excess(self) -> float:
        """Logarithm of the farthest wanted pairs' residual over what it may be, the larger one."""
        n_lower = max(self._factor.n_below - 1, 0)
        n_upper = self._count - n_lower
        worst = -np.inf
        if n_lower > 0:
            worst = self._excess_at(n_lower - 1, -1.0)
        if n_upper > 0:
            worst = max(worst, self._excess_at(self._process.size - n_upper, 1.0))
        return worst

    def _excess_at(self, index: int, sign: float) -> float:
        """The same of one Ritz value, which must be on its side of the shift."""
        theta, residual = self._process.remainder_at(index)
        growth = theta * (1.0 + theta * self._factor.shift)  # λ θ², as in `_converged`
        if theta * sign <= 0.0 or growth <= 0.0:
            return np.inf
        return float(np.log(max(residual, 1e-300) / (RESIDUAL * growth)))


def place_shift(matrix: sparse.csc_array, count: int, position: float) -> ShiftedFactor | None:
    """Factor S - shift I with a part of the wanted eigenvalues below the shift.

    Weyl's law, 4πk at area 1 for the k-th eigenvalue, gives the first shift. Long thin or open
    surfaces have many more eigenvalues below it. The inertia counts them, and the shift is moved.

    Parameters
    ----------
    matrix : (n, n) sparse
        S = A^-1/2 W A^-1/2, at area 1.
    count : int
        k, the number of nonzero eigenvalues wanted.
    position : float
        About the share of the wanted eigenvalues that lie below the shift; negative for none, 1 or
        more for all of them and some others.

    Returns
    -------
    ShiftedFactor or None
        None where no sound factor was found with fewer than k eigenvalues below it; for a position
        of 1 or more, with any number.
    """
    shift = position * 4.0 * np.pi * count
    if position < 0.0:
        factor = factorise(matrix, shift)
        return factor if factor is not None and factor.n_below == 0 else None
    inside = position < 1.0
    low, high = (0.3 * count, 0.75 * count + 1.5) if inside else (count, 2.0 * count + 4.0)
    few, many = 0.0, np.inf  # shifts known to have too few, too many eigenvalues below
    best = None
    while many > 1.2 * few:
        factor = factorise_between(matrix, 0.97 * shift, 1.03 * shift)
        if factor is None:
            return best
        below = factor.n_below - 1  # the zero mode is not wanted
        if below < count or not inside:
            best = factor
        if (low <= below or (inside and count < 8)) and below <= high:
            break
        if below > 0.5 * (low + high):
            many = shift
        else:
            few = shift
        target = shift * float(np.clip(position * count / max(below, 1), 0.1, 10.0))
        shift = target if few < target < many else float(np.sqrt(max(few, 0.01 * many) * many))
    return best


def _converged(ritz: RitzPairs, factor: ShiftedFactor, count: int) -> Candidate | None:
    """The wanted eigenvalues and some beyond, or None where the wanted ones have not converged.

    With θ = 1/(λ - shift), those below the shift are the most negative θ, as many as the inertia
    says; those above are the largest. What remains of a residual r of T x = θ x after one
    refinement is |S x - λ x| = |λ - shift| r / |θ|.
    """
    shift = factor.shift
    n_lower = max(factor.n_below - 1, 0)
    usable = np.abs(ritz.values) > 2.0 * ritz.residuals
    lower = np.flatnonzero(usable & (ritz.values < 0.0))[:n_lower][::-1]
    upper = np.flatnonzero(usable & (ritz.values > 0.0))[::-1]
    if len(lower) < n_lower or len(lower) + len(upper) < count:
        return None
    indices = np.concatenate([lower, upper])  # (m,) ascending eigenvalues
    theta, errors = ritz.values[indices], ritz.residuals[indices]
    values = shift + 1.0 / theta
    residuals = np.abs(values - shift) * errors / np.abs(theta)
    if np.any(values[:count] <= 0.0) or np.any(residuals[:count] > RESIDUAL * values[:count]):
        return None
    return Candidate(
        values, shift + 1.0 / (theta + errors), shift + 1.0 / (theta - errors), indices
    )
