"""3MF: a zip of XML parts; objects, components and the build's transforms."""

import io
import lzma
import re
import struct
import zipfile
import zlib
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.threemf.assembly import Assembly, Placed
from workers.geometry.formats.threemf.model_part import Model3MF, Reference, read_model_part
from workers.geometry.formats.threemf.project import PROJECT_FILE, Asides, read_project
from workers.geometry.formats.unpacking.zip_parts import ZipParts, part_name
from workers.geometry.formats.xml.feed import attribute, local, read_xml

RELATIONSHIPS = "_rels/.rels"
USUAL_ROOT = "3d/3dmodel.model"
LARGEST_RELATIONSHIPS = 1 << 16  # bytes
UNREADABLE = (
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, OSError, EOFError),
    *(ValueError, LookupError, RuntimeError, OverflowError),
)
"""What Python raises of damaged archives; what a part is compressed with is up to the file."""
UNCOUNTED = ("materials", "colours", "slices", "volume data")


def is_3mf(data: bytes) -> bool:
    """Whether this zip archive has a 3MF model part.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    bool
        False also for a damaged archive.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = {part_name(name): name for name in archive.namelist()}
            if any(name.endswith(".model") for name in names):
                return True
            if RELATIONSHIPS not in names:
                return False
            with archive.open(names[RELATIONSHIPS]) as stream:
                return b"/3dmodel" in stream.read(LARGEST_RELATIONSHIPS)
    except UNREADABLE:
        return False


def read_3mf(data: bytes, limits: MeshLimits) -> Reading:
    """Read all build items of a 3MF file.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Triangles of the bodies among the build items, placed by their transforms, or of all
        objects where nothing is built.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    with ZipParts(data, limits, "3MF") as archive:
        package = _Package(archive, limits)
        built = package.build()
        asides = package.asides()
    assembly = Assembly(package.parts, package.roots[0], asides, limits)
    mesh = assembly.mesh(built)
    noted = sum((part.noted for part in package.parts.values()), Counter[str]())
    found = [_counted(kind, number) for kind, number in noted.items()]
    found += [f"{_counted(kind, n)}, left out" for kind, n in assembly.left_out.items()]
    return Reading(mesh, tuple(dict.fromkeys(assembly.repairs)), tuple(found))


@dataclass
class _Package:
    """Reads the model parts that the build needs, counting while it does."""

    archive: ZipParts
    limits: MeshLimits
    parts: dict[str, Model3MF] = field(default_factory=dict)
    n_vertices: int = 0
    n_faces: int = 0

    def __post_init__(self) -> None:
        """Find the part that says what is built, or all parts where none is named."""
        names = self.archive.names
        self.models = [name for name in names if name.endswith(".model")]
        target = self._target()
        if target in self.archive:
            self.roots = [target]
        else:
            self.roots = [USUAL_ROOT] if USUAL_ROOT in self.archive else self.models
        if not self.roots:
            raise UnsupportedFormatError("the zip archive has no 3MF model part")

    def build(self) -> list[Placed]:
        """Build items; of a file that builds nothing, the objects that no other is made of."""
        self._read(self.roots)
        built = [(path, item) for path in self.roots for item in self.parts[path].build]
        if built:
            return built
        self._read(self.models)
        used = {
            (part_name(component.path) if component.path else path, component.object_id)
            for path, part in self.parts.items()
            for thing in part.objects.values()
            for component in thing.components
        }
        return [
            (path, Reference(None, object_id, np.eye(4)))
            for path, part in self.parts.items()
            for object_id in part.objects
            if (path, object_id) not in used
        ]

    def asides(self) -> Asides:
        """Read what slicers' project files say; a damaged one says nothing."""
        asides = Asides()
        for name in self.archive.names:
            if PROJECT_FILE.fullmatch(name):
                try:
                    read_project(self.archive.read(name), asides)
                except InvalidMeshError:
                    continue
        return asides

    def _read(self, names: list[str]) -> None:
        """Read parts and those that they refer to."""
        waiting = list(reversed(names))
        while waiting:
            name = waiting.pop()
            if name in self.parts or name not in self.archive:
                continue
            self.parts[name] = part = self._part(name)
            components = [c for thing in part.objects.values() for c in thing.components]
            paths = {item.path for item in (*part.build, *components) if item.path}
            waiting += sorted(map(part_name, paths))

    def _part(self, name: str) -> Model3MF:
        """Read one model part."""
        try:
            return read_model_part(self.archive.read(name), self._count)
        except InvalidMeshError:
            if any(other.startswith("secure/") for other in self.archive.names):
                raise UnsupportedFormatError(
                    "the 3MF file is encrypted (secure content): save it without protection"
                ) from None
            raise

    def _count(self, vertices: int, faces: int) -> None:
        """Add to the counts of all parts and check them."""
        self.n_vertices += vertices
        self.n_faces += faces
        self.limits.check(vertices=self.n_vertices, faces=self.n_faces)

    def _target(self) -> str:
        """Name of the model part that the package names as its root."""
        if RELATIONSHIPS not in self.archive:
            return ""
        reader = _Relationships()
        try:
            read_xml(self.archive.read(RELATIONSHIPS), reader, format="3MF")
        except InvalidMeshError:
            return ""
        return reader.target


@dataclass
class _Relationships:
    """Finds the root of a package."""

    target: str = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one relationship."""
        if local(tag) == "Relationship" and re.search(
            r"/3dmodel/?$", attribute(attributes, "Type") or ""
        ):
            self.target = self.target or part_name(attribute(attributes, "Target") or "")

    def text(self, text: str) -> None:
        """Leave text alone."""

    def end(self, tag: str) -> None:
        """Leave the end of elements alone."""


def _counted(kind: str, number: int) -> str:
    """Name some things with their number: "2 modifiers"."""
    if kind in UNCOUNTED:
        return kind
    first, *rest = kind.split(" ")
    if number == 1:
        return f"1 {kind}"
    if first == "object":
        return " ".join([str(number), "objects", *rest]).replace("that is", "that are")
    return f"{number} {kind}s"
