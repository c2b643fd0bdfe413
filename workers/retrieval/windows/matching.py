"""What a model knows of windows: how they are compared, and how much they count."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workers.errors import InvalidRequestError
from workers.geometry.views import View
from workers.retrieval.windows.signature import WINDOWS_VERSION
from workers.retrieval.windows.trust import Trust
from workers.retrieval.windows.whitening import Whitening


@dataclass(frozen=True, eq=False)
class WindowMatching:
    """Part of a model.

    Attributes
    ----------
    view : View
        How a mesh is prepared before its windows are taken.
    whitening : Whitening
        How windows are compared.
    trust : Trust
        How much they count.
    impostor_quantiles : tuple of float
        As those of `Model`, of distances with all evidence.
    version : str
        Of the signatures.
    """

    view: View
    whitening: Whitening
    trust: Trust
    impostor_quantiles: tuple[float, ...] = ()
    version: str = WINDOWS_VERSION

    def __eq__(self, other: object) -> bool:
        """Whether both are written alike."""
        return isinstance(other, WindowMatching) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        """Hash of the views and versions."""
        return hash((self.view.key, self.version))

    def to_json(self) -> dict[str, Any]:
        """Plain JSON.

        Returns
        -------
        dict
        """
        return {
            "view": self.view.to_json(),
            "whitening": self.whitening.to_json(),
            "trust": self.trust.to_json(),
            "impostor_quantiles": list(self.impostor_quantiles),
            "version": self.version,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "WindowMatching":
        """Return what `to_json` wrote.

        Parameters
        ----------
        value : Mapping
            Plain JSON.

        Returns
        -------
        WindowMatching

        Raises
        ------
        InvalidRequestError
            It is none.
        """
        try:
            return cls(
                View.from_json(value["view"]),
                Whitening.from_json(value["whitening"]),
                Trust.from_json(value["trust"]),
                tuple(float(one) for one in value["impostor_quantiles"]),
                str(value["version"]),
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InvalidRequestError(f"windows of a model cannot be read: {error!r}") from error
