"""What the project files of slicers say of an object's parts: which are no body."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from workers.geometry.formats.scenes.slicer_roles import role_of
from workers.geometry.formats.xml.feed import attribute, local, read_xml

PROJECT_FILE = re.compile(r"metadata/[^/]*model[^/]*\.config")


@dataclass(frozen=True)
class Asides:
    """Parts that shape how a body is printed and are not printed themselves.

    Attributes
    ----------
    ranges : dict
        By object: first and last triangle, and what these triangles are.
    parts : dict
        By object and the object that it has as a component: what this is.
    """

    ranges: dict[str, list[tuple[int, int, str]]] = field(default_factory=dict)
    parts: dict[tuple[str, str], str] = field(default_factory=dict)


def read_project(pieces: Iterable[bytes], asides: Asides) -> None:
    """Read which parts are modifiers, negative volumes, support enforcers or blockers.

    PrusaSlicer and SuperSlicer write ``volume`` with a range of triangles; BambuStudio and
    OrcaSlicer write ``part`` with a component's id.

    Parameters
    ----------
    pieces : iterable of bytes
        XML of the project file.
    asides : Asides
        What is found is put there.

    Raises
    ------
    InvalidMeshError
        The XML is damaged.
    """
    read_xml(pieces, _ProjectReader(asides), format="3MF")


@dataclass
class _ProjectReader:
    """Collects what expat reports."""

    asides: Asides
    object_id: str = ""
    part_id: str = ""
    role: str = ""
    first: str = ""
    last: str = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one element."""
        name = local(tag)
        if name == "object":
            self.object_id = attribute(attributes, "id") or ""
        elif name in ("volume", "part"):
            self.part_id = attribute(attributes, "id") or ""
            self.role = attribute(attributes, "subtype") or ""
            self.first = attribute(attributes, "firstid") or ""
            self.last = attribute(attributes, "lastid") or ""
        elif name == "metadata":
            key = attribute(attributes, "key")
            value = attribute(attributes, "value") or ""
            if key in ("volume_type", "subtype"):
                self.role = value
            elif key == "modifier" and value.strip() == "1" and not self.role:
                self.role = "modifier"

    def text(self, text: str) -> None:
        """Leave text alone."""

    def end(self, tag: str) -> None:
        """Keep a part that is no body."""
        if local(tag) not in ("volume", "part"):
            return
        role = role_of(self.role)
        if role:
            if self.first.isdecimal() and self.last.isdecimal():
                span = (int(self.first), int(self.last), role)
                self.asides.ranges.setdefault(self.object_id, []).append(span)
            else:
                self.asides.parts[(self.object_id, self.part_id)] = role
        self.role = self.first = self.last = self.part_id = ""
