"""How rough a working mesh is, and what its view therefore counts for a query (decision 16)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workers.diffusion.kernels import Kernel
from workers.errors import InvalidRequestError
from workers.geometry.arrays import Float32Array, FloatArray
from workers.geometry.sampling import SAMPLES
from workers.geometry.smoothing import roughness
from workers.geometry.solution import Solution
from workers.retrieval.channels.axis import Axis
from workers.retrieval.channels.base import NO_CENTRE
from workers.retrieval.channels.signatures import Signatures


@dataclass(frozen=True)
class RoughnessLimits:
    """Between which roughnesses of a query the channels of a view lose their weight.

    A descriptor has the roughness of this view's working mesh behind all channels. It is never
    compared. Stored models and the API list it among the channels, with the weight 0.

    Attributes
    ----------
    view : str
        Name of the model's view.
    lower : float
        Up to here its channels have their weights in full.
    upper : float
        From here on they have none.
    """

    feature: ClassVar[str] = "roughness"
    normalisation: ClassVar[str] = "none"
    dimension: ClassVar[int] = 1
    axis: ClassVar[Axis] = Axis("index", (1.0,))

    view: str
    lower: float
    upper: float

    def __post_init__(self) -> None:
        """Check the limits."""
        if not 0.0 <= self.lower < self.upper < np.inf:
            raise InvalidRequestError(
                f"roughness limits of view {self.view!r} are {self.lower} and {self.upper}, "
                "expected two finite numbers >= 0 that ascend"
            )

    @property
    def name(self) -> str:
        """Its name among the channels."""
        return f"{self.view}: roughness"

    @property
    def signatures_needed(self) -> tuple[tuple[str, Kernel], ...]:
        """None."""
        return ()

    def describe(self, solution: Solution, signatures: Signatures | None = None) -> Float32Array:
        """Roughness of the working mesh, see `workers.geometry.smoothing.roughness`.

        Of several components it is the mean, by weight.

        Parameters
        ----------
        solution : Solution
            Of the shape under the view.
        signatures : Signatures, optional
            Not used.

        Returns
        -------
        (1,) float32
        """
        if not solution.parts:
            return np.array([roughness(solution.mesh)], dtype=np.float32)
        found = sum(part.weight * roughness(part.solution.mesh) for part in solution.parts)
        return np.array([found], dtype=np.float32)

    def kept_share(self, found: FloatArray) -> FloatArray:
        """Share of their weights that the view's channels keep, linear between the limits.

        Parameters
        ----------
        found : (q,) float64
            Roughness of queries.

        Returns
        -------
        (q,) float64, in [0, 1]
        """
        return np.clip((self.upper - found) / (self.upper - self.lower), 0.0, 1.0)

    def to_json(self) -> dict[str, Any]:
        """As it is stored among the channels.

        Returns
        -------
        dict
            Plain JSON with the keys of a channel, and the weight 0.
        """
        return {
            "name": self.name,
            "view": self.view,
            "kernel": None,
            "feature": self.feature,
            "normalisation": self.normalisation,
            "levels": [self.lower, self.upper],
            "dissimilarity": "l1",
            "scale": 1.0,
            "weight": 0.0,
            "samples": SAMPLES,
            "centre": NO_CENTRE,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "RoughnessLimits":
        """Return the limits that `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        RoughnessLimits
            Equal to those that were written.

        Raises
        ------
        InvalidRequestError
            They are none.
        """
        try:
            lower, upper = (float(level) for level in value["levels"])
            return cls(str(value["view"]), lower, upper)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InvalidRequestError(f"roughness limits cannot be read: {error!r}") from error
