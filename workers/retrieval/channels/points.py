"""Points of a surface, and whether each of a query's has its like on another surface.

A part of a shape has another distribution of signatures than the whole. But at small times the
signature of a point says what its surroundings look like, and they are there on the whole too. So
the query's points are looked for among the candidate's, and not the reverse (decision 9).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from workers.diffusion.kernels import HeatKernel
from workers.geometry.arrays import FloatArray
from workers.geometry.solution import Solution
from workers.retrieval.chamfer import DIRECTED_CHAMFER, directed_chamfer
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.kernel import KernelChannel
from workers.retrieval.channels.normalisation import length_factor, part_factors
from workers.retrieval.channels.signatures import LOG_FLOOR, Signatures, diagonals


@dataclass(frozen=True, kw_only=True)
class PointsChannel(KernelChannel):
    """Heat kernel signature ln k(x,x) at farthest points and at several times.

    Compared by `directed_chamfer`, on the nearest rows of a scan alone. D / scale counts as at
    most 16, which rows that are not looked at have too: so they stay behind (decision 9).

    Attributes
    ----------
    kernel : HeatKernel
        Its time is the unit of the others.
    time_factors : (t,) tuple of float
        Multiples of that time.
    samples : int
        Points; a surface of fewer vertices repeats them.
    """

    feature: ClassVar[str] = "log-diagonal-points"
    is_reranked: ClassVar[bool] = True
    farthest: ClassVar[float] = 16.0

    kernel: HeatKernel
    dissimilarity: str = DIRECTED_CHAMFER
    time_factors: tuple[float, ...]
    samples: int

    def __post_init__(self) -> None:
        """Check kernel, times and points too."""
        super().__post_init__()
        if not isinstance(self.kernel, HeatKernel):
            raise self.invalid(f"points have a heat kernel, but this one is {self.kernel.kind}")
        if not self.time_factors or not all(0.0 < one < np.inf for one in self.time_factors):
            raise self.invalid(
                f"levels are {self.time_factors}, expected at least 1, all above 0 for points"
            )
        if self.samples < 1:
            raise self.invalid(f"{self.samples} samples asked for, expected at least 1")

    @property
    def dimension(self) -> int:
        """Points times times."""
        return len(self.time_factors) * self.samples

    @property
    def axis(self) -> Axis:
        """The times, in the inverse unit of λ."""
        return Axis("times", tuple(self.kernel.time * one for one in self.time_factors))

    def check_dissimilarity(self, name: str) -> None:
        """Refuse every other dissimilarity than `directed_chamfer`.

        Parameters
        ----------
        name : str
            That is asked for.

        Raises
        ------
        InvalidRequestError
            It is another one.
        """
        if name != DIRECTED_CHAMFER:
            raise self.invalid(f"points are compared by {DIRECTED_CHAMFER!r} alone, not {name!r}")

    def vector(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Signatures of the points, one point after the other.

        Parameters
        ----------
        solution : Solution
            Has the points.
        signatures : Signatures
            Not used.

        Returns
        -------
        (samples · t,) float64
        """
        factor = length_factor(solution.spectrum, self.normalisation)
        return self._logarithms(solution, factor, self.samples).ravel()

    def combined(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Signatures of points of all components: of each as many as its weight is worth.

        Parameters
        ----------
        solution : Solution
            Its parts have the points.
        signatures : Signatures
            Not used.

        Returns
        -------
        (samples · t,) float64
        """
        parts = solution.parts
        counts = shared_out(self.samples, [part.weight for part in parts])
        factors = part_factors(parts, self.normalisation)
        found = [
            self._logarithms(part.solution, factor, count) + rest
            for part, (factor, rest), count in zip(parts, factors, counts, strict=True)
            if count
        ]
        all_of_them: FloatArray = np.concatenate(found).ravel()
        return all_of_them

    def _logarithms(self, solution: Solution, factor: float, count: int) -> FloatArray:
        """Signatures (count, t) of farthest points of a connected surface, in a scale."""
        kernels = [(HeatKernel(one * self.kernel.time), factor) for one in self.time_factors]
        points = np.resize(solution.farthest_points(count), count)
        values = diagonals(solution.spectrum, kernels, points)  # (t, count)
        area = solution.spectrum.area * factor**2
        logarithms: FloatArray = np.log(values + LOG_FLOOR / area).T
        return logarithms

    def compare(
        self,
        query: NDArray[Any],
        rows: NDArray[Any],
        *,
        dissimilarity: str | None = None,
        dtype: type[np.floating[Any]] = np.float64,
    ) -> FloatArray:
        """Directed Chamfer distance from the query's points to those of each row.

        Parameters
        ----------
        query : (d,) float
            The vector whose points are looked for.
        rows : (n, d) float
            Vectors among whose points they are looked for.
        dissimilarity : str, optional
            No other one.
        dtype : type
            To which float64 is rounded.

        Returns
        -------
        (n,) of ``dtype``

        Raises
        ------
        InvalidRequestError
            Another dissimilarity is asked for.
        """
        self.check_dissimilarity(dissimilarity or self.dissimilarity)
        found = directed_chamfer(query, rows, len(self.time_factors))
        return np.asarray(found, dtype=dtype)

    def to_json(self) -> dict[str, Any]:
        """As it is stored, with the number of points.

        Returns
        -------
        dict
        """
        return super().to_json() | {"samples": self.samples}

    def _axis_to_json(self) -> dict[str, list[float]]:
        return {"levels": list(self.time_factors)}

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return super()._fields_from_json(value) | {
            "time_factors": tuple(float(level) for level in value["levels"]),
            "samples": int(value["samples"]),
        }


def shared_out(total: int, weights: Sequence[float]) -> list[int]:
    """Share out a number of points by weight, the remainders to the largest fractions.

    Parameters
    ----------
    total : int
        Points.
    weights : sequence of float
        They sum to 1.

    Returns
    -------
    list of int
        They sum to the total; of equal fractions the first come first.
    """
    exact = total * np.asarray(weights) / np.sum(weights)
    counts = np.floor(exact).astype(np.int64)
    largest = np.argsort(counts - exact, kind="stable")
    counts[largest[: total - int(counts.sum())]] += 1
    return [int(count) for count in counts]
