"""What a worker is at while it does a part: told at each step to whoever watches.

Only the name of a step is told, before the step begins: LAPACK holds the interpreter for as long
as a step takes, so whatever follows from it is for another process to do.
"""

from workers.storage.parts import Claim

READING = "reading"
SIMPLIFYING = "simplifying"
SPECTRUM = "spectrum"
DESCRIBING = "describing"
MESH_STEPS = frozenset({READING, SIMPLIFYING, SPECTRUM, DESCRIBING})
"""Steps of the work on one mesh, which `PROTEUS_SHAPE_SECONDS` limits together."""

LEARNING = "learning"
MATCHING = "matching"
MEASURING = "measuring"
SEARCHING = "searching"
TRANSFORMING = "transforming"


class Progress:
    """Is told what is done, and tells nobody; a worker has one that does."""

    def begin(self, claim: Claim, shape_id: str | None = None) -> None:
        """Begin a part, or the next mesh of a part; its time counts from its first step.

        Parameters
        ----------
        claim : Claim
            The part that this worker holds.
        shape_id : str, optional
            The shape whose turn it is, in a part of several.
        """

    def enter(self, step: str) -> None:
        """Name the step that is begun now.

        Parameters
        ----------
        step : str
            One of the names above.
        """

    def end(self) -> None:
        """Say that nothing is computed any more; what follows is short, and not to be stopped."""
