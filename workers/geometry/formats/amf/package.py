"""AMF, plain or zipped: objects of volumes, placed by constellations."""

import io
import zipfile
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.amf.reader import AmfObject, AmfReader, Instance
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.scenes.placing import Placing
from workers.geometry.formats.surfaces.polygons import require_faces
from workers.geometry.formats.unpacking.zip_parts import ZipParts, part_name
from workers.geometry.formats.xml.feed import encoding_of, pieces_of, read_xml
from workers.geometry.formats.xml.root import xml_root

BESIDE = ("metadata/", "__macosx/", "thumbnail")  # what may lie beside the one AMF file of a zip
MOST_INSTANCES = 100_000
DEEPEST_NESTING = 16  # constellations within constellations


def is_amf(data: bytes) -> bool:
    """Whether the content is AMF: XML, or a zip archive of one AMF file.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.

    Returns
    -------
    bool
        False also for a damaged archive.
    """
    if not data.startswith(b"PK\x03\x04"):
        return xml_root(data) == "amf"
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [part_name(name) for name in archive.namelist() if not name.endswith("/")]
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OverflowError):
        return False
    alone = [name for name in names if not name.startswith(BESIDE)]
    return len(alone) == 1 and alone[0].endswith(".amf")


def read_amf(data: bytes, limits: MeshLimits) -> Reading:
    """Read all objects of an AMF file.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        Triangles of all volumes that are bodies, placed by the constellations. Curved triangles
        are read flat.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    reader = AmfReader(limits)
    if data.startswith(b"PK\x03\x04"):
        with ZipParts(data, limits, "AMF") as archive:
            name = next(n for n in archive.names if n.endswith(".amf") and not n.startswith(BESIDE))
            read_xml(archive.read(name), reader, format="AMF")
    else:
        read_xml(pieces_of(data), reader, format="AMF", encoding=encoding_of(data))
    assembly = _Assembly(reader, limits)
    assembly.place_all()
    found = [*reader.found, *(f"{n} {kind}, left out" for kind, n in assembly.left_out.items())]
    require_faces(sum(len(o.vertices) for o in reader.objects.values()), assembly.placing.n_faces)
    return Reading(assembly.placing.mesh(), tuple(assembly.repairs), tuple(found))


@dataclass
class _Assembly:
    """Places the objects."""

    content: AmfReader
    limits: MeshLimits
    left_out: Counter[str] = field(default_factory=Counter)
    repairs: list[str] = field(default_factory=list)
    bodies_only: bool = True
    n_instances: int = 0

    def __post_init__(self) -> None:
        """Begin with nothing placed."""
        self.placing = Placing(self.limits)

    def place_all(self) -> None:
        """Place the constellations and the objects that are in none; bodies, if there are any."""
        self._place_roots()
        if not self.placing.n_faces and self.left_out:
            kinds = ", ".join(sorted(self.left_out))
            self.repairs.append(f"the file has no body, so what it has was read as one: {kinds}")
            self.left_out.clear()
            self.bodies_only = False
            self.n_instances = 0
            self._place_roots()

    def _place_roots(self) -> None:
        """Place what no constellation holds."""
        groups = self.content.constellations
        used = {instance.object_id for group in groups.values() for instance in group}
        for name in (*groups, *self.content.objects):
            if name not in used:
                self._place(name, np.eye(4), 0)

    def _place(self, name: str, transform: FloatArray, depth: int) -> None:
        """Add an object, or all that a constellation holds."""
        self.n_instances += 1
        if depth > DEEPEST_NESTING or self.n_instances > MOST_INSTANCES:
            raise InvalidMeshError("the AMF constellations refer to each other too often")
        if name in self.content.objects:
            self._add(self.content.objects[name], transform)
        elif name in self.content.constellations:
            for instance in self.content.constellations[name]:
                self._place_instance(instance, transform, depth)
        else:
            raise InvalidMeshError(f"the AMF file has no object {name[:20]!r}")

    def _place_instance(self, instance: Instance, transform: FloatArray, depth: int) -> None:
        """Add one instance, if it is to be printed."""
        if self.bodies_only and not instance.printable:
            self.left_out["object that is not to be printed"] += 1
        else:
            self._place(instance.object_id, transform @ instance.transform, depth + 1)

    def _add(self, thing: AmfObject, transform: FloatArray) -> None:
        """Add the volumes of an object that are bodies."""
        faces: list[IntArray] = []
        for volume in thing.volumes:
            if volume.role and self.bodies_only:
                self.left_out[volume.role] += 1
            else:
                faces.append(volume.faces)
        if faces:
            self.placing.add(thing.vertices, np.concatenate(faces), transform)
