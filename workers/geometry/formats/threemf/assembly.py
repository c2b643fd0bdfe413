"""Objects of a 3MF file, placed where the build says."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from workers.errors import InvalidMeshError, UnsupportedFormatError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.scenes.placing import Placing
from workers.geometry.formats.surfaces.polygons import require_faces, require_indices
from workers.geometry.formats.threemf.model_part import Model3MF, Object3MF, Reference
from workers.geometry.formats.threemf.project import Asides
from workers.geometry.formats.unpacking.zip_parts import part_name
from workers.geometry.mesh import TriangleMesh

DEEPEST_NESTING = 16  # components within components
MOST_INSTANCES = 100_000
INSTEAD = "turn it into a mesh in the program that made it, and export that as 3MF or STL"
WITHOUT_MESH = {
    "beam lattice": f"a beam lattice only, no mesh: {INSTEAD}",
    "implicit surface": f"an implicit surface only, no mesh: {INSTEAD}",
    "volume data": f"volume data only, no mesh: {INSTEAD}",
    "boolean operation": f"a boolean operation only, no mesh of its result: {INSTEAD}",
    "slices": "slices only, no mesh: export it with its mesh, or as STL",
}
Placed = tuple[str, Reference]  # the part it stands in


@dataclass
class Assembly:
    """Places objects, counting before it allocates.

    Attributes
    ----------
    parts : Mapping
        Model parts by name.
    root : str
        The part that slicers' project files speak of.
    asides : Asides
        What these say.
    limits : MeshLimits
        Most vertices and faces.
    left_out : Counter
        What is no body and was not placed.
    repairs : list of str
        What was mended.
    """

    parts: Mapping[str, Model3MF]
    root: str
    asides: Asides
    limits: MeshLimits
    left_out: Counter[str] = field(default_factory=Counter)
    repairs: list[str] = field(default_factory=list)
    _n_instances: int = 0
    _bodies_only: bool = True

    def __post_init__(self) -> None:
        """Begin with nothing placed."""
        self._placing = Placing(self.limits)

    def mesh(self, built: Sequence[Placed]) -> TriangleMesh:
        """Place build items: the bodies among them, or all where there is no body.

        Parameters
        ----------
        built : sequence
            Each a part's name and a reference from there.

        Returns
        -------
        TriangleMesh
            All triangles.

        Raises
        ------
        InvalidMeshError
            No triangles, a reference to nothing, or a circle of them.
        UnsupportedFormatError
            Lattices, slices or the like without a mesh.
        UploadTooLargeError
            More vertices or faces than the limits allow.
        """
        self._place_all(built)
        if not self._placing.n_faces and self.left_out:
            kinds = ", ".join(sorted(self.left_out))
            self.repairs.append(f"the file has no body, so what it has was read as one: {kinds}")
            self.left_out.clear()
            self._bodies_only = False
            self._n_instances = 0
            self._place_all(built)
        if not self._placing.n_faces:
            self._refuse()
        return self._placing.mesh()

    def _place_all(self, built: Sequence[Placed]) -> None:
        """Place all items."""
        for path, item in built:
            if item.printable or not self._bodies_only:
                self._place(path, item, np.eye(4), 0)
            else:
                self.left_out["object that is not to be printed"] += 1

    def _refuse(self) -> None:
        """Say what the file has in place of triangles."""
        noted = sum((part.noted for part in self.parts.values()), Counter[str]())
        for kind, reason in WITHOUT_MESH.items():
            if noted[kind]:
                raise UnsupportedFormatError(f"the 3MF file has {reason}")
        n_points = sum(len(o.vertices) for p in self.parts.values() for o in p.objects.values())
        require_faces(n_points, 0)

    def _place(self, path: str, reference: Reference, parent: FloatArray, depth: int) -> None:
        """Add one instance of an object and of its components."""
        self._n_instances += 1
        if depth > DEEPEST_NESTING or self._n_instances > MOST_INSTANCES:
            raise InvalidMeshError("the 3MF objects refer to each other too often or in a circle")
        path = part_name(reference.path) if reference.path else path
        thing = self._object(path, reference.object_id)
        if self._bodies_only and thing.kind.strip().lower() != "model":
            self.left_out[_named(thing.kind)] += 1
            return
        transform = parent @ reference.transform
        if len(thing.faces):
            self._add(path, reference.object_id, thing, transform)
        elif thing.substitute is not None:
            shown = self._object(path, thing.substitute)
            self._placing.add(shown.vertices, shown.faces, transform)
        for component in thing.components:
            role = self._role(path, reference.object_id, component)
            if role:
                self.left_out[role] += 1
            else:
                self._place(path, component, transform, depth + 1)

    def _object(self, path: str, object_id: str) -> Object3MF:
        """Object of a part, or its only one where that has no id."""
        part = self.parts.get(path)
        objects = part.objects if part else {}
        if object_id in objects:
            return objects[object_id]
        nameless = [thing for name, thing in objects.items() if name.startswith("without an id")]
        if len(nameless) != 1:
            raise InvalidMeshError(f"the 3MF file has no object {object_id[:20]!r}")
        self.repairs.append(f"took the object without an id for {object_id[:20]!r}")
        return nameless[0]

    def _role(self, path: str, object_id: str, component: Reference) -> str | None:
        """Find what a component is if it is no body."""
        if path != self.root or not self._bodies_only:
            return None
        return self.asides.parts.get((object_id, component.object_id))

    def _add(self, path: str, object_id: str, thing: Object3MF, transform: FloatArray) -> None:
        """Add the triangles of an object that belong to its body."""
        ranges = self.asides.ranges.get(object_id) if path == self.root else None
        if ranges and self._bodies_only:
            kept = np.ones(len(thing.faces), dtype=bool)
            for first, last, role in ranges:
                kept[first : last + 1] = False
                self.left_out[role] += 1
            if kept.any():
                part = _part(thing, thing.faces[kept])
                self._placing.add(part.vertices, part.faces, transform)
        else:
            self._placing.add(thing.vertices, thing.faces, transform)


def _part(thing: Object3MF, faces: IntArray) -> Object3MF:
    """Object of these triangles alone, without the vertices of the others."""
    require_indices(faces.ravel(), np.repeat(np.arange(len(faces)), 3), len(thing.vertices))
    used, corners = np.unique(faces, return_inverse=True)
    return Object3MF(thing.vertices[used], corners.reshape(-1, 3), ())


def _named(kind: str) -> str:
    """Name of what is no body, of an object's type."""
    return "support object" if "support" in kind.lower() else f"object of type {kind[:20]!r}"
