"""Where the numbers of a vector stand."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Axis:
    """Where the numbers of a vector stand, to be drawn.

    Attributes
    ----------
    kind : str
        "edges" of bins, one more than numbers; "levels" of quantiles; the "index" of each number;
        "times" at a point, of which the vector has one after the other.
    values : tuple of float
    """

    kind: Literal["edges", "levels", "index", "times"]
    values: tuple[float, ...]
