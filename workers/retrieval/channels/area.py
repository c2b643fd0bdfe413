"""The area: the one channel that sees nothing but scale."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.base import Channel
from workers.retrieval.channels.signatures import Signatures


@dataclass(frozen=True, kw_only=True)
class AreaChannel(Channel):
    """Logarithm of the surface's area, in the mesh's own unit."""

    feature: ClassVar[str] = "area"

    @property
    def dimension(self) -> int:
        """One number."""
        return 1

    @property
    def axis(self) -> Axis:
        """Its place."""
        return Axis("index", (1.0,))

    def vector(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Logarithm of the area.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view.
        signatures : Signatures
            Not used.

        Returns
        -------
        (1,) float64
        """
        logarithm: FloatArray = np.log([solution.spectrum.area])
        return logarithm

    def combined(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Logarithm of the area of all components together.

        Parameters
        ----------
        solution : Solution
            Of the surface; it has parts.
        signatures : Signatures
            Not used.

        Returns
        -------
        (1,) float64
        """
        area = sum(part.copies * part.solution.spectrum.area for part in solution.parts)
        logarithm: FloatArray = np.log([area])
        return logarithm

    def _axis_to_json(self) -> dict[str, list[float]]:
        return {"levels": [1.0]}
