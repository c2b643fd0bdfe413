"""One XML part of a 3MF file, read as a stream."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.xml.feed import (
    as_floats,
    as_integers,
    attribute,
    local,
    read_xml,
)

COUNTED_TOGETHER = 4096  # vertices or triangles between two looks at the limits
SLICES = "slicestack"
NOTED = {
    **{"basematerials": "materials", "colorgroup": "colours", "texture2d": "texture"},
    **{SLICES: "slices", "beamlattice": "beam lattice", "displacement2d": "displacement map"},
    **{"volumedata": "volume data", "levelset": "implicit surface"},
    **{"booleanshape": "boolean operation"},
}
"""Elements that are named in what was found."""
CURA_ROLES = {
    **{"infill_mesh": "modifier", "cutting_mesh": "modifier"},
    **{"support_mesh": "support", "anti_overhang_mesh": "support blocker"},
}
"""What Cura's settings say of an object that is not printed as such."""


@dataclass(frozen=True, eq=False)
class Reference:
    """An object placed by a transform (4, 4), in this part (path None) or another."""

    path: str | None
    object_id: str
    transform: FloatArray
    printable: bool = True


@dataclass(frozen=True, eq=False)
class Object3MF:
    """A mesh (n, 3), (m, 3), or components, or nothing.

    Attributes
    ----------
    vertices, faces : arrays
        Of its mesh; empty without one.
    components : tuple of Reference
        Other objects that it is made of.
    kind : str
        "model" for a body; otherwise what it is instead.
    substitute : str or None
        The object that shows a lattice as a mesh.
    """

    vertices: FloatArray
    faces: IntArray
    components: tuple[Reference, ...]
    kind: str = "model"
    substitute: str | None = None


@dataclass(frozen=True, eq=False)
class Model3MF:
    """Objects by id, what of them is built, and how often what else is there."""

    objects: dict[str, Object3MF]
    build: tuple[Reference, ...]
    noted: Counter[str]


def read_model_part(pieces: Iterable[bytes], count: Callable[[int, int], None]) -> Model3MF:
    """Read the objects and build items of a model part.

    Parameters
    ----------
    pieces : iterable of bytes
        The XML, piece after piece.
    count : function
        Called with numbers of further vertices and triangles while reading; raises when
        there are too many.

    Returns
    -------
    Model3MF
        Objects by id, and what is built, in the order of the file.

    Raises
    ------
    InvalidMeshError
        Damaged XML, a document type, a missing or bad attribute.
    """
    reader = _Reader(count)
    read_xml(pieces, reader, format="3MF")
    return Model3MF(reader.objects, tuple(reader.build), reader.noted)


@dataclass
class _Reader:
    """Collects what expat reports."""

    count: Callable[[int, int], None]
    objects: dict[str, Object3MF] = field(default_factory=dict)
    build: list[Reference] = field(default_factory=list)
    noted: Counter[str] = field(default_factory=Counter)
    coordinates: list[str] = field(default_factory=list)
    corners: list[str] = field(default_factory=list)
    components: list[Reference] = field(default_factory=list)
    object_id: str | None = None
    kind: str = "model"
    substitute: str | None = None
    setting: str = ""
    in_slices: int = 0
    uncounted_vertices: int = 0
    uncounted_faces: int = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one element."""
        name = tag.rpartition(":")[2]
        if self.in_slices:
            self.in_slices += name == SLICES
        elif name == "vertex":
            self.coordinates += _three(attributes, "x", "y", "z")
            self.uncounted_vertices += 1
        elif name == "triangle":
            self.corners += _three(attributes, "v1", "v2", "v3")
            self.uncounted_faces += 1
        else:
            self._start_other(name, attributes)
        if self.uncounted_vertices + self.uncounted_faces >= COUNTED_TOGETHER:
            self._count()

    def _start_other(self, name: str, attributes: dict[str, str]) -> None:
        """Take up an element that is rare."""
        if name == "object":
            self.object_id = attribute(attributes, "id") or f"without an id {len(self.objects)}"
            self.kind = attribute(attributes, "type") or "model"
            self.substitute = None
        elif name == "component":
            self.components.append(_reference(attributes))
        elif name == "item":
            self.build.append(_reference(attributes))
        elif name in ("metadata", "setting") and self.object_id is not None:
            named = attribute(attributes, "name") or attribute(attributes, "key") or ""
            self.setting = local(named)
        if name in NOTED:
            self.noted[NOTED[name]] += 1
            self.in_slices = int(name == SLICES)
        if name == "beamlattice":
            self.substitute = attribute(attributes, "representationmesh")

    def text(self, text: str) -> None:
        """Take up the value of a setting."""
        if self.setting in CURA_ROLES and text.strip().lower() in ("true", "1"):
            self.kind = CURA_ROLES[self.setting]

    def end(self, tag: str) -> None:
        """Finish an object."""
        name = tag.rpartition(":")[2]
        if name == SLICES and self.in_slices:
            self.in_slices -= 1
        elif name in ("metadata", "setting"):
            self.setting = ""
        elif name == "object" and self.object_id is not None:
            self._end_object(self.object_id)

    def _end_object(self, object_id: str) -> None:
        """Keep an object."""
        self._count()
        self.objects[object_id] = Object3MF(
            as_floats(self.coordinates, format="3MF").reshape(-1, 3),
            as_integers(self.corners, format="3MF").reshape(-1, 3),
            tuple(self.components),
            self.kind,
            self.substitute,
        )
        self.coordinates, self.corners, self.components = [], [], []
        self.object_id = None

    def _count(self) -> None:
        """Report what was read since the last time."""
        self.count(self.uncounted_vertices, self.uncounted_faces)
        self.uncounted_vertices = self.uncounted_faces = 0


def _three(attributes: dict[str, str], *names: str) -> tuple[str, ...]:
    """Values of three attributes, whatever their prefix."""
    first, second, third = names
    try:
        return attributes[first], attributes[second], attributes[third]
    except KeyError:
        plain = {local(key): value for key, value in attributes.items()}
        return plain[first], plain[second], plain[third]


def _reference(attributes: dict[str, str]) -> Reference:
    """Reference of a component or build item; 3MF's matrices multiply rows."""
    plain = {local(key): value for key, value in attributes.items()}
    transform = np.eye(4)
    if "transform" in plain:
        numbers = as_floats(plain["transform"].split(), format="3MF")
        if len(numbers) != 12:
            raise InvalidMeshError("a transform of the 3MF file is not 12 numbers")
        transform[:3] = numbers.reshape(4, 3).T
    printable = plain.get("printable", "1").strip().lower() not in ("0", "false")
    return Reference(plain.get("path"), plain["objectid"], transform, printable)
