"""The one table of what each transformation does at strengths 1 to 5; docs repeat it.

Shares of area and the growth by noise are what was measured on real SHREC files
(docs/transformations.md says which). Lengths are in units of √A, the square root of the surface
area, so that they depend neither on the unit nor on the resolution.
"""

from collections.abc import Mapping
from types import MappingProxyType

STRENGTHS = (1, 2, 3, 4, 5)

Levels = tuple[float, float, float, float, float]

TABLE: Mapping[str, Mapping[str, Levels]] = MappingProxyType(
    {
        "isometry": {
            "largest rotation, degrees": (25, 40, 55, 70, 85),
        },
        "topology": {
            "fewest welds": (1, 1, 2, 2, 3),
            "most welds": (2, 4, 8, 14, 24),
            "widest gap, √A": (0.03, 0.045, 0.06, 0.08, 0.1),
        },
        "holes": {
            "area left": (0.94, 0.87, 0.79, 0.71, 0.64),
            "discs": (40, 75, 110, 150, 190),
        },
        "micro-holes": {
            "area left": (0.99, 0.98, 0.97, 0.96, 0.95),
        },
        "scale": {
            "factor or its inverse": (1.5, 2, 3, 4, 5),
        },
        "local-scale": {
            "largest local factor or its inverse": (1.25, 1.5, 1.75, 2, 2.25),
            "places": (3, 4, 5, 6, 7),
        },
        "sampling": {
            "faces left": (0.5, 0.25, 0.1, 0.05, 0.02),
        },
        "noise": {
            "growth of area": (1.6, 2.5, 3.5, 4.5, 5.5),
        },
        "shot-noise": {
            "vertices displaced": (0.003, 0.006, 0.01, 0.015, 0.02),
            "farthest displacement, √A": (0.04, 0.05, 0.06, 0.07, 0.08),
        },
        "partial": {
            "area left": (0.95, 0.83, 0.7, 0.58, 0.45),
        },
        "all": {
            "largest rotation, degrees": (15, 20, 25, 30, 35),
            "fewest welds": (1, 1, 1, 1, 1),
            "most welds": (1, 1, 2, 3, 4),
            "widest gap, √A": (0.03, 0.035, 0.04, 0.045, 0.05),
            "largest local factor or its inverse": (1.1, 1.2, 1.3, 1.4, 1.5),
            "places": (2, 2, 3, 3, 4),
            "area left by holes": (0.98, 0.96, 0.93, 0.9, 0.87),
            "discs": (4, 8, 14, 20, 28),
            "vertices displaced": (0.001, 0.002, 0.003, 0.004, 0.005),
            "farthest displacement, √A": (0.03, 0.035, 0.04, 0.045, 0.05),
            "growth of area": (1.1, 1.25, 1.45, 1.7, 2),
            "faces left": (0.8, 0.6, 0.45, 0.35, 0.25),
            "factor or its inverse": (1.2, 1.4, 1.7, 2, 2.5),
        },
        "affine": {
            "longest over shortest axis": (1.2, 1.5, 1.8, 2.2, 2.6),
        },
        "view": {
            "rank of the direction": (0.1, 0.25, 0.4, 0.55, 0.7),
            "most grazing angle, degrees": (88, 85, 82, 78, 74),
        },
        "scan": {
            "rank of the direction": (0.1, 0.25, 0.4, 0.55, 0.7),
            "samples": (20000, 14000, 9000, 5500, 3000),
            "most grazing angle, degrees": (77, 75, 73, 71, 68),
            "rim pixels lost": (0.1, 0.14, 0.18, 0.22, 0.26),
            "noise along the ray, √A": (0.001, 0.0015, 0.002, 0.003, 0.004),
            "step of depth, √A": (0.0002, 0.0004, 0.0006, 0.0008, 0.001),
        },
    }
)

PAPER_TRANSFORMATIONS = tuple(TABLE)[:11]


def settings(transformation: str, strength: int) -> dict[str, float]:
    """The row of the table: what each quantity of a transformation is at a strength.

    Parameters
    ----------
    transformation : str
        A key of `TABLE`.
    strength : int
        1 to 5.

    Returns
    -------
    dict of str to float
        By the name of the quantity, which states its unit.
    """
    return {quantity: levels[strength - 1] for quantity, levels in TABLE[transformation].items()}
