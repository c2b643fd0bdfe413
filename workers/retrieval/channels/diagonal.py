"""The distribution of k(x,x), section 4 of the paper (fourth experiment)."""

from dataclasses import dataclass
from typing import ClassVar

from workers.diffusion.kernels import Kernel
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.retrieval.channels.distribution import DistributionChannel
from workers.retrieval.channels.signatures import Signatures


@dataclass(frozen=True, kw_only=True)
class DiagonalChannel(DistributionChannel):
    """Distribution of k(x,x) over all vertices, by area."""

    feature: ClassVar[str] = "diagonal-distribution"

    @property
    def signatures_needed(self) -> tuple[tuple[str, Kernel], ...]:
        """That of its kernel."""
        return ((self.normalisation, self.kernel),)

    def values(
        self, solution: Solution, signatures: Signatures
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Values k(x,x), each with the area of its vertex.

        Parameters
        ----------
        solution : Solution
            Not used: all vertices count.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        list of (values, weights), (n,) float64 each
            Of every component, or of the surface alone where it is connected.
        """
        found = signatures.of(self.normalisation, self.kernel)
        return [(signature.values, signature.areas) for signature in found]
