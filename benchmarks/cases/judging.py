"""Whether what came of a file is what was expected of it, as far as words can be checked."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

LARGEST_DISTANCE = 0.35
SAME_AREA = 1e-3
ROUNDED_AREA = 1e-2
"""Of meshes whose file stores rounded coordinates."""

Case = Mapping[str, Any]
"""An entry of the index: ``id``, ``file``, ``expected``, and perhaps ``got`` and ``verdict``: what
came of it once, and whether that was wrong."""


class Verdict(StrEnum):
    """Of one case."""

    OK = "ok"
    WRONG = "wrong"
    BY_EYE = "judge by eye"


@dataclass(frozen=True)
class Surface:
    """What the service says of a shape, and the size of its mesh."""

    vertices: int
    area: float
    components: int
    loops: int
    diagonal: float = 1.0
    """Of its bounding box."""

    @classmethod
    def of(cls, shape: Mapping[str, Any], diagonal: float) -> "Surface":
        """Take it from the service's answer."""
        components, loops = shape["n_components"], shape["n_boundary_loops"]
        return cls(shape["n_vertices"], shape["area"], components, loops, diagonal)

    def scaled_to(self, other: "Surface") -> "Surface":
        """Return it in the unit of another of the same shape, by the sizes of their boxes."""
        scale = other.diagonal / self.diagonal
        return replace(self, area=self.area * scale**2, diagonal=other.diagonal)


@dataclass(frozen=True)
class Outcome:
    """What came of a file.

    Attributes
    ----------
    ready : tuple of str
        Names of the shapes that it became.
    failed : tuple of (str, str)
        Names and reasons of those that failed, or of what the job names as refused.
    stored_failures : int
        Failed shapes that stand in the collection.
    surface : Surface or None
        Of the first that is ready.
    distance : float
        From the clean mesh.
    rank : int
        Of the clean mesh among all shapes; 0 where it is not found.
    """

    ready: tuple[str, ...] = ()
    failed: tuple[tuple[str, str], ...] = ()
    stored_failures: int = 0
    surface: Surface | None = None
    distance: float = float("inf")
    rank: int = 0

    @property
    def reason(self) -> str:
        """The first reason of a failure."""
        return self.failed[0][1] if self.failed else ""


def judge(case: Case, outcome: Outcome, clean: Surface) -> tuple[Verdict, str]:
    """Compare an outcome with what the index expects.

    Parameters
    ----------
    case : mapping
    outcome : Outcome
    clean : Surface
        Of the clean mesh.

    Returns
    -------
    Verdict, and what is to be said of it.
    """
    expected = str(case["expected"])
    if only := re.match(r"only (\S+) becomes a shape", expected):
        right = outcome.ready == (only[1],) and not outcome.stored_failures
        return (Verdict.OK if right else Verdict.WRONG), ""
    if outcome.surface is None:
        return _judge_refusal(case, outcome, expected)
    if "failed shape" in expected:
        return Verdict.WRONG, "read, where a reason was expected"
    if expected in ("read or refused", "ready or refused"):
        return Verdict.OK, ""
    if "as given" in expected:
        return _judge_given(expected, outcome.surface)
    if "is rank 1" in expected:
        return _judge_found(outcome)
    tolerance = ROUNDED_AREA if "within rounding" in expected else SAME_AREA
    return _judge_same(outcome, outcome.surface, clean, tolerance)


def _judge_refusal(case: Case, outcome: Outcome, expected: str) -> tuple[Verdict, str]:
    """Judge a reason by what was said of the same one before; others need a reader."""
    allowed = "refused" in expected or "failed shape" in expected
    if not outcome.reason or not allowed:
        return Verdict.WRONG, ""
    if expected in ("read or refused", "ready or refused"):
        return Verdict.OK, ""
    before = case.get("got", {})
    if before.get("error") == outcome.reason:
        wrong = case.get("verdict") == "wrong"
        return (Verdict.WRONG, "the reason misleads") if wrong else (Verdict.OK, "")
    return Verdict.BY_EYE, "does the reason name the cause?"


def _judge_given(expected: str, found: Surface) -> tuple[Verdict, str]:
    wrong = []
    if area := re.search(r"area ([\d.]+)", expected):
        close = np.isclose(found.area, float(area[1]), rtol=SAME_AREA)
        wrong += [] if close else ["area"]
    for noun, count in (("components", found.components), ("loops", found.loops)):
        number = re.search(rf"(\d+) {noun}", expected)
        wrong += [noun] if number and int(number[1]) != count else []
    return (Verdict.WRONG if wrong else Verdict.OK), ", ".join(wrong)


def _judge_found(outcome: Outcome) -> tuple[Verdict, str]:
    right = outcome.rank == 1 and outcome.distance < LARGEST_DISTANCE
    return (Verdict.OK if right else Verdict.WRONG), "" if right else "distance or rank"


def _judge_same(
    outcome: Outcome, found: Surface, clean: Surface, tolerance: float
) -> tuple[Verdict, str]:
    """Judge by the surface; another number of vertices on the same surface needs a look."""
    area = found.scaled_to(clean).area
    wrong = [] if np.isclose(area, clean.area, rtol=tolerance) else ["area"]
    wrong += ["components"] if found.components != clean.components else []
    wrong += ["loops"] if found.loops != clean.loops else []
    verdict, words = _judge_found(outcome)
    wrong += [words] if verdict is Verdict.WRONG else []
    if wrong:
        return Verdict.WRONG, ", ".join(wrong)
    if found.vertices != clean.vertices:
        return Verdict.BY_EYE, f"{clean.vertices} vertices expected"
    return Verdict.OK, ""
