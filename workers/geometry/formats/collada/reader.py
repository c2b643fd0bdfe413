"""COLLADA (.dae): the surfaces that its scene places."""

from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.collada.content import Content, Node
from workers.geometry.formats.collada.document import Document
from workers.geometry.formats.collada.surfaces import Surfaces
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.scenes.placing import Placing
from workers.geometry.formats.surfaces.polygons import require_faces
from workers.geometry.formats.xml.feed import encoding_of, pieces_of, read_xml
from workers.geometry.formats.xml.root import xml_root

MOST_INSTANCES = 100_000
DEEPEST_CONTROLLERS = 8  # a skin over a morph over a geometry
X_TO_Y = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def is_collada(data: bytes) -> bool:
    """Whether the content is COLLADA.

    Parameters
    ----------
    data : bytes
        The whole file, in UTF-8.

    Returns
    -------
    bool
        By its root element.
    """
    return xml_root(data) == "collada"


def read_collada(data: bytes, limits: MeshLimits) -> Reading:
    """Read the surfaces of a COLLADA file.

    Parameters
    ----------
    data : bytes
        The whole file, in UTF-8.
    limits : MeshLimits
        Most vertices and faces that are accepted.

    Returns
    -------
    Reading
        What the scene places, or all geometries where it places none; skins as they were bound.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    document = Document()
    read_xml(pieces_of(data), document, format="COLLADA", encoding=encoding_of(data))
    content = document.content
    scene = _Scene(content, limits)
    scene.place_all()
    if not scene.placing.n_faces:
        _refuse(content, scene.placing.n_vertices)
    found = [_told(what, number) for what, number in content.noted.items()]
    return Reading(
        scene.placing.mesh(),
        tuple(dict.fromkeys(scene.repairs)),
        tuple(found),
        up="z" if content.up_axis == "Z_UP" else "y",
    )


def _told(what: str, number: int) -> str:
    """Name what else the file has; textures with their number."""
    return f"{number} texture{'s' if number > 1 else ''}" if what == "texture" else what


def _refuse(content: Content, n_vertices: int) -> None:
    """Say what the file has in place of triangles."""
    for what in ("CAD surfaces", "curves", "lines"):
        if what in content.noted:
            raise UnsupportedFormatError(
                f"the COLLADA file has {what} only, no mesh: turn them into a mesh in the program "
                "that made it, and export that as OBJ, STL or GLB"
            )
    require_faces(n_vertices, 0)


@dataclass
class _Scene:
    """Places geometries."""

    content: Content
    limits: MeshLimits
    repairs: list[str] = field(default_factory=list)
    n_instances: int = 0

    def __post_init__(self) -> None:
        """Begin with nothing placed."""
        self.placing = Placing(self.limits)
        self.surfaces = Surfaces(self.content, self.limits)

    def place_all(self) -> None:
        """Place the scene that is shown; all geometries where it places none."""
        start = np.eye(4)
        if self.content.up_axis == "X_UP":
            start = X_TO_Y
            self.repairs.append("turned the mesh: the file's x axis points up")
        scenes = self.content.scenes
        shown = scenes.get(self.content.scene)
        for node in [shown] if shown else list(scenes.values()):
            self._walk(node, start)
        if self.placing.n_faces:
            return
        for name in self.content.geometries:
            self._add(name, start)
        if self.placing.n_faces:
            self.repairs.append("no scene places a mesh, so all meshes of the file were read")

    def _walk(self, root: Node, start: FloatArray) -> None:
        """Place all below a node."""
        waiting = [(root, start)]
        while waiting:
            node, parent = waiting.pop()
            self._count(1 + len(node.children) + len(node.placed))
            with np.errstate(all="ignore"):  # infinite coordinates are cleaning's to report
                transform = parent @ node.matrix
            further = [(child, transform) for child in node.children]
            for kind, name in node.placed:
                if kind == "node" and name in self.content.nodes:
                    further.append((self.content.nodes[name], transform))
                elif kind == "controller" and name in self.content.controllers:
                    self._add_skin(name, start)
                elif kind == "geometry" and name in self.content.geometries:
                    self._add(name, transform)
                else:
                    self._miss(name)
            waiting += reversed(further)

    def _add_skin(self, name: str, start: FloatArray) -> None:
        """Add a skin as it was bound: its joints, not its node, say where it is."""
        matrix = start
        for _ in range(DEEPEST_CONTROLLERS):
            controller = self.content.controllers[name]
            matrix, name = matrix @ controller.matrix, controller.source
            if name not in self.content.controllers:
                break
        if name in self.content.geometries:
            self._add(name, matrix)
        else:
            self._miss(name)

    def _add(self, name: str, transform: FloatArray) -> None:
        """Add a geometry."""
        for vertices, faces in self.surfaces.of(name):
            self.placing.add(vertices, faces, transform)

    def _miss(self, name: str) -> None:
        """Say that something that is placed is not there."""
        where = "is in another file" if "#" in name else "is not in the file"
        self.repairs.append(f"left out {name[:40]!r}, which {where}")

    def _count(self, further: int) -> None:
        """Count what is placed: nodes may refer to each other in a circle."""
        self.n_instances += further
        if self.n_instances > MOST_INSTANCES:
            raise InvalidMeshError("the COLLADA nodes refer to each other too often or in a circle")
