"""Kinds of files: each is built here, read by one test, and a row of docs/formats.md.

A module of this folder registers the kinds of a format::

    @kind("PLY", "triangle strips", "Cut into triangles; winding alternates as strips do.")
    def strips() -> bytes: ...

The function builds the file. Unless told otherwise it holds `BODY`, and reading and cleaning give
it back: the same number of vertices and components, the same area and extent, no open edge.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from tests.meshes import bumpy_sphere

BODY = bumpy_sphere(3)
"""One closed component of 642 vertices that no symmetry maps to itself."""


@dataclass(frozen=True)
class Facts:
    """What is expected of the cleaned mesh; None where any value will do.

    Attributes
    ----------
    area : float
        In the file's unit, squared.
    components, loops, vertices : int
    tolerance : float
        Of the area, relative.
    """

    area: float | None = BODY.area
    components: int | None = 1
    loops: int | None = 0
    vertices: int | None = BODY.n_vertices
    tolerance: float = 1e-5


THE_BODY = Facts()


@dataclass(frozen=True)
class Kind:
    """One kind of file.

    Attributes
    ----------
    format : str
        As people call it; heads a section of docs/formats.md.
    variant : str
        What is special about the file.
    treatment : str
        What Proteus makes of it, or why it refuses it and what to do instead; one sentence.
    build : function
        Makes the file's bytes.
    filename : str
        Under which it is read.
    facts : Facts or None
        Of the cleaned mesh; None where the file is refused.
    reason : str
        A part of the message of a file that is refused.
    repairs, found : tuple of str
        A part of a sentence that reading must say, each.
    """

    format: str
    variant: str
    treatment: str
    build: Callable[[], bytes]
    filename: str = ""
    facts: Facts | None = THE_BODY
    reason: str = ""
    repairs: tuple[str, ...] = ()
    found: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """For the test's name."""
        return f"{self.format}: {self.variant}"

    @property
    def outcome(self) -> Literal["read", "refused"]:
        """As the table has it."""
        return "refused" if self.facts is None else "read"


@dataclass
class Register:
    """The kinds in the order in which modules declared them."""

    kinds: list[Kind] = field(default_factory=list)


REGISTER = Register()
Builder = Callable[[], bytes]


def kind(
    format: str,
    variant: str,
    treatment: str,
    *,
    filename: str = "",
    facts: Facts = THE_BODY,
    repairs: tuple[str, ...] = (),
    found: tuple[str, ...] = (),
) -> Callable[[Builder], Builder]:
    """Register the kind of file that the decorated function builds; it is read."""

    def register(build: Builder) -> Builder:
        REGISTER.kinds.append(
            Kind(
                *(format, variant, treatment, build, filename, facts),
                repairs=repairs,
                found=found,
            )
        )
        return build

    return register


def refused(
    format: str, variant: str, treatment: str, *, reason: str, filename: str = ""
) -> Callable[[Builder], Builder]:
    """Register the kind of file that the decorated function builds; it is refused."""

    def register(build: Builder) -> Builder:
        REGISTER.kinds.append(
            Kind(format, variant, treatment, build, filename, facts=None, reason=reason)
        )
        return build

    return register
