"""A view: the named steps, in order, that make a working mesh of a cleaned one."""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from workers.errors import InvalidRequestError
from workers.geometry.spectrum import SOLVER_VERSION

PREPARATION_VERSION = "5"
"""Part of every view's key: raised when a step gives another mesh than before."""

LONGEST_HOLE = 1.0  # p² / A: what is longer may be where a part was cut off (decision 0036)
LONGEST_LOOP = 50.0  # p² / A: longer ones are the rims of sheets, which are doubled: decision 0008
FIRST_SIZE = 2  # times the working vertices: what is smoothed and compared (decision 0032)
SMOOTHED_VERTICES = 2500  # nothing finer is left of a smoothed surface: chosen, not measured
VIEW_NAMES = ("closed", "open", "smooth", "smooth-open", "detailed")
DETAILED_EIGENPAIRS = 200  # decision 0015
FEWEST_OF_A_PART = 250  # vertices of a component that counts little: chosen, see decision 30
LEAST_SHARE_OF_PAIRS = 1 / 3  # of a small component, whose channels look at a fourth: decision 30
FEWEST_VERTICES = 1000  # a coarser mesh has too few eigenpairs: decision 0003


_PARAMETERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "cap-holes": ("longest",),
        "coarsen": ("vertices",),
        "double": ("longest",),
        "fair": ("time",),
        "fair-rough": ("time", "clean", "rough"),
        "refine": ("vertices",),
        "simplify": ("vertices",),
        "smooth": ("time", "steps"),
    }
)
"""The numbers that each step takes."""


