"""Block Lanczos for the extreme eigenpairs of a symmetric operator given by its action."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from workers.geometry.arrays import FloatArray, IntArray

Operator = Callable[[FloatArray], FloatArray]
"""Applies a symmetric operator to a block of columns (n, b)."""

# Chosen, not measured: a projection that leaves more than this of a block loses two digits at most
# and needs no second one; less than `_EXHAUSTED` is rounding error, and the space is invariant.
_CANCELLATION = 1e-2
_EXHAUSTED = 1e-13


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
            Of length 1.
        """
        weights = np.concatenate(
            [
                self._coefficients[:, chosen],
                self._last[:, chosen] / self.values[chosen],
            ]
        )  # (m + b, c)
        vectors: FloatArray = self._basis @ weights
        vectors /= np.linalg.norm(vectors, axis=0)
        return vectors


class BlockLanczos:
    """An unrestarted block Lanczos process with full reorthogonalisation.

    Every basis vector is kept orthogonal to all others and to ``deflated``. So a converged pair is
    found once and a known one never. In exact arithmetic at most ``block`` copies of a multiple
    eigenvalue can appear: whoever needs all of them must count (see ``eigensolver``).

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
        Draws the first block, and new directions where the space is exhausted.
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
        self.size = 0
        self.capacity = capacity
        start, _ = self._orthonormal(rng.standard_normal((n_rows, block)), np.sqrt(n_rows))
        self._basis[:, self._n_deflated : self._n_deflated + block] = start

    @property
    def is_full(self) -> bool:
        """Whether another step would pass the capacity."""
        return self.size + self._block > self.capacity

    def step(self) -> None:
        """Let the Krylov space grow by one block."""
        begin, end = self.size, self.size + self._block
        offset = self._n_deflated
        block = self._basis[:, offset + begin : offset + end]
        image = self._operator(block)  # (n, b)
        scale = float(np.linalg.norm(image, axis=0).max())
        diagonal = block.T @ image
        self._projected[begin:end, begin:end] = 0.5 * (diagonal + diagonal.T)
        recent = max(begin - self._block, 0)  # the recurrence: only the last two blocks matter
        neighbours = self._basis[:, offset + recent : offset + end]
        image = image - neighbours @ self._projected[recent:end, begin:end]
        self.size = end
        following, remainder = self._orthonormal(image, scale)  # against what rounding let in
        self._basis[:, offset + end : offset + end + self._block] = following
        self._projected[end : end + self._block, begin:end] = remainder
        self._projected[begin:end, end : end + self._block] = remainder.T

    def ritz_pairs(self) -> RitzPairs:
        """Rayleigh-Ritz on the present Krylov space.

        Returns
        -------
        RitzPairs
            As many as the space has dimensions, m.
        """
        size, block = self.size, self._block
        values, coefficients = scipy.linalg.eigh(self._projected[:size, :size])
        remainder = self._projected[size : size + block, size - block : size]
        last = remainder @ coefficients[size - block :]  # (b, m)
        basis = self._basis[:, self._n_deflated : self._n_deflated + size + block]
        return RitzPairs(values, np.linalg.norm(last, axis=0), basis, coefficients, last)

    def _orthonormal(self, vectors: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """Orthonormal basis of what of the vectors is new, and their coefficients in it.

        A projection, and another one where little is left of their ``scale``. A direction that the
        space has already (it is invariant then) becomes a random one, with coefficient zero.
        """
        old = self._basis[:, : self._n_deflated + self.size]
        basis, remainder = _orthonormalised(vectors - old @ (old.T @ vectors))
        pivots = np.abs(np.diag(remainder))  # (b,)
        if np.min(pivots) > _CANCELLATION * scale:
            return basis, remainder
        exhausted = pivots <= _EXHAUSTED * scale
        if np.any(exhausted):
            fresh = self._rng.standard_normal((len(basis), int(exhausted.sum())))
            fresh -= old @ (old.T @ fresh)
            basis[:, exhausted] = fresh / np.linalg.norm(fresh, axis=0)
            remainder[exhausted] = 0.0
        basis, correction = _orthonormalised(basis - old @ (old.T @ basis))
        return basis, correction @ remainder


def _orthonormalised(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Economic QR factors (n, b) and (b, b) of a block."""
    basis: FloatArray
    triangle: FloatArray
    basis, triangle = scipy.linalg.qr(vectors, mode="economic")  # type: ignore[assignment]
    return basis, triangle
