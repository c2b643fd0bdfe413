"""The results of a reproduction, as JSON from which figures and report can be made again."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proteus.benchmark.build import Manifest
from proteus.client import Document

KEPT = ("name", "method", "parameters", "training", "kernels", "versions")
FILE = "results.json"


@dataclass(frozen=True)
class Results:
    """The results of a reproduction.

    Attributes
    ----------
    facts : dict
        Size, seed, command and versions.
    manifest : dict
        The benchmark's.
    models, closed : dict
        Models by key as the service shows them: of open shapes, and of shapes with closed holes.
    open_evaluation, closed_evaluation : dict
        Without the ranks of single queries.
    """

    facts: Document
    manifest: Manifest
    models: Mapping[str, Document]
    closed: Mapping[str, Document]
    open_evaluation: Document
    closed_evaluation: Document

    def to_json(self) -> dict[str, Any]:
        """Return the contents of ``results.json``."""
        return {
            "facts": self.facts,
            "benchmark": self.manifest,
            "models": {key: _brief(model) for key, model in self.models.items()},
            "closed_models": {key: _brief(model) for key, model in self.closed.items()},
            "evaluation": _without_ranks(self.open_evaluation),
            "closed_evaluation": _without_ranks(self.closed_evaluation),
        }

    def save(self, folder: Path) -> Path:
        """Write ``results.json``; return its path."""
        path = folder / FILE
        path.write_text(json.dumps(self.to_json(), indent=1, ensure_ascii=False) + "\n")
        return path


def model_names(models: Mapping[str, Document], columns: tuple[str, ...]) -> dict[str, str]:
    """Return the models' names by column."""
    return {key: str(models[key]["name"]) for key in columns if key in models}


def _brief(model: Document) -> Document:
    return {name: model.get(name) for name in KEPT}


def _without_ranks(evaluation: Document) -> Document:
    return {name: value for name, value in evaluation.items() if name != "ranks"}