@dataclass(frozen=True)
class Step:
    """One step: its name and the numbers it takes."""

    name: str
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check name and parameters, and freeze them."""
        expected = _PARAMETERS.get(self.name)
        if expected is None:
            raise InvalidRequestError(
                f"there is no preparation step {self.name!r}; expected one of {[*_PARAMETERS]}"
            )
        if set(self.parameters) != set(expected):
            raise InvalidRequestError(
                f"step {self.name!r} takes {' and '.join(map(repr, expected))}, "
                f"but was given {sorted(self.parameters)}"
            )
        for key, value in self.parameters.items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
                raise InvalidRequestError(
                    f"{key!r} of step {self.name!r} is {value!r}; expected a number from 0"
                )
        frozen = MappingProxyType({key: float(self.parameters[key]) for key in expected})
        object.__setattr__(self, "parameters", frozen)

    def __hash__(self) -> int:
        """Hash of name and parameters."""
        return hash((self.name, tuple(sorted(self.parameters.items()))))


@dataclass(frozen=True)
class View:
    """How shapes are prepared before their spectrum is computed; belongs to a model.

    Attributes
    ----------
    name : str
    steps : tuple of Step
        Run in this order.
    eigenpairs : int
        How many are computed of the working mesh.
    """

    name: str
    steps: tuple[Step, ...]
    eigenpairs: int = 100

    @property
    def key(self) -> str:
        """Name and digest under which spectra of this view are stored.

        Changes with every step, parameter, and version of the preparation or the solver.
        """
        content = {
            **self.to_json(),
            "preparation": PREPARATION_VERSION,
            "solver": SOLVER_VERSION,
        }
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return f"{self.name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    @property
    def is_smoothed(self) -> bool:
        """Whether a step takes noise off."""
        return any(step.name in {"fair", "fair-rough", "smooth"} for step in self.steps)

    def for_share(self, weight: float) -> "View":
        """The view under which one component of several is prepared.

        Parameters
        ----------
        weight : float
            How much it counts, from 0 to 1.

        Returns
        -------
        View
            This one from a quarter on; with fewer vertices and eigenpairs below. Eigenvalues of a
            component grow as its area falls, so fewer of them reach as far as those of the whole.
        """
        share = min(1.0, 4.0 * weight)
        if share == 1.0:
            return self
        fewest = {
            "refine": FEWEST_OF_A_PART,
            "coarsen": 2 * FEWEST_OF_A_PART,
            "simplify": 2 * FEWEST_OF_A_PART,
        }
        steps = []
        for step in self.steps:
            count = step.parameters.get("vertices")
            if step.name in fewest and count is not None:
                least = min(count, fewest[step.name])
                step = Step(step.name, {"vertices": max(least, math.ceil(share * count))})
            steps.append(step)
        pairs = math.ceil(max(share, LEAST_SHARE_OF_PAIRS) * self.eigenpairs)
        return replace(self, steps=tuple(steps), eigenpairs=pairs)

    def to_json(self) -> dict[str, Any]:
        """Plain dict, as it is stored with a model.

        Returns
        -------
        dict
            Name, steps and eigenpairs; `from_json` reads it.
        """
        return {
            "name": self.name,
            "steps": [{"name": s.name, "parameters": dict(s.parameters)} for s in self.steps],
            "eigenpairs": self.eigenpairs,
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "View":
        """View of what `to_json` gave.

        Parameters
        ----------
        content : mapping
            Name, steps and eigenpairs.

        Returns
        -------
        View
            Checked.

        Raises
        ------
        InvalidRequestError
            The content is anything else.
        """
        try:
            name, eigenpairs = content["name"], content["eigenpairs"]
            steps = tuple(Step(step["name"], step["parameters"]) for step in content["steps"])
        except (KeyError, TypeError) as error:
            raise InvalidRequestError(f"the view cannot be read: {error!r}") from None
        if not isinstance(name, str) or not isinstance(eigenpairs, int) or eigenpairs < 1:
            raise InvalidRequestError("a view has a name and a number of eigenpairs from 1")
        return cls(name, steps, eigenpairs)


CLOSING = Step("cap-holes", {"longest": LONGEST_LOOP})
DOUBLING = Step("double", {"longest": LONGEST_LOOP})
FAIRING = Step("fair", {"time": 3e-4})
"""Averages noise, however large, before areas and angles are used: decision 0011."""

FAIRING_ROUGH = Step("fair-rough", {"time": 3e-4, "clean": 1.7, "rough": 2.0})
"""Averages noise of what is noisy alone, by a jitter that no clean creature has: decision 0036."""

SMOOTHING = Step("smooth", {"time": 3e-4, "steps": 3})
"""Takes off noise, then handles and fingers; ``benchmarks.view_study`` has a stronger one too."""


def default_view(*, working_vertices: int = 5000) -> View:
    """View "closed": holes capped, coarse meshes refined, fine ones simplified, sheets doubled.

    Parameters
    ----------
    working_vertices : int
        Most vertices of the working mesh, before a sheet is doubled.

    Returns
    -------
    View
        With 100 eigenpairs.
    """
    steps = (*_sizing(working_vertices), _simplifying(working_vertices))
    return View("closed", (CLOSING, *steps, DOUBLING))


def open_view(*, working_vertices: int = 5000) -> View:
    """View "open": as `default_view`, but the boundary stays as it is.

    Parameters
    ----------
    working_vertices : int
        Most vertices of the working mesh.

    Returns
    -------
    View
        With 100 eigenpairs.
    """
    return View("open", (*_sizing(working_vertices), _simplifying(working_vertices)))


def named_view(name: str, *, working_vertices: int = 5000) -> View:
    """View of one of `VIEW_NAMES`: with holes capped and sheets doubled or not, smoothed or not.

    "detailed" is "closed" with twice as many eigenpairs, for what is small on a surface.

    Parameters
    ----------
    name : str
        One of `VIEW_NAMES`.
    working_vertices : int
        Most vertices of the working mesh; a smoothed one has at most 2,500.

    Returns
    -------
    View
        Of this name.

    Raises
    ------
    InvalidRequestError
        There is no view of this name.
    """
    if name not in VIEW_NAMES:
        raise InvalidRequestError(f"there is no view {name!r}; there are {', '.join(VIEW_NAMES)}")
    if name == "detailed":
        closed = default_view(working_vertices=working_vertices)
        return View(name, closed.steps, DETAILED_EIGENPAIRS)
    if not name.startswith("smooth"):
        make = open_view if name == "open" else default_view
        return make(working_vertices=working_vertices)
    simplifying = _simplifying(min(working_vertices, SMOOTHED_VERTICES))
    steps = (*_sizing(working_vertices), FAIRING, SMOOTHING, simplifying)
    return View(name, steps if name == "smooth-open" else (CLOSING, *steps, DOUBLING))


def window_view(*, working_vertices: int = 5000) -> View:
    """View "windows": as `open_view`, but with small holes capped and noise averaged.

    Its spectrum is not computed.

    Parameters
    ----------
    working_vertices : int
        Most vertices of the working mesh.

    Returns
    -------
    View
        No eigenpairs are asked for under it.
    """
    capping = Step("cap-holes", {"longest": LONGEST_HOLE})
    refining, coarsening = _sizing(working_vertices)
    # Noise is looked for before a mesh is refined: faces of four quarters are flat.
    steps = (coarsening, FAIRING_ROUGH, refining, _simplifying(working_vertices))
    return View("windows", (capping, *steps))


def mapping_view(*, working_vertices: int = 5000, is_closed: bool) -> View:
    """The view under which a shape is mapped to another: no sheet is doubled.

    Parameters
    ----------
    working_vertices : int
        Most vertices of the working mesh.
    is_closed : bool
        Whether the shape has no boundary. Then it is "detailed", under which the shipped model has
        solved it already: nothing is doubled.

    Returns
    -------
    View
        "detailed", or one that caps no loops but small ones.
    """
    if is_closed:
        return named_view("detailed", working_vertices=working_vertices)
    steps = window_view(working_vertices=working_vertices).steps
    return View("mapping", steps, DETAILED_EIGENPAIRS)


def _sizing(working_vertices: int) -> tuple[Step, Step]:
    """Steps that bring a mesh to a size that whatever follows can cost; all views have them."""
    fewest = min(FEWEST_VERTICES, working_vertices)
    coarsening = Step("coarsen", {"vertices": FIRST_SIZE * working_vertices})
    return Step("refine", {"vertices": fewest}), coarsening


def _simplifying(vertices: int) -> Step:
    """The step that simplifies to so many vertices."""
    return Step("simplify", {"vertices": vertices})
