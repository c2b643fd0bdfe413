"""The elements of an AMF file, taken up as they come."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.scenes.slicer_roles import role_of
from workers.geometry.formats.xml.feed import as_floats, as_integers, attribute

COUNTED_TOGETHER = 4096  # vertices or triangles between two looks at the limits
VALUES = frozenset(
    (
        *("x", "y", "z", "v1", "v2", "v3", "deltax", "deltay", "deltaz", "rx", "ry", "rz"),
        *("scale", "scalex", "scaley", "scalez", "mirrorx", "mirrory", "mirrorz", "printable"),
        "metadata",
    )
)
"""Elements whose text is kept until the element around them ends."""
NOTED = {"color": "colours", "normal": "curved triangles, read flat", "material": "materials"}
NOTED |= {"edge": "curved triangles, read flat", "texture": "textures"}


@dataclass(frozen=True, eq=False)
class Volume:
    """Triangles (m, 3), and what they are if no body."""

    faces: IntArray
    role: str


@dataclass(frozen=True, eq=False)
class AmfObject:
    """Vertices (n, 3) that all volumes share."""

    vertices: FloatArray
    volumes: tuple[Volume, ...]


@dataclass(frozen=True, eq=False)
class Instance:
    """An object or constellation placed by a transform (4, 4)."""

    object_id: str
    transform: FloatArray
    printable: bool


@dataclass
class AmfReader:
    """Collects objects and constellations by id.

    Attributes
    ----------
    limits : MeshLimits
        Most vertices and faces.
    """

    limits: MeshLimits
    objects: dict[str, AmfObject] = field(default_factory=dict)
    constellations: dict[str, list[Instance]] = field(default_factory=dict)
    noted: Counter[str] = field(default_factory=Counter)
    _values: dict[str, str] = field(default_factory=dict)
    _value: str | None = None
    _coordinates: list[str] = field(default_factory=list)
    _corners: list[str] = field(default_factory=list)
    _volumes: list[Volume] = field(default_factory=list)
    _id: str = ""
    _role: str = ""
    _metadata: str = ""
    _counts: list[int] = field(default_factory=lambda: [0, 0])

    @property
    def found(self) -> list[str]:
        """What else the file has, in short."""
        return list(self.noted)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one element.

        Parameters
        ----------
        tag : str
            May have a prefix.
        attributes : dict
            Of the element.
        """
        name = tag if tag in VALUES else tag.rpartition(":")[2]
        if name in VALUES:
            self._value = ""
            if name == "metadata":
                self._metadata = attribute(attributes, "type") or ""
        elif name in ("coordinates", "triangle"):
            self._values.clear()
        elif name in ("object", "constellation"):
            self._id = attribute(attributes, "id") or f"without an id {len(self.objects)}"
            if name == "constellation":
                self.constellations[self._id] = []
        elif name == "instance":
            self._values.clear()
            self._values["objectid"] = attribute(attributes, "objectid") or ""
        elif name == "volume":
            self._role = role_of(attribute(attributes, "type") or "")
        elif name in NOTED:
            self.noted[NOTED[name]] += 1

    def text(self, text: str) -> None:
        """Take up text of a value.

        Parameters
        ----------
        text : str
            The whole text, or a part of it.
        """
        if self._value is not None:
            self._value += text

    def end(self, tag: str) -> None:
        """Finish an element.

        Parameters
        ----------
        tag : str
            May have a prefix.
        """
        name = tag if tag in VALUES else tag.rpartition(":")[2]
        if self._value is not None and name in VALUES:
            self._values[name] = self._value
            self._value = None
            if name == "metadata":
                self._end_metadata(self._values[name].strip())
        elif name == "coordinates":
            self._keep(self._coordinates, "x", "y", "z")
            self._count(0)
        elif name == "triangle":
            self._keep(self._corners, "v1", "v2", "v3")
            self._count(1)
        elif name == "volume":
            self._end_volume()
        elif name == "object":
            self._end_object()
        elif name == "instance" and self._id in self.constellations:
            self.constellations[self._id].append(_instance(self._values))

    def _keep(self, where: list[str], *names: str) -> None:
        """Keep the values of a vertex or triangle."""
        try:
            where += [self._values[name] for name in names]
        except KeyError as error:
            raise InvalidMeshError(
                f"a vertex or triangle of the AMF file lacks the element {error}"
            ) from None

    def _count(self, which: int) -> None:
        """Count one vertex (0) or triangle (1) against the limits."""
        self._counts[which] += 1
        if self._counts[which] % COUNTED_TOGETHER == 0:
            self.limits.check(vertices=self._counts[0], faces=self._counts[1])

    def _end_metadata(self, value: str) -> None:
        """Take up what a slicer says of a volume."""
        if self._metadata.endswith("volume_type"):
            self._role = role_of(value)
        elif self._metadata.endswith("slic3r.modifier") and value == "1" and not self._role:
            self._role = "modifier"

    def _end_volume(self) -> None:
        """Keep a volume."""
        faces = as_integers(self._corners, format="AMF").reshape(-1, 3)
        self._volumes.append(Volume(faces, self._role))
        self._corners, self._role = [], ""

    def _end_object(self) -> None:
        """Keep an object; triangles outside of volumes are one."""
        if self._corners:
            self._end_volume()
        vertices = as_floats(self._coordinates, format="AMF").reshape(-1, 3)
        self.objects[self._id] = AmfObject(vertices, tuple(self._volumes))
        self._coordinates, self._volumes, self._role = [], [], ""


def _instance(values: dict[str, str]) -> Instance:
    """Instance of its values; turns about x, then y, then z, in degrees, and then moves."""

    def numbers(names: str, otherwise: float) -> FloatArray:
        texts = [values.get(name, str(otherwise)) for name in names.split()]
        return as_floats(texts, format="AMF")

    angles = np.deg2rad(numbers("rx ry rz", 0.0))
    rotation = np.eye(3)
    for axis, angle in enumerate(angles):
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
        rotation = turn @ rotation
    scale = numbers("scale", 1.0) * numbers("scalex scaley scalez", 1.0)
    transform = np.eye(4)
    transform[:3, :3] = rotation * (scale * numbers("mirrorx mirrory mirrorz", 1.0))
    transform[:3, 3] = numbers("deltax deltay deltaz", 0.0)
    printable = values.get("printable", "1").strip().lower() not in ("0", "false")
    return Instance(values["objectid"], transform, printable)
