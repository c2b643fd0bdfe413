"""GLB and glTF 2.0: triangles of the scene, every node's transform applied."""

from contextlib import closing

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.gltf.buffers import Buffers
from workers.geometry.formats.gltf.container import open_gltf
from workers.geometry.formats.gltf.contents import describe_contents
from workers.geometry.formats.gltf.draco import DracoDecoder
from workers.geometry.formats.gltf.meshes import Meshes
from workers.geometry.formats.gltf.nodes import Nodes, Placement
from workers.geometry.formats.gltf.notes import Notes
from workers.geometry.formats.gltf.transforms import count_instances, instance_transforms
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.surfaces.polygons import require_faces
from workers.geometry.mesh import TriangleMesh


def read_gltf(data: bytes, limits: MeshLimits) -> Reading:
    """Read a glTF 2.0 file: a GLB, or JSON whose buffers are embedded as ``data:`` URIs.

    Parameters
    ----------
    data : bytes
        The whole file, without a byte order mark.
    limits : MeshLimits
        Most vertices and faces that are accepted, and most bytes that are unpacked.

    Returns
    -------
    Reading
        Triangles of the scene, each node placed by its transforms.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        See `workers.geometry.formats.parse`.
    """
    container = open_gltf(data)
    document, notes = container.document, Notes(repairs=list(container.repairs))
    with closing(DracoDecoder(limits)) as decoder:
        meshes = Meshes(document, Buffers(container, limits), decoder, notes)
        scene = _Scene(meshes, limits)
        for placement in Nodes(document, notes).placements():
            scene.add(placement)
    found = (*describe_contents(document), *notes.left_alone())
    return Reading(scene.mesh(), notes.repaired(), found)


class _Scene:
    """Collects the triangles of all placements, counting before it allocates."""

    def __init__(self, meshes: Meshes, limits: MeshLimits) -> None:
        self._meshes = meshes
        self._limits = limits
        self._vertices: list[FloatArray] = []
        self._faces: list[IntArray] = []
        self._n_vertices = 0
        self._n_faces = 0

    def add(self, placement: Placement) -> None:
        """Add a mesh as often as its node shows it."""
        accessors = self._meshes.accessors
        n_instances = count_instances(placement.node, accessors)
        declared = self._meshes.declared(placement.mesh)
        self._check(n_instances * max(declared.vertices, 1), n_instances * declared.faces)
        surface = self._meshes.surface(placement.mesh)
        n_vertices, n_faces = len(surface.vertices), len(surface.faces)
        self._check(n_instances * n_vertices, n_instances * n_faces)
        if not n_faces or not n_instances:
            return
        with np.errstate(all="ignore"):  # what is not finite is cleaning's to report
            transforms = placement.transform @ instance_transforms(placement.node, accessors)
            for transform in transforms:
                linear = transform[:3, :3]
                points = surface.vertices @ linear.T + transform[:3, 3]
                # A mirrored surface is seen from its other side: its triangles are turned over.
                faces = surface.faces[:, ::-1] if np.linalg.det(linear) < 0 else surface.faces
                self._vertices.append(points)
                self._faces.append(faces + self._n_vertices)
                self._n_vertices += n_vertices
        self._n_faces += n_instances * n_faces

    def mesh(self) -> TriangleMesh:
        """Mesh of all that was added."""
        require_faces(self._n_vertices + self._meshes.n_points, self._n_faces)
        return TriangleMesh(np.concatenate(self._vertices), np.concatenate(self._faces))

    def _check(self, vertices: int, faces: int) -> None:
        """Raise ``UploadTooLargeError`` if so many more are too many."""
        self._limits.check(vertices=self._n_vertices + vertices, faces=self._n_faces + faces)
