"""A variant of a shape to learn a bank from, as it is written into the payload of a part."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workers.creatures import CREATURES_VERSION
from workers.geometry.preparation import View
from workers.pipeline.training_pairs import CreatureSource, Simulation, Source, StoredSource
from workers.retrieval.model import Model
from workers.training.bank import POWER
from workers.training.candidates import candidate_model
from workers.transformations import TRANSFORMATION_VERSION

VARIANT_VERSION = "2"
"""Part of the key of a variant's descriptor: raised when it comes out otherwise."""

VARIANT_VERSIONS: Mapping[str, str] = {
    "creatures": CREATURES_VERSION,
    "transformations": TRANSFORMATION_VERSION,
    "variants": VARIANT_VERSION,
}
"""What a bank's training depends on, besides what its descriptors depend on."""


@dataclass(frozen=True)
class Variant:
    """A shape as it is, or a transformed copy of it.

    Attributes
    ----------
    number : int
        Place in the plan.
    item : str
        What people call it.
    group : str
        Species, or label: what is held out as one.
    lenient : bool
        Others of its group are no impostors.
    reference : int
        Number of the variant that is the shape as it is; the variant's own for that.
    source : Source
    change : Simulation or None
        None for the shape as it is.
    views : tuple of View
        Under which it is described.
    """

    number: int
    item: str
    group: str
    lenient: bool
    reference: int
    source: Source
    change: Simulation | None
    views: tuple[View, ...]

    def to_payload(self) -> dict[str, Any]:
        """Return plain JSON that `from_payload` reads."""
        return {
            "number": self.number,
            "item": self.item,
            "group": self.group,
            "lenient": self.lenient,
            "reference": self.reference,
            **self._content(),
        }

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> "Variant":
        """Return the variant that `to_payload` wrote."""
        source, change = payload["source"], payload["change"]
        return cls(
            number=payload["number"],
            item=payload["item"],
            group=payload["group"],
            lenient=payload["lenient"],
            reference=payload["reference"],
            source=StoredSource(**source) if "sha256" in source else CreatureSource(**source),
            change=None if change is None else Simulation(**change),
            views=tuple(View.from_json(view) for view in payload["views"]),
        )

    @property
    def candidates(self) -> Model:
        """Model of all channels that it is described under; its power has no part in that."""
        return candidate_model(self.views, power=POWER)

    @property
    def key(self) -> str:
        """Digest of all that the descriptor depends on: equal variants are computed once."""
        candidates = self.candidates
        content = {
            **self._content(),
            "views": [view.key for view in self.views],
            "channels": candidates.to_json()["channels"],
            "versions": {**candidates.versions, **VARIANT_VERSIONS},
        }
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def _content(self) -> dict[str, Any]:
        return {
            "source": dict(vars(self.source)),
            "change": None if self.change is None else dict(vars(self.change)),
            "views": [view.to_json() for view in self.views],
        }
