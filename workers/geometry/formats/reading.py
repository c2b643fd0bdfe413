"""What a reader makes of a file."""

from dataclasses import dataclass
from typing import Literal

from workers.geometry.mesh import TriangleMesh


@dataclass(frozen=True, eq=False)
class Reading:
    """A mesh, and what is to be said of the file it comes from.

    Attributes
    ----------
    mesh : TriangleMesh
        As in the file, triangulated, not cleaned; indices lie in range.
    repairs : tuple of str
        Where the file breaks its format's rules and how it was read all the same, in sentences
        for people: "the header counts 1,929 triangles, but the file has 1,928".
    found : tuple of str
        What else the file holds and what is left alone, in short: "vertex colours",
        "2 textures", "1 support object".
    up : "y", "z" or None
        The axis that points up, where the file itself says so.
    """

    mesh: TriangleMesh
    repairs: tuple[str, ...] = ()
    found: tuple[str, ...] = ()
    up: Literal["y", "z"] | None = None
