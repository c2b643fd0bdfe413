"""What a training has one part of: a pair of shapes, or a variant of one."""

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

from workers.creatures import CREATURES_VERSION
from workers.geometry.views import View
from workers.retrieval.model import Model
from workers.retrieval.windows.signature import WINDOWS_VERSION
from workers.training.bank import POWER
from workers.training.candidates import candidate_model
from workers.training.correspondence import CORRESPONDENCE_VERSION
from workers.training.sources import (
    Change,
    Simulation,
    Source,
    StoredSource,
    change_from_json,
    source_from_json,
)
from workers.transformations import TRANSFORMATION_VERSION

PAIR_VERSION = "1"
"""Part of the key of a pair's moments: raised when the same pair gets other moments."""

PAIR_VERSIONS: Mapping[str, str] = {
    "correspondence": CORRESPONDENCE_VERSION,
    "creatures": CREATURES_VERSION,
    "pairs": PAIR_VERSION,
    "transformations": TRANSFORMATION_VERSION,
}
"""What the training of a kernel depends on, besides preparation and solver."""

VARIANT_VERSION = "2"
"""Part of the key of a variant's descriptor: raised when the same variant gets another one."""

POINTS_VERSION = "1"
"""Part of the key of a variant with windows: raised when it gets other pairs of points."""

VARIANT_VERSIONS: Mapping[str, str] = {
    "creatures": CREATURES_VERSION,
    "transformations": TRANSFORMATION_VERSION,
    "variants": VARIANT_VERSION,
}
"""What the training of a bank depends on, besides what its descriptors depend on."""


@dataclass(frozen=True)
class Example(ABC):
    """A shape to learn from; a part of a job computes what is learned of it.

    Attributes
    ----------
    number : int
        Place in the training; what is computed is summed in this order.
    item : str
        What people call it.
    source : CreatureSource or StoredSource
        The shape.
    """

    kind: ClassVar[str]
    """Kind of the parts that compute it, and the folder of what is stored of it."""

    number: int
    item: str
    source: Source

    @property
    @abstractmethod
    def key(self) -> str:
        """Digest of all that the result depends on: equal examples are computed once."""

    @classmethod
    @abstractmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """Return the example that `to_payload` wrote.

        Parameters
        ----------
        payload : mapping of str
            Of a part of a job.

        Returns
        -------
        Example
        """

    def to_payload(self) -> dict[str, Any]:
        """Return plain JSON that `from_payload` reads.

        Returns
        -------
        dict
            Every field.
        """
        return {field.name: _to_json(getattr(self, field.name)) for field in fields(self)}


@dataclass(frozen=True)
class Pair(Example):
    """A shape and a transformation of it: what a kernel is learned from.

    Attributes
    ----------
    label : str
        Class of the shape.
    change : Simulation or StoredSource
        The transformation.
    view : View
        Under which both are solved.
    criterion : str
        Of the learning: what moments are taken of.
    """

    kind = "pair"

    label: str
    change: Change
    view: View
    criterion: str

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """Return the pair that `to_payload` wrote.

        Parameters
        ----------
        payload : mapping of str
            Of a part of a job.

        Returns
        -------
        Pair
        """
        return cls(
            number=payload["number"],
            item=payload["item"],
            label=payload["label"],
            source=source_from_json(payload["source"]),
            change=change_from_json(payload["change"]),
            view=View.from_json(payload["view"]),
            criterion=payload["criterion"],
        )

    @property
    def key(self) -> str:
        """Digest of all that the pair's moments depend on."""
        return _digest(
            {
                "source": _to_json(self.source),
                "change": _to_json(self.change),
                "view": self.view.key,
                "criterion": self.criterion,
                "versions": dict(PAIR_VERSIONS),
            }
        )


@dataclass(frozen=True)
class Variant(Example):
    """A shape as it is, or a transformed copy of it: what a bank is learned from.

    Attributes
    ----------
    group : str
        Species, or label: what is held out as one.
    lenient : bool
        Others of its group are no impostors.
    reference : int
        Number of the variant that is the shape as it is; the variant's own for that.
    change : Simulation or None
        None for the shape as it is.
    views : tuple of View
        Under which it is described.
    windows : View or None
        Under which its windows are taken, too. Then it is one that windows are learned from, and
        the bank is not.
    paired : bool
        Whether points of it are paired with those of copies, as whitening is learned from.
    """

    kind = "variant"

    group: str
    lenient: bool
    reference: int
    change: Simulation | None
    views: tuple[View, ...]
    windows: View | None = None
    paired: bool = False

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> Self:
        """Return the variant that `to_payload` wrote.

        Parameters
        ----------
        payload : mapping of str
            Of a part of a job.

        Returns
        -------
        Variant
        """
        change, windows = payload["change"], payload.get("windows")
        return cls(
            number=payload["number"],
            item=payload["item"],
            group=payload["group"],
            lenient=payload["lenient"],
            reference=payload["reference"],
            source=source_from_json(payload["source"]),
            change=None if change is None else Simulation(**change),
            views=tuple(View.from_json(view) for view in payload["views"]),
            windows=None if windows is None else View.from_json(windows),
            paired=payload.get("paired", False),
        )

    @property
    def candidates(self) -> Model:
        """Model of all channels that it is described under; its power has no part in that."""
        return candidate_model(self.views, power=POWER)

    @property
    def key(self) -> str:
        """Digest of all that is computed of the variant."""
        candidates = self.candidates
        content = {
            "source": _to_json(self.source),
            "change": _to_json(self.change),
            "views": [view.key for view in self.views],
            "channels": candidates.to_json()["channels"],
            "versions": {**candidates.versions, **VARIANT_VERSIONS},
        }
        if self.windows is not None:
            content["windows"] = [self.windows.key, self.paired, WINDOWS_VERSION, POINTS_VERSION]
        return _digest(content)


def _to_json(value: Any) -> Any:
    """Plain JSON of a field."""
    if isinstance(value, View):
        return value.to_json()
    if isinstance(value, tuple):
        return [_to_json(one) for one in value]
    if isinstance(value, Source | Simulation | StoredSource):
        return dict(vars(value))
    return value


def _digest(content: Mapping[str, Any]) -> str:
    """Sha256 of JSON, in hexadecimal."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
