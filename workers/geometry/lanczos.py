"""Block Lanczos for the extreme eigenpairs of a symmetric operator given by its action."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from workers.geometry.arrays import FloatArray, IntArray

Operator = Callable[[FloatArray], FloatArray]
"""Applies a symmetric operator to a block of columns (n, b)."""

# Components along earlier vectors up to the root of the machine's precision leave the projected
# operator exact (Simon, 1984). This limit is lower, since the components are only estimated.
_LOSS = 1e-10
_ORTHOGONAL = 1e-12  # what a projection must leave, or there is another; chosen, not measured
_MOST_PROJECTIONS = 3
_PROBES = 4  # random combinations of the basis that the loss is estimated with
# What a step leaves of a block below this is rounding error, and the space is invariant.
_EXHAUSTED = 1e-13
_CONDITION = 1e-6  # the smallest ratio of pivots that Cholesky-QR is trusted with

# Ritz vectors that each new block is kept away from: lost orthogonality grows along those of the
# largest values. Measured at 5,000 vertices, k = 200: 16 full projections instead of 25.
_GUARDS = 16
_FIRST_GUARDS = 128  # basis vectors when they are computed first, and again whenever these double


@dataclass(frozen=True, eq=False)
class RitzPairs:
    """What a Krylov space knows of an operator's eigenpairs.

    Attributes
    ----------
    values : (m,) float64
        Ritz values, ascending.
    residuals : (m,) float64
        ``|T x - value x|``: the operator has an eigenvalue at most that far from the value.
    """

    values: FloatArray
    residuals: FloatArray
    _basis: FloatArray  # (n, m + b), the last block is the next of the Krylov space
    _coefficients: FloatArray  # (m, m)
    _last: FloatArray  # (b, m): coefficients of T x - value x in the next block

    def vectors(self, chosen: IntArray) -> FloatArray:
        """Unit Ritz vectors, each refined by one application of the operator T.

        ``T x / value`` costs no solve: the part that x lacks lies in the next block of the basis.

        Parameters
        ----------
        chosen : (c,) int64
            Indices of the wanted pairs.

        Returns
        -------
        (n, c) float64
            Of length 1, up to the loss of orthogonality, 1e-10.
        """
        weights = np.concatenate(
            [
                self._coefficients[:, chosen],
                self._last[:, chosen] / self.values[chosen],
            ]
        )  # (m + b, c)
        weights /= np.linalg.norm(weights, axis=0)
        vectors: FloatArray = self._basis @ weights
        return vectors


class BlockLanczos:
    """An unrestarted block Lanczos process with partial reorthogonalisation.

    A pair that has converged comes back by rounding errors, along the earlier vectors. So the loss
    of orthogonality is estimated at each step. Where it is too large, the last two blocks are
    projected off all earlier ones. Then a converged pair is found once, and a known one never. In
    exact arithmetic at most ``block`` copies of a multiple eigenvalue can appear: whoever needs all
    of them must count (see ``eigensolver``).

    Parameters
    ----------
    operator : function (n, b) → (n, b)
        Applies the symmetric operator T to a block of columns.
    n_rows : int
        n.
    block : int
        b, columns of a block.
    capacity : int
        Most basis vectors.
    deflated : (n, d) float64
        Orthonormal vectors that the Krylov space keeps away from.
    rng : Generator
        Draws the first block, the probes, and new directions where the space is exhausted.
    """

    def __init__(
        self,
        operator: Operator,
        *,
        n_rows: int,
        block: int,
        capacity: int,
        deflated: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        """Start from a random block."""
        self._operator = operator
        self._block = block
        self._rng = rng
        self._n_deflated = deflated.shape[1]
        self._basis = np.empty((n_rows, self._n_deflated + capacity + block), order="F")
        self._basis[:, : self._n_deflated] = deflated
        self._projected = np.zeros((capacity + block, capacity + block))
        self._probes = np.zeros((n_rows, _PROBES), order="F")
        self._guards = deflated
        self._next_guards = _FIRST_GUARDS
        self.size = 0
        self.capacity = capacity
        start = rng.standard_normal((n_rows, block))
        start -= deflated @ (deflated.T @ start)
        start, _ = _orthonormalised(start)
        self._basis[:, self._n_deflated : self._n_deflated + block] = start

    @property
    def block(self) -> int:
        """Columns of a block, b."""
        return self._block

    @property
    def is_full(self) -> bool:
        """Whether another step would pass the capacity."""
        return self.size + self._block > self.capacity

    def step(self) -> None:
        """Let the Krylov space grow by one block."""
        begin, end = self.size, self.size + self._block
        offset = self._n_deflated
        image = self._operator(self._basis[:, offset + begin : offset + end])  # (n, b)
        scale = float(np.sqrt(np.einsum("ij,ij->j", image, image).max()))
        recent = max(begin - self._block, 0)  # the recurrence: only the last two blocks matter
        neighbours = self._basis[:, offset + recent : offset + end]
        coefficients = neighbours.T @ image  # (2b, b)
        diagonal = coefficients[begin - recent :]
        self._projected[begin:end, begin:end] = 0.5 * (diagonal + diagonal.T)
        image -= neighbours @ coefficients
        image -= self._guards @ (self._guards.T @ image)
        self.size = end
        following, remainder = self._orthonormal(image, scale)
        self._basis[:, offset + end : offset + end + self._block] = following
        self._projected[end : end + self._block, begin:end] = remainder
        self._projected[begin:end, end : end + self._block] = remainder.T
        older = self._basis[:, offset + recent : offset + begin]  # no neighbours from now on
        self._probes += older @ self._rng.standard_normal((older.shape[1], _PROBES))
        if self.size >= self._next_guards:
            self._next_guards *= 2
            self._renew_guards(begin)

    def remainder_at(self, index: int) -> tuple[float, float]:
        """One Ritz value and its residual, for much less than `ritz_pairs`.

        Parameters
        ----------
        index : int
            From 0, among the Ritz values in ascending order.

        Returns
        -------
        value, residual : float
            As in `RitzPairs`; the residual is that of a vector from inverse iteration.
        """
        size, block = self.size, self._block
        band = np.zeros((2 * block + 1, size))  # (2b + 1, m) diagonals, the main one in the middle
        for i in range(block + 1):
            diagonal = np.diagonal(self._projected[:size, :size], -i)
            band[block + i, : size - i] = diagonal
            band[block - i, i:] = diagonal
        value = scipy.linalg.eigvals_banded(
            band[block:], lower=True, select="i", select_range=(index, index)
        )[0]
        band[block] -= value * (1.0 + 4.0 * np.finfo(np.float64).eps)
        vector = np.ones(size)
        for _ in range(2):
            vector = scipy.linalg.solve_banded((block, block), band, vector)
            vector /= np.linalg.norm(vector)
        remainder = self._projected[size : size + block, size - block : size]
        return float(value), float(np.linalg.norm(remainder @ vector[size - block :]))

    def ritz_pairs(self) -> RitzPairs:
        """Rayleigh-Ritz on the present Krylov space.

        Returns
        -------
        RitzPairs
            As many as the space has dimensions, m.
        """
        size, block = self.size, self._block
        values, coefficients = scipy.linalg.eigh(self._projected[:size, :size], driver="evd")
        remainder = self._projected[size : size + block, size - block : size]
        last = remainder @ coefficients[size - block :]  # (b, m)
        basis = self._basis[:, self._n_deflated : self._n_deflated + size + block]
        return RitzPairs(values, np.linalg.norm(last, axis=0), basis, coefficients, last)

    def _orthonormal(self, vectors: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """Orthonormal basis of what of the vectors is new, and their coefficients in it.

        A direction that the space has already (it is invariant then) becomes a random one, with
        coefficient zero. A loss at the new block began at the one before: both are projected.
        """
        basis, remainder = _orthonormalised(vectors)
        exhausted = np.abs(np.diag(remainder)) <= _EXHAUSTED * scale  # (b,)
        if np.any(exhausted):
            fresh = self._rng.standard_normal((len(basis), int(exhausted.sum())))
            basis[:, exhausted] = fresh / np.linalg.norm(fresh, axis=0)
            remainder[exhausted] = 0.0
        elif self._loss(basis) <= _LOSS:
            return basis, remainder
        end = self._n_deflated + self.size
        begin = end - self._block
        self._basis[:, end : end + self._block] = basis
        older, old = self._basis[:, :begin], self._basis[:, :end]
        both = self._basis[:, begin : end + self._block]
        both -= older @ (older.T @ both)
        last, basis = both[:, : self._block], both[:, self._block :]
        basis = basis - last @ (last.T @ basis)
        for _ in range(_MOST_PROJECTIONS):
            basis, correction = _orthonormalised(basis)
            remainder = correction @ remainder
            if not np.any(exhausted) and self._loss(basis) <= _ORTHOGONAL:
                break
            exhausted[:] = False
            basis = basis - old @ (old.T @ basis)
        return basis, remainder

    def _loss(self, basis: FloatArray) -> float:
        """Estimated length of what unit vectors have along the blocks before the last two."""
        seen = self._probes.T @ basis  # (p, b) normal variables, of that standard deviation
        return float(np.sqrt(np.mean(seen**2, axis=0).max()))

    def _renew_guards(self, size: int) -> None:
        """Compute Ritz vectors of the largest values, in the span of the first ``size``."""
        values, coefficients = scipy.linalg.eigh(self._projected[:size, :size], driver="evd")
        chosen = np.argsort(-np.abs(values), kind="stable")[:_GUARDS]
        known = self._basis[:, : self._n_deflated + size]
        guards = known[:, self._n_deflated :] @ coefficients[:, chosen]
        self._guards = np.concatenate([known[:, : self._n_deflated], guards], axis=1)


def _orthonormalised(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Economic QR factors (n, b) and (b, b) of a block: Cholesky-QR twice where that is safe."""
    basis = vectors
    triangle: FloatArray = np.eye(vectors.shape[1])
    for _ in range(2):
        try:
            factor = np.linalg.cholesky(basis.T @ basis, upper=True)
        except np.linalg.LinAlgError:
            return _by_householder(vectors)
        pivots = np.diag(factor)
        if not pivots.min() > _CONDITION * pivots.max():
            return _by_householder(vectors)
        basis = basis @ np.linalg.inv(factor)
        triangle = factor @ triangle
    return basis, triangle


def _by_householder(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Economic QR factors of any block, by LAPACK."""
    basis: FloatArray
    triangle: FloatArray
    basis, triangle = scipy.linalg.qr(vectors, mode="economic")  # type: ignore[assignment]
    return basis, triangle
