"""The figures that the paper reports."""

from collections.abc import Mapping
from types import MappingProxyType

TITLE = "Deformable shape retrieval by learning diffusion kernels"
AUTHORS = "Aflalo, A. Bronstein, M. Bronstein, Kimmel"
BEST_TIME = 1011.0
"""t*, in the square of its shapes' unit of length."""

COLUMNS = ("heat-short", "heat-best", "heat-long", "learned", "commute")
"""Heat at t = 700, at t* = 1011, at t = 1700; optimal non-parametric; commute time."""

_ROWS: dict[str, tuple[float, float, float, float, float]] = {
    "isometry": (100.0, 100.0, 99.23, 98.21, 97.95),
    "topology": (91.28, 86.79, 80.36, 77.33, 79.16),
    "holes": (82.3, 87.81, 90.33, 72.48, 73.94),
    "micro-holes": (100.0, 100.0, 100.0, 100.0, 100.0),
    "scale": (30.97, 32.44, 32.66, 100.0, 100.0),
    "local-scale": (65.64, 70.73, 70.79, 67.92, 68.22),
    "sampling": (100.0, 100.0, 99.23, 98.21, 98.21),
    "noise": (99.23, 98.46, 100.0, 100.0, 100.0),
    "shot-noise": (99.23, 99.23, 100.0, 99.23, 98.65),
    "partial": (5.54, 6.01, 7.37, 8.06, 31.03),
    "all": (64.15, 69.56, 64.36, 64.66, 64.51),
}
TABLE: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {name: dict(zip(COLUMNS, row, strict=True)) for name, row in _ROWS.items()}
)
"""Table 1: mean average precision in per cent, by transformation and column."""


def row_mean(column: str) -> float:
    """Mean of a column's eleven rows, in per cent; the paper does not print it."""
    return sum(row[column] for row in TABLE.values()) / len(TABLE)


SLIPS = (
    "The kernel k is written with K in eq. (2) and with K² from section 3 on; Proteus has K² only.",
    "Eq. (12) has lost the second ∇: R is made of ∇sᵢ ∇sⱼ.",
    "The closed form of eq. (13) minimises (P + ηR)/N, not the line above it, P/N + ηR.",
    "Eq. (13) drops the constraint K² ≥ 0 of eq. (10), and its plain eigenvector does become "
    "negative; here the coefficients of the splines are kept at least 0.",
    "“A′Φ′ = diag(λ′) W′Φ′” should read W′Φ′ = A′Φ′Λ′.",
    "Under scaling by α, φ becomes φ/α and λ becomes λ/α²; K²(λα⁻²)α⁻² = K²(λ) holds for "
    "K² = 1/λ, as the paper says.",
    "All zero eigenpairs are dropped, one a component, not the first alone.",
    "The splines are taken in ln λ, in which eigenvalues spread evenly enough.",
)
"""Slips of the paper and choices that it leaves open, with what Proteus does."""
