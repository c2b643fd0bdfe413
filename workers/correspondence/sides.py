"""Which of two shapes is a part of the other, and how alike their points are."""

from dataclasses import dataclass

from workers.correspondence.handedness import alike_in_size, handedness
from workers.correspondence.likeness import Costs, compare
from workers.correspondence.surface import Surface
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.geometry.topology import count_components, is_closed
from workers.retrieval.windows.whitening import Whitening

POINTS, MORE_POINTS = 96, 192  # of the part and of the whole; chosen on creatures


@dataclass(frozen=True, eq=False)
class Sides:
    """Two shapes, the one that may be a part first.

    Attributes
    ----------
    part, whole : Surface
        They may also be two wholes.
    is_swapped : bool
        Whether the part is the second of the shapes as they were given.
    scale : float
        Lengths on the part, times this, are lengths on the whole, both of area 1.
    is_part : bool
        Whether the scale says that something of the whole is missing.
    costs : Costs
        Of the points of both.
    own : Costs
        Of the first points of the whole and all its points.
    hands : (n, c) and (m, c) float64
        Fields of both that change their sign in a mirror.
    """

    part: Surface
    whole: Surface
    is_swapped: bool
    scale: float
    is_part: bool
    costs: Costs
    own: Costs
    hands: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, first: Solution, second: Solution, whitening: Whitening) -> "Sides":
        """Find out which shape is a part of the other, and at which scale.

        Parameters
        ----------
        first, second : Solution
            Working meshes with their spectra.
        whitening : Whitening
            How windows are compared.

        Returns
        -------
        Sides
        """
        may_be_part = _may_be_part(first, second), _may_be_part(second, first)
        tried = []
        for swapped in [False, True] if all(may_be_part) else [may_be_part[1]]:
            part, whole = (second, first) if swapped else (first, second)
            one, other = Surface.of(part, POINTS), Surface.of(whole, MORE_POINTS)
            likeness = compare(one, other, whitening, may_be_part=any(may_be_part))
            tried.append((likeness, swapped, one, other))
        found, is_swapped, one, other = min(tried, key=lambda way: way[0].difference)
        is_part = found.scale < 1.0
        hands = alike_in_size(
            handedness(one, found.scale, is_local=is_part),
            handedness(other, 1.0, is_local=is_part),
        )
        return cls(one, other, is_swapped, found.scale, is_part, found.costs, found.own, hands)


def _may_be_part(one: Solution, other: Solution) -> bool:
    """Whether a shape has a boundary, or fewer components than another."""
    if not is_closed(one.mesh):
        return True
    return count_components(one.mesh) < count_components(other.mesh)
