"""How alike points of two surfaces are: by the windows of signatures, at the scale that fits best.

Windows are taken and compared as retrieval does it (decision 0036), around points of the two
working meshes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray
from workers.retrieval.windows.comparing import Side
from workers.retrieval.windows.signature import (
    KINDS,
    STEP,
    Signature,
    WindowSurface,
    boundary_length,
    signature_of,
)
from workers.retrieval.windows.whitening import Whitening

# Chosen on creatures of the training species.
SCALES = 13  # down to a fifth of the area
_EVERY, _FIRST_POINTS = 2, 48  # scale is looked at first, with so many points
_CLEARLY = 0.985  # of the difference at scale 1: what differs less is a part
_LOST_COUNT = 7.0  # numbers of mean cost that a point counts as if all its windows are lost
_ALL = tuple(range(KINDS))
_HAND = 3.0  # numbers of a window that handedness counts as much as


@dataclass(frozen=True, eq=False)
class Costs:
    """What it costs to match points of one surface with points of another.

    Attributes
    ----------
    values : (s, t) float64
        Mean squared whitened difference of the windows.
    counts : (s,) float64
        How many numbers of each point of the first could be compared.
    """

    values: FloatArray
    counts: FloatArray

    def with_hands(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Costs of the windows together with those of fields that change their sign in a mirror.

        Parameters
        ----------
        first, second : (s, c) and (t, c) float64
            The fields at the points.

        Returns
        -------
        (s, t) float64
        """
        apart = np.square(first[:, None] - second[None]).mean(axis=2)
        counts = self.counts[:, None]
        mixed: FloatArray = (self.values * counts + _HAND * apart) / (counts + _HAND)
        return mixed


@dataclass(frozen=True, eq=False)
class Likeness:
    """How well the points of a surface match those of a larger or equal one.

    Attributes
    ----------
    scale : float
        Lengths on the first, times this, are lengths on the second, both of area 1; at most 1.
    costs : Costs
        Of the points of both.
    own : Costs
        Of the first points of the second surface and all its points.
    difference : float
        How badly the first fits into the second: X of decision 0036.
    """

    scale: float
    costs: Costs
    own: Costs
    difference: float


def compare(part: Surface, whole: Surface, whitening: Whitening, *, may_be_part: bool) -> Likeness:
    """Compare all points of a surface with all points of one that may be larger.

    Parameters
    ----------
    part : Surface
        The one that may be smaller.
    whole : Surface
        The other.
    whitening : Whitening
        How windows are compared.
    may_be_part : bool
        Whether the first may be a part of the second: then its scale is fitted.

    Returns
    -------
    Likeness
        At the scale at which the windows fit best. It is 1 unless another is clearly better. Of
        two sheets the windows of what faces the same way count, too: they are smaller, and fewer
        of them reach a boundary.
    """
    facing = not (part.is_closed or whole.is_closed)
    target = _signature(whole, [0], len(whole.points), facing)
    itself = Side.of(target, whitening, _ALL, points=len(part.points))
    right = itself.right(target.numbers[0])
    scales = [0]
    if may_be_part:
        first = list(range(0, SCALES, _EVERY))
        side = Side.of(_signature(part, first, _FIRST_POINTS, facing), whitening, _ALL)
        every = range(len(first))
        best = first[int(np.argmin(side.differences(every, side.costs(every, right))))]
        scales = sorted({0, max(best - 1, 0), best, min(best + 1, SCALES - 1)})
    side = Side.of(_signature(part, scales, len(part.points), facing), whitening, _ALL)
    every = range(len(scales))
    costs = side.costs(every, right)
    differences = side.differences(every, costs)
    chosen = int(np.argmin(differences))
    if differences[chosen] > _CLEARLY * differences[0]:
        chosen = 0
    return Likeness(
        scale=STEP ** -scales[chosen],
        costs=_costs(side, costs, chosen),
        own=_costs(itself, itself.costs([0], right), 0),
        difference=float(differences[chosen]),
    )


def _signature(surface: Surface, scales: Sequence[int], count: int, facing: bool) -> Signature:
    """Windows around the first points at some scales."""
    taken = WindowSurface(
        mesh=surface.mesh,
        points=surface.points[:count],
        distances=surface.distances[:count],
        areas=surface.weights[:count],
        mutual=surface.mutual[:count, :count],
        boundary=boundary_length(surface.mesh),
        n_vertices=surface.mesh.n_vertices,
    )
    return signature_of(taken, scales, facing=facing)


def _costs(side: Side, costs: NDArray[np.float32], scale: int) -> Costs:
    """Costs at one scale of a side. A point without a window is as unlike all as others are."""
    values, counts = costs[scale].astype(np.float64), side.dimensions[scale].astype(np.float64)
    lost = counts == 0.0
    if lost.any() and not lost.all():
        values[lost], counts[lost] = values[~lost].mean(), _LOST_COUNT
    return Costs(values, counts)
