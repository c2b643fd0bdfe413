"""The elements of a COLLADA file, taken up as they come."""

from dataclasses import dataclass, field

from workers.geometry.formats.collada.content import (
    Content,
    Controller,
    Geometry,
    Input,
    Node,
    Primitive,
    Source,
)
from workers.geometry.formats.collada.transforms import TRANSFORMS, matrix_of
from workers.geometry.formats.xml.feed import as_floats, attribute, local

PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
SKIPPED = frozenset(
    (
        *("extra", "library_animations", "library_animation_clips", "library_effects"),
        *("library_cameras", "library_lights", "library_physics_models", "library_formulas"),
        *("library_physics_scenes", "library_force_fields", "library_kinematics_models"),
        *("library_kinematics_scenes", "library_joints", "library_articulated_systems"),
    )
)
"""Elements that have nothing of a surface; all in them is passed over."""
NOTED = {
    **{"lines": "lines", "linestrips": "lines", "spline": "curves", "image": "texture"},
    **{"brep": "CAD surfaces", "material": "materials", "library_animations": "animations"},
    **{"nurbs": "CAD surfaces", "skin": "a skin, read in the pose it was bound in"},
}
PLACED = {"instance_geometry": "geometry", "instance_controller": "controller"}
PLACED |= {"instance_node": "node"}
TEXTS = frozenset(("float_array", "p", "h", "vcount", "bind_shape_matrix", "up_axis", *TRANSFORMS))


@dataclass
class Document:
    """Collects the content of a file."""

    content: Content = field(default_factory=Content)
    _skipping: int = 0
    _text: list[str] | None = None
    _geometry: Geometry | None = None
    _source: Source | None = None
    _primitive: Primitive | None = None
    _vertices: list[Input] | None = None
    _controller: Controller | None = None
    _nodes: list[Node] = field(default_factory=list)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take up one element.

        Parameters
        ----------
        tag : str
            May have a prefix.
        attributes : dict
            Of the element.
        """
        name = local(tag)
        if name in NOTED and not self._skipping:
            noted = self.content.noted
            noted[NOTED[name]] = noted.get(NOTED[name], 0) + 1
        if self._skipping or name in SKIPPED:
            self._skipping += 1
        elif name in TEXTS:
            self._text = []
            if name == "float_array" and self._source is not None:
                self._source.array_id = attribute(attributes, "id") or ""
        elif self._geometry is not None:
            self._start_in_geometry(name, attributes)
        else:
            self._start_elsewhere(name, attributes)

    def text(self, text: str) -> None:
        """Take up text.

        Parameters
        ----------
        text : str
            The whole text, or a part of it.
        """
        if self._text is not None:
            self._text.append(text)

    def end(self, tag: str) -> None:
        """Finish an element.

        Parameters
        ----------
        tag : str
            May have a prefix.
        """
        name = local(tag)
        if self._skipping:
            self._skipping -= 1
        elif name in TEXTS:
            self._end_text(name, "".join(self._text or ()))
            self._text = None
        elif name == "geometry":
            self._geometry = None
        elif name in PRIMITIVES:
            self._primitive = None
        elif name == "source":
            self._source = None
        elif name == "vertices":
            self._vertices = None
        elif name == "controller":
            self._controller = None
        elif name in ("node", "visual_scene") and self._nodes:
            self._nodes.pop()

    def _start_in_geometry(self, name: str, attributes: dict[str, str]) -> None:
        """Take up an element of a geometry."""
        geometry, source = self._geometry, self._source
        assert geometry is not None  # for the type checker: the caller looked
        if name == "source":
            self._source = source = Source()
            self.content.sources[attribute(attributes, "id") or ""] = source
        elif name == "accessor" and source is not None:
            source.array_of_accessor = _target(attributes, "source")
            source.stride = _number(attributes, "stride", 1)
            source.offset = _number(attributes, "offset", 0)
        elif name == "param" and source is not None:
            source.names.append(attribute(attributes, "name") or "")
        elif name == "vertices":
            self._vertices = geometry.vertices[attribute(attributes, "id") or ""] = []
        elif name in PRIMITIVES:
            self._primitive = Primitive(name)
            geometry.primitives.append(self._primitive)
        elif name == "ph" and self._primitive is not None:
            self._primitive.holed.append([])
        elif name == "input":
            self._take_input(attributes)

    def _take_input(self, attributes: dict[str, str]) -> None:
        """Take up an input of a primitive or of ``vertices``."""
        inputs = self._primitive.inputs if self._primitive is not None else self._vertices
        if inputs is not None:
            offset = _number(attributes, "offset", len(inputs) if self._primitive else 0)
            semantic = (attribute(attributes, "semantic") or "").upper()
            inputs.append(Input(semantic, _target(attributes, "source"), offset))

    def _start_elsewhere(self, name: str, attributes: dict[str, str]) -> None:
        """Take up an element that is of no geometry."""
        id = attribute(attributes, "id") or ""
        if name == "geometry":
            named = id or f"without an id {len(self.content.geometries)}"
            self._geometry = self.content.geometries[named] = Geometry()
        elif name == "controller":
            self._controller = self.content.controllers[id] = Controller()
        elif name in ("skin", "morph") and self._controller is not None:
            self._controller.source = _target(attributes, "source")
        elif name == "visual_scene":
            node = self.content.scenes[id or f"without an id {len(self.content.scenes)}"] = Node()
            self._nodes = [node]
        elif name == "node":
            self._start_node(id)
        elif name in PLACED and self._nodes:
            self._nodes[-1].placed.append((PLACED[name], _target(attributes, "url")))
        elif name == "instance_visual_scene":
            self.content.scene = _target(attributes, "url")

    def _start_node(self, id: str) -> None:
        """Take up a node of a scene, or of the library of nodes."""
        node = Node()
        if self._nodes:
            self._nodes[-1].children.append(node)
        if id or not self._nodes:
            self.content.nodes[id] = node
        self._nodes.append(node)

    def _end_text(self, name: str, text: str) -> None:
        """Keep a text."""
        if name == "float_array":
            if self._source is not None:
                self._source.text = text
                self.content.arrays[self._source.array_id] = self._source
        elif name == "up_axis":
            self.content.up_axis = text.strip().upper()
        elif name == "bind_shape_matrix":
            if self._controller is not None:
                self._controller.matrix = matrix_of(
                    "matrix", as_floats(text.split(), format="COLLADA")
                )
        elif name in TRANSFORMS:
            if self._nodes:
                numbers = as_floats(text.split(), format="COLLADA")
                self._nodes[-1].matrix = self._nodes[-1].matrix @ matrix_of(name, numbers)
        elif self._primitive is not None:
            self._end_indices(self._primitive, name, text)

    def _end_indices(self, primitive: Primitive, name: str, text: str) -> None:
        """Keep indices or counts."""
        if name == "vcount":
            primitive.counts = text
        elif primitive.holed and (name == "h" or not primitive.holed[-1]):
            primitive.holed[-1].append(text)
        else:
            primitive.indices.append(text)


def _target(attributes: dict[str, str], name: str) -> str:
    """Id that a reference names; "#id" is in this file."""
    return (attribute(attributes, name) or "").strip().removeprefix("#")


def _number(attributes: dict[str, str], name: str, otherwise: int) -> int:
    """Whole number from 0, or another where there is none."""
    text = (attribute(attributes, name) or "").strip()
    return int(text) if text.isdecimal() and len(text) < 10 else otherwise
