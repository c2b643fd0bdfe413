"""From what a model is to be learned, as it is asked for."""

import hashlib
from dataclasses import dataclass
from typing import Any

from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.training.sources import Simulation
from workers.transformations import STRENGTHS, TRANSFORMATIONS

SIMULATED, VERTEX_ORDER = "simulated", "vertex-order"
CORRESPONDENCES = (SIMULATED, VERTEX_ORDER)
MOST_CREATURES, MOST_SHAPES = 12, 50  # unless more are asked for
FEWEST_VERTICES, MOST_VERTICES = 2000, 4000  # of a creature


@dataclass(frozen=True)
class TrainingRequest:
    """From what to learn.

    Attributes
    ----------
    collection : str or None
        Whose shapes; procedural creatures without one.
    transformations : tuple of str
        Each is applied to every shape.
    strengths : tuple of int
        Each transformation is applied in all of them.
    correspondence : str
        "simulated", or "vertex-order": shapes of one label are each other's transformations.
    seed : int
        Of creatures, poses and transformations.
    shapes : int or None
        At most so many.
    creatures : int or None
        So many of them, for a bank, beside the collection's shapes or alone.
    """

    collection: str | None = None
    transformations: tuple[str, ...] = ()
    strengths: tuple[int, ...] = STRENGTHS
    correspondence: str = SIMULATED
    seed: int = 0
    shapes: int | None = None
    creatures: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON, as it is shown with a model.

        Returns
        -------
        dict
            Every field; creatures only if their number is given.
        """
        return {
            **{key: value for key, value in vars(self).items() if key != "creatures"},
            **({} if self.creatures is None else {"creatures": self.creatures}),
            "transformations": list(self.transformations),
            "strengths": list(self.strengths),
        }


def check_simulations(request: TrainingRequest) -> None:
    """Refuse transformations and strengths that do not exist.

    Parameters
    ----------
    request : TrainingRequest
        What the client asks for.

    Raises
    ------
    InvalidRequestError
        A transformation or strength is unknown.
    InsufficientTrainingDataError
        No transformation is given.
    """
    known = ", ".join(TRANSFORMATIONS)
    unknown = [name for name in request.transformations if name not in TRANSFORMATIONS]
    if unknown:
        raise InvalidRequestError(f"there is no transformation {unknown[0]!r}; there are {known}")
    if not request.transformations:
        raise InsufficientTrainingDataError(
            f"no transformation is given to learn from; there are {known}"
        )
    if not request.strengths or not set(request.strengths) <= set(STRENGTHS):
        raise InvalidRequestError(
            f"the strengths are {list(request.strengths)}, expected some of {list(STRENGTHS)}"
        )


def simulations(request: TrainingRequest, shape: str, *, poses: bool) -> list[Simulation]:
    """Simulate each transformation in each strength, with seeds of its own.

    Parameters
    ----------
    request : TrainingRequest
        What the client asks for.
    shape : str
        What the seeds of this shape follow from: its content, or its species and number.
    poses : bool
        Whether each copy has a pose of its own.

    Returns
    -------
    list of Simulation
        In the order of `TRANSFORMATIONS`, and of the strengths.
    """
    chosen = [name for name in TRANSFORMATIONS if name in request.transformations]
    return [
        Simulation(
            name,
            strength,
            seed=seed_of(request.seed, shape),
            pose=seed_of(request.seed, shape, "pose", name, strength) if poses else None,
        )
        for name in chosen
        for strength in sorted(set(request.strengths))
    ]


def creature_vertices(working_vertices: int) -> int:
    """Count the vertices of a creature: those of working meshes, within what a creature can have.

    Parameters
    ----------
    working_vertices : int
        Vertices of the working meshes of the service.

    Returns
    -------
    int
        2000 to 4000.
    """
    return min(MOST_VERTICES, max(FEWEST_VERTICES, working_vertices))


def seed_of(*content: object) -> int:
    """Seed that follows from some content.

    Parameters
    ----------
    *content : object
        The same texts have the same seed.

    Returns
    -------
    int
        Below 2³¹.
    """
    text = "/".join(str(part) for part in content)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little") >> 1
