"""Dissimilarities of descriptors, section 2.5, row by row and bit for bit the same anywhere.

A row is either a distribution (probabilities of bins, with the bins' widths) or a plain vector.
Nothing here multiplies matrices, and every row is summed by itself, contiguous in memory. So a
row's result depends on no other row and not on how many there are.

Each comparison below takes a query (1, d), a block of rows (c, d) and the widths of the bins (d,).
It returns (c,). `DISSIMILARITIES` applies them to a matrix of any length.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray


class Dissimilarity(Protocol):
    """What compares a query with the rows of a matrix."""

    def __call__(
        self,
        query: NDArray[Any],
        matrix: NDArray[Any],
        widths: NDArray[Any],
        *,
        dtype: type[np.floating[Any]] = np.float64,
    ) -> FloatArray:
        """Dissimilarities of rows (n, d) from a query (d,), bins being as wide as (d,) widths.

        Parameters
        ----------
        query : (d,) float
        matrix : (n, d) float
        widths : (d,) float
        dtype : type
            In which everything is computed.

        Returns
        -------
        (n,) of ``dtype``, not negative, 0 for rows equal to the query.
        """
        ...


EPSILON = 1e-6
"""Probability added to every bin (then normalised again) where an empty one would be infinite."""

CHUNK_ELEMENTS = 1 << 16
"""Entries of the matrix that are worked on at once: half a megabyte, so that they stay in cache."""


def _l1(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """∫|f - g|: of masses, so that the widths cancel."""
    return _sums(np.abs(p - q))


def _l2(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """(∫|f - g|²)^½ of the densities."""
    return np.sqrt(_squared_norm(p - q, widths))


def _linf(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """Largest |f - g| of the densities."""
    return _largest(np.abs(p - q) / widths)


def _normalised_l1(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """‖f - g‖₁ / (‖f‖₁ + ‖g‖₁), in [0, 1]."""
    return _ratio(_l1(p, q, widths), _sums(np.abs(p)) + _sums(np.abs(q)))


def _normalised_l2(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """‖f - g‖₂ / (‖f‖₂ + ‖g‖₂), in [0, 1]."""
    norms = np.sqrt(_squared_norm(p, widths)) + np.sqrt(_squared_norm(q, widths))
    return _ratio(_l2(p, q, widths), norms)


def _kullback_leibler(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """Σ p ln(p/q) of the query p against the row q, both with `EPSILON` in every bin."""
    p, q = _smoothed(p), _smoothed(q)
    return np.maximum(_sums(p * np.log(p / q)), 0.0)


def _jensen_shannon(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """Root of the Jensen-Shannon divergence in nats: a metric, at most √ln 2."""
    p, q = _probabilities(p), _probabilities(q)
    middle = 0.5 * (p + q)
    divergence = 0.5 * _sums(_entropy_terms(p, middle) + _entropy_terms(q, middle))
    return np.sqrt(np.maximum(divergence, 0.0))


def _bhattacharyya(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """-ln Σ √(pq), both with `EPSILON` in every bin, so that disjoint ones stay finite."""
    return -np.log1p(-np.minimum(_squared_hellinger(_smoothed(p), _smoothed(q)), 1.0 - EPSILON**2))


def _hellinger(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """(½ Σ (√p - √q)²)^½, in [0, 1]."""
    return np.sqrt(_squared_hellinger(_probabilities(p), _probabilities(q)))


def _chi_squared(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """½ Σ (p - q)² / (p + q), the symmetric form; bins that are empty in both count nothing."""
    return 0.5 * _sums(_ratio(np.square(p - q), p + q))


def _earth_movers(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """Earth mover's distance of the normalised masses, each at the centre of its bin."""
    gaps = 0.5 * (widths[1:] + widths[:-1])  # (d - 1,)
    flow = np.cumsum(_probabilities(p) - _probabilities(q), axis=1)[:, :-1]  # (c, d - 1)
    return _sums(np.abs(flow) * gaps)


def _kolmogorov_smirnov(p: FloatArray, q: FloatArray, widths: FloatArray) -> FloatArray:
    """Largest |F - G| of the normalised cumulative distributions, in [0, 1]."""
    return _largest(np.abs(np.cumsum(_probabilities(p) - _probabilities(q), axis=1)))


def _sums(values: FloatArray) -> FloatArray:
    """Sum of each row, (c,); contiguous rows are added up in one order, however many there are."""
    sums: FloatArray = np.ascontiguousarray(values).sum(axis=1)
    return sums


