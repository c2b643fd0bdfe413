"""Costs of matching points of two surfaces by what lies around them.

This is where a better comparison of windows takes the place of this one: `candidates` is all that
the rest of the package uses.
"""

from dataclasses import dataclass

import numpy as np

from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.moments import NUMBERS, STEADY, EdgeMasses, windows

# Chosen on creatures of the training species; in √A of the larger surface.
RADII = np.array([0.08, 0.12, 0.18, 0.27])
PART_RADII = np.array([0.06, 0.09, 0.13, 0.19])  # smaller: fewer windows reach the cut

# The ratio of the lengths that are tried: a part has at least a fifth of the area.
STEP, STEPS = 1.07, 13

# Typical differences of the seven numbers between corresponding points of two poses.
_SIZES = np.array([0.5, 0.12, 0.1, 0.1, 0.06, 0.2, 0.12])
_LADDER: FloatArray = 0.05 * np.power(
    1.17, np.arange(15.0)
)  # radii on a surface whose scale is not known
_WHOLE, _USABLE = 0.1, 0.6  # truncation below which all numbers count, or the steady ones
_POWER = 0.25  # of the costs: points without any likeness count little


@dataclass(frozen=True, eq=False)
class Candidates:
    """How well the points of a surface match those of a larger or equal one.

    Attributes
    ----------
    scale : float
        Lengths on the first, times this, are lengths on the second, both of area 1; at most 1.
    costs : (s, t) float64
        Mean squared difference of the windows in their usual sizes.
    counts : (s,) float64
        How many numbers of each point of the first could be compared.
    misfit : float
        How badly the first fits into the second: the smaller the better.
    """

    scale: float
    costs: FloatArray
    counts: FloatArray
    misfit: float


def candidates(part: Surface, whole: Surface, *, is_part: bool) -> Candidates:
    """Compare all points of a surface with all points of one that may be larger.

    Parameters
    ----------
    part : Surface
        The one that may be smaller.
    whole : Surface
        The other.
    is_part : bool
        Whether the first may be a part of the second: then its scale is fitted.

    Returns
    -------
    Candidates
        At the scale at which the windows fit best.
    """
    if not is_part:
        return _compared(part, _described(part, RADII), _described(whole, RADII), 1.0)
    target = _described(whole, PART_RADII)
    ladder = _described(part, _LADDER)
    scales: FloatArray = np.power(STEP, -np.arange(STEPS, dtype=np.float64))
    tried = [_compared(part, _between(ladder, PART_RADII / s), target, float(s)) for s in scales]
    return min(tried, key=lambda one: one.misfit)


_Described = tuple[FloatArray, FloatArray]
"""Numbers (s, r, 7) and truncation (s, r) of windows."""


def _described(surface: Surface, radii: FloatArray) -> _Described:
    """Windows around all points of a surface."""
    masses = EdgeMasses.of(surface.mesh)
    found = windows(surface.mesh, masses, surface.points, surface.distances, radii, facing=False)
    return found.numbers, found.truncation


def _between(ladder: _Described, radii: FloatArray) -> _Described:
    """Windows of other radii than those of the ladder, interpolated; larger ones are no use."""
    steps, wanted = np.log(_LADDER), np.log(radii)
    lower = np.clip(np.searchsorted(steps, wanted) - 1, 0, len(steps) - 2)
    share = np.clip((wanted - steps[lower]) / (steps[lower + 1] - steps[lower]), 0.0, 1.0)
    numbers, truncation = ladder
    weights = share[:, None]
    between = numbers[:, lower] * (1.0 - weights) + numbers[:, lower + 1] * weights
    cut = truncation[:, lower] * (1.0 - share) + truncation[:, lower + 1] * share
    cut[:, radii > _LADDER[-1] * 1.01] = 1.0
    return between, cut


def _compared(part: Surface, one: _Described, other: _Described, scale: float) -> Candidates:
    """Costs at one scale."""
    numbers, truncation = one
    used = np.zeros(numbers.shape)
    used[truncation < _WHOLE] = 1.0
    used[..., list(STEADY)] = np.maximum(
        used[..., list(STEADY)], (truncation < _USABLE)[:, :, None]
    )
    size = numbers.shape[1] * NUMBERS
    first = (numbers / _SIZES).reshape(-1, size)
    second = (other[0] / _SIZES).reshape(-1, size)
    mask = used.reshape(-1, size)
    sums = (mask * first**2).sum(axis=1)[:, None] - 2.0 * (mask * first) @ second.T
    sums = np.maximum(sums + mask @ (second**2).T, 0.0)  # (s, t)
    counts = mask.sum(axis=1)
    costs = sums / np.maximum(counts, 1.0)[:, None]
    weights = part.weights * np.sqrt(counts)
    total = max(float(weights.sum()), 1e-30)
    misfit = float((costs.min(axis=1) ** _POWER * weights).sum() / total)
    return Candidates(scale, costs, counts, misfit if counts.any() else np.inf)
