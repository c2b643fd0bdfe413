"""The distribution of k(x,x), section 4 of the paper (fourth experiment)."""

from dataclasses import dataclass
from typing import ClassVar

from workers.diffusion.distances import diagonal_signature
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.channels.distribution import DistributionChannel


@dataclass(frozen=True, kw_only=True)
class DiagonalChannel(DistributionChannel):
    """Distribution of k(x,x) over all vertices, by area."""

    feature: ClassVar[str] = "diagonal-distribution"

    def values(self, solution: Solution, spectrum: Spectrum) -> tuple[FloatArray, FloatArray]:
        """Values k(x,x), each with the area of its vertex.

        Parameters
        ----------
        solution : Solution
            Not used: all vertices count.
        spectrum : Spectrum
            Normalised.

        Returns
        -------
        values, weights : (n,) float64
        """
        return diagonal_signature(spectrum, self.kernel), spectrum.areas