def _largest(values: FloatArray) -> FloatArray:
    """Largest entry of each row, (c,)."""
    largest: FloatArray = values.max(axis=1)
    return largest


def _squared_norm(values: FloatArray, widths: FloatArray) -> FloatArray:
    """∫f² of masses, (c,)."""
    return _sums(np.square(values) / widths)


def _ratio(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Entry by entry, 0 where the denominator is not above 0."""
    return np.divide(numerator, denominator, out=np.zeros(numerator.shape), where=denominator > 0.0)


def _probabilities(masses: FloatArray) -> FloatArray:
    """Rows that sum to 1; an empty row stays empty."""
    totals = np.broadcast_to(masses.sum(axis=1, keepdims=True), masses.shape)
    return _ratio(masses, totals)


def _smoothed(masses: FloatArray) -> FloatArray:
    """Rows that sum to 1 without an empty bin."""
    smoothed: FloatArray = _probabilities(masses) + EPSILON
    return _probabilities(smoothed)


def _entropy_terms(p: FloatArray, middle: FloatArray) -> FloatArray:
    """Terms p ln(p/m), 0 where p is 0; of the shape of m."""
    quotient = np.divide(p, middle, out=np.ones(middle.shape), where=p > 0.0)
    terms: FloatArray = p * np.log(quotient)
    return terms


def _squared_hellinger(p: FloatArray, q: FloatArray) -> FloatArray:
    """½ Σ (√p - √q)², exactly 0 for equal rows, unlike 1 - Σ √(pq)."""
    return 0.5 * _sums(np.square(np.sqrt(p) - np.sqrt(q)))


def _by_rows(compare: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]) -> Dissimilarity:
    """Apply a comparison of (c, d) blocks to a matrix of any length, in bounded memory."""

    def compare_rows(
        query: NDArray[Any],
        matrix: NDArray[Any],
        widths: NDArray[Any],
        *,
        dtype: type[np.floating[Any]] = np.float64,
    ) -> NDArray[Any]:
        first = np.array(query, dtype=dtype, order="C").reshape(1, -1)  # (1, d)
        widths = np.asarray(widths, dtype=dtype)
        n, rows = len(matrix), max(1, CHUNK_ELEMENTS // max(1, first.shape[1]))
        result = np.empty(n, dtype=dtype)
        for start in range(0, n, rows):
            block = np.array(matrix[start : start + rows], dtype=dtype, order="C")
            result[start : start + rows] = compare(first, block, widths)
        return result

    compare_rows.__doc__ = compare.__doc__
    return compare_rows


DISSIMILARITIES: Mapping[str, Dissimilarity] = MappingProxyType(
    {
        "l1": _by_rows(_l1),
        "l2": _by_rows(_l2),
        "linf": _by_rows(_linf),
        "normalised-l1": _by_rows(_normalised_l1),
        "normalised-l2": _by_rows(_normalised_l2),
        "kullback-leibler": _by_rows(_kullback_leibler),
        "jensen-shannon": _by_rows(_jensen_shannon),
        "bhattacharyya": _by_rows(_bhattacharyya),
        "hellinger": _by_rows(_hellinger),
        "chi-squared": _by_rows(_chi_squared),
        "earth-movers": _by_rows(_earth_movers),
        "kolmogorov-smirnov": _by_rows(_kolmogorov_smirnov),
    }
)
"""Every dissimilarity by its name; `find_dissimilarity` explains a name that is not here."""

VECTOR_DISSIMILARITIES = ("l1", "l2", "linf")
"""Those that compare plain vectors too: eigenvalues, quantiles."""


def find_dissimilarity(name: str, *, distribution: bool = True) -> Dissimilarity:
    """Dissimilarity of a name, for distributions or for plain vectors.

    Parameters
    ----------
    name : str
        One of `DISSIMILARITIES`.
    distribution : bool
        False if the rows are quantiles, eigenvalues or the like.

    Returns
    -------
    Dissimilarity
        Compares a query with the rows of a matrix.

    Raises
    ------
    InvalidRequestError
        There is none of this name, or it compares distributions and the rows are none.
    """
    if name not in DISSIMILARITIES:
        raise InvalidRequestError(
            f"there is no dissimilarity {name!r}; there are {', '.join(DISSIMILARITIES)}"
        )
    if not distribution and name not in VECTOR_DISSIMILARITIES:
        raise InvalidRequestError(
            f"the dissimilarity {name!r} compares distributions, but the model describes shapes by "
            f"eigenvalues or quantiles; possible are {', '.join(VECTOR_DISSIMILARITIES)}"
        )
    return DISSIMILARITIES[name]
