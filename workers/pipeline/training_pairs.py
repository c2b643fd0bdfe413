"""A pair of shapes to learn from, as it is written into the payload of a part."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workers.creatures import CREATURES_VERSION
from workers.geometry.preparation import View
from workers.training.correspondence import CORRESPONDENCE_VERSION
from workers.transformations import TRANSFORMATION_VERSION

PAIR_VERSION = "1"
"""Part of the key of a pair's moments: raised when they come out otherwise."""

VERSIONS: Mapping[str, str] = {
    "correspondence": CORRESPONDENCE_VERSION,
    "creatures": CREATURES_VERSION,
    "pairs": PAIR_VERSION,
    "transformations": TRANSFORMATION_VERSION,
}
"""What a training depends on, besides preparation and solver."""


@dataclass(frozen=True)
class CreatureSource:
    """A procedural creature at rest, of even triangles or of uneven ones."""

    species: str
    seed: int
    vertices: int
    uneven: bool = False


@dataclass(frozen=True)
class StoredSource:
    """A mesh that was uploaded."""

    sha256: str
    name: str


Source = CreatureSource | StoredSource


@dataclass(frozen=True)
class Simulation:
    """A transformation of the shape itself, or of a pose of it where there is one.

    Attributes
    ----------
    transformation : str
    strength : int
    seed : int
    pose : int or None
        Seed of a creature's pose.
    """

    transformation: str
    strength: int
    seed: int
    pose: int | None = None


Change = Simulation | StoredSource
"""How a shape became another: by simulation, or as another file with the same vertex order."""


@dataclass(frozen=True)
class Pair:
    """A shape and a transformation of it.

    Attributes
    ----------
    number : int
        Place in the order in which pairs are summed.
    item : str
        What people call it.
    label : str
        Class of the shape.
    source : Source
        The shape.
    change : Change
        The transformation.
    view : View
        Under which both are solved.
    criterion : str
        Of the learning: what moments are taken of.
    """

    number: int
    item: str
    label: str
    source: Source
    change: Change
    view: View
    criterion: str

    def to_payload(self) -> dict[str, Any]:
        """Return plain JSON that `from_payload` reads."""
        return {"number": self.number, "item": self.item, "label": self.label, **self._content()}

    @classmethod
    def from_payload(cls, payload: Mapping[str, Any]) -> "Pair":
        """Return the pair that `to_payload` wrote."""
        source, change = payload["source"], payload["change"]
        stored = "sha256" in source
        return cls(
            number=payload["number"],
            item=payload["item"],
            label=payload["label"],
            source=StoredSource(**source) if stored else CreatureSource(**source),
            change=StoredSource(**change) if "sha256" in change else Simulation(**change),
            view=View.from_json(payload["view"]),
            criterion=payload["criterion"],
        )

    @property
    def key(self) -> str:
        """Digest of all that the pair's moments depend on: equal pairs are computed once."""
        content = {**self._content(), "view": self.view.key, "versions": dict(VERSIONS)}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def _content(self) -> dict[str, Any]:
        return {
            "source": dict(vars(self.source)),
            "change": dict(vars(self.change)),
            "view": self.view.to_json(),
            "criterion": self.criterion,
        }
