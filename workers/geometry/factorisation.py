"""Sparse factors of symmetric matrices, with one ordering for the whole engine."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from workers.geometry.arrays import FloatArray


class SymmetricFactor:
    """Factors of a symmetric sparse matrix: solves, and shows its pivots.

    SuperLU's symmetric mode, with the minimum-degree ordering of ``A + A.T``.

    Parameters
    ----------
    matrix : (n, n) sparse
        Symmetric; only a positive definite one is safe without a look at `exchanged_rows`.
    pivot_threshold : float
        A pivot is taken from the diagonal unless it is smaller than this times the largest entry
        of its column. With 0 only an exact zero is refused, and the factors are P(LDLᵀ)Pᵀ.
    panel_size : int or None
        Columns that SuperLU takes together; None for its own choice, 20. It decides the last bits.

    Raises
    ------
    RuntimeError
        The matrix is exactly singular.
    """

    def __init__(
        self,
        matrix: sparse.sparray,
        *,
        pivot_threshold: float = 0.0,
        panel_size: int | None = None,
    ) -> None:
        """Factorise."""
        self._factor: SuperLU = splu(
            sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=pivot_threshold,
            panel_size=panel_size,
            options={"SymmetricMode": True},
        )

    @property
    def exchanged_rows(self) -> bool:
        """Whether a pivot lies off the diagonal: then the factors are not symmetric."""
        return not np.array_equal(self._factor.perm_r, self._factor.perm_c)

    @property
    def pivots(self) -> FloatArray:
        """Diagonal of D, (n,), in the order of elimination."""
        return np.asarray(self._factor.U.diagonal(), dtype=np.float64)

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of the system for one or several right-hand sides.

        Parameters
        ----------
        right : (n,) or (n, b) float64
            Right-hand sides, as columns.

        Returns
        -------
        (n,) or (n, b) float64
            As the right-hand sides are.
        """
        return np.asarray(self._factor.solve(right), dtype=np.float64)
