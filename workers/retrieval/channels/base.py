"""What all channels have in common: a name, a view, a dissimilarity, a scale and a weight."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from workers.diffusion.kernels import Kernel
from workers.errors import InvalidRequestError, SpectrumError
from workers.geometry.arrays import Float32Array, FloatArray, read_only
from workers.geometry.sampling import SAMPLES
from workers.geometry.solution import Solution
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.normalisation import NORMALISATIONS
from workers.retrieval.channels.signatures import Signatures
from workers.retrieval.dissimilarity import find_dissimilarity

NO_CENTRE = "none"


@dataclass(frozen=True, kw_only=True)
class Channel(ABC):
    """One vector of a shape, and how two of them are compared.

    Attributes
    ----------
    feature : str
        What is described, as stored models and the API call it.
    is_reranked : bool
        Compared on the nearest rows of a scan alone, see `workers.retrieval.scan`.
    farthest : float
        D / scale counts as at most so much.
    name : str
        Unique within its model.
    view : str
        Name of the model's view whose working mesh is described.
    normalisation : str
        The scale that is forgotten: "none"; "area" and "first-eigenvalue" scale the surface until
        that is 1; "mean" divides distances, values or eigenvalues by their mean.
    dissimilarity : str
        Gives D, unless a query asks for another.
    scale, weight : float
        D counts as weight · (D / scale)^power in the model's distance.
    """

    feature: ClassVar[str]
    is_reranked: ClassVar[bool] = False
    farthest: ClassVar[float] = math.inf

    name: str
    view: str
    normalisation: str = "none"
    dissimilarity: str = "l1"
    scale: float = 1.0
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Check that the parts fit together."""
        if self.normalisation not in NORMALISATIONS:
            raise self.invalid(
                f"there is no normalisation {self.normalisation!r}; "
                f"there are {', '.join(NORMALISATIONS)}"
            )
        if not (0.0 < self.scale < math.inf and 0.0 <= self.weight < math.inf):
            raise self.invalid(
                f"scale is {self.scale} and weight {self.weight}, expected a finite scale > 0 and "
                "a finite weight >= 0"
            )
        self.check_dissimilarity(self.dissimilarity)

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Numbers in the vector, d."""

    @property
    @abstractmethod
    def axis(self) -> Axis:
        """Where these numbers stand."""

    @property
    def is_distribution(self) -> bool:
        """True for probabilities of bins, False for quantiles, eigenvalues and the like."""
        return False

    @property
    def eigenpairs_needed(self) -> int:
        """Number of eigenpairs without which there is no vector."""
        return 1

    @property
    def signatures_needed(self) -> tuple[tuple[str, Kernel], ...]:
        """Kernels whose k(x,x) is described, each with the normalisation that gives its unit."""
        return ()

    @cached_property
    def widths(self) -> FloatArray:
        """Widths of the bins, (d,); 1 where there are none."""
        widths: FloatArray = read_only(np.ones(self.dimension), np.float64)
        return widths

    def check_dissimilarity(self, name: str) -> None:
        """Refuse a dissimilarity that cannot compare this channel.

        Parameters
        ----------
        name : str
            That a query asks for, or the channel's own.

        Raises
        ------
        InvalidRequestError
            There is none of this name, or it compares distributions and this is none.
        """
        find_dissimilarity(name, distribution=self.is_distribution)

    def describe(self, solution: Solution, signatures: Signatures | None = None) -> Float32Array:
        """Vector of a shape.

        Parameters
        ----------
        solution : Solution
            Of the shape under the channel's view.
        signatures : Signatures, optional
            Of this solution, at least those of `signatures_needed`; computed where they are not
            given. The vector is the same.

        Returns
        -------
        (d,) float32

        Raises
        ------
        SpectrumError
            There are fewer eigenpairs than are needed.
        KernelDomainError
            The kernel is not finite, or negative, on the spectrum, or vanishes on it.
        """
        for one in [part.solution for part in solution.parts] or [solution]:
            found = one.spectrum.n_eigenpairs
            if found < self.eigenpairs_needed:
                raise SpectrumError(
                    f"channel {self.name!r} needs {self.eigenpairs_needed} eigenvalues, but the "
                    f"spectrum of this mesh with {one.mesh.n_vertices} vertices has {found}"
                )
        if signatures is None:
            signatures = Signatures(solution, self.signatures_needed)
        if solution.parts:
            return self.combined(solution, signatures).astype(np.float32)
        return self.vector(solution, signatures).astype(np.float32)

    @abstractmethod
    def combined(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """Vector of a surface of several components.

        Parameters
        ----------
        solution : Solution
            Of the surface; it has parts.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        (d,) float64
        """

    @abstractmethod
    def vector(self, solution: Solution, signatures: Signatures) -> FloatArray:
        """What `describe` rounds, (d,) float64, of a spectrum that is long enough.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view; connected.
        signatures : Signatures
            Of this solution.

        Returns
        -------
        (d,) float64
        """

    def compare(
        self,
        query: NDArray[Any],
        rows: NDArray[Any],
        *,
        dissimilarity: str | None = None,
        dtype: type[np.floating[Any]] = np.float64,
    ) -> FloatArray:
        """D of one vector to others; of each row alone, bit for bit, whatever stands around it.

        Parameters
        ----------
        query : (d,) float
            First argument of a dissimilarity that is not symmetric.
        rows : (n, d) float
            Vectors of the same channel, in any memory order.
        dissimilarity : str, optional
            Instead of the channel's own.
        dtype : type
            In which everything is computed: float64 in a search, float32 in training.

        Returns
        -------
        (n,) of ``dtype``, not negative, 0 for rows equal to the query.

        Raises
        ------
        InvalidRequestError
            See `check_dissimilarity`.
        """
        name = dissimilarity or self.dissimilarity
        compare = find_dissimilarity(name, distribution=self.is_distribution)
        return compare(query, rows, self.widths, dtype=dtype)

    def term(self, dissimilarities: NDArray[Any], *, power: float) -> NDArray[Any]:
        """(D / scale)^power, of which the model's distance is the weighted sum.

        Parameters
        ----------
        dissimilarities : (...) float
            D, not negative; may be infinite where `farthest` is not.
        power : float
            p > 0.

        Returns
        -------
        (...) of the same type
        """
        number = dissimilarities.dtype.type
        scaled = dissimilarities / number(self.scale)
        if self.farthest < math.inf:
            scaled = np.minimum(scaled, number(self.farthest))
        term: NDArray[Any] = scaled if power == 1.0 else np.power(scaled, number(power))
        return term

    def to_json(self) -> dict[str, Any]:
        """As it is stored, and as the API shows it.

        Returns
        -------
        dict
            Plain JSON; the same keys for every type, but for "edges" and "levels".
        """
        return {
            "name": self.name,
            "view": self.view,
            "kernel": None,
            "feature": self.feature,
            "normalisation": self.normalisation,
            **self._axis_to_json(),
            "dissimilarity": self.dissimilarity,
            "scale": self.scale,
            "weight": self.weight,
            "samples": SAMPLES,
            "centre": NO_CENTRE,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        """Return the channel of this type that `to_json` wrote; see `channel_from_json`.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        Channel
            Equal to the one that was written.
        """
        return cls(**cls._fields_from_json(value))

    def invalid(self, what: str) -> InvalidRequestError:
        """Error of this channel, to be raised.

        Parameters
        ----------
        what : str
            What was found and what was expected.

        Returns
        -------
        InvalidRequestError
        """
        return InvalidRequestError(f"channel {self.name!r}: {what}")

    @abstractmethod
    def _axis_to_json(self) -> dict[str, list[float]]:
        """Either "edges" or "levels"."""

    @classmethod
    def _fields_from_json(cls, value: Mapping[str, Any]) -> dict[str, Any]:
        return {
            "name": str(value["name"]),
            "view": str(value["view"]),
            "normalisation": str(value["normalisation"]),
            "dissimilarity": str(value["dissimilarity"]),
            "scale": float(value["scale"]),
            "weight": float(value["weight"]),
        }
