"""What a COLLADA file has, as far as surfaces go."""

from dataclasses import dataclass, field

import numpy as np

from workers.geometry.arrays import FloatArray


@dataclass(frozen=True)
class Input:
    """Where a primitive or ``vertices`` has its values: semantic, source and offset."""

    semantic: str
    source: str
    offset: int


@dataclass
class Source:
    """Numbers as text, and which of them are x, y and z."""

    text: str = ""
    array_id: str = ""
    array_of_accessor: str = ""
    stride: int = 1
    offset: int = 0
    names: list[str] = field(default_factory=list)


@dataclass
class Primitive:
    """Faces of one kind, with their indices as text.

    Attributes
    ----------
    kind : str
        "triangles", "polylist", "polygons", "tristrips" or "trifans".
    inputs : list of Input
    counts : str
        Corners of each polygon of a polylist.
    indices : list of str
        Each ``p``.
    holed : list
        Each ``ph``: the indices of a polygon, and of each of its holes.
    """

    kind: str
    inputs: list[Input] = field(default_factory=list)
    counts: str = ""
    indices: list[str] = field(default_factory=list)
    holed: list[list[str]] = field(default_factory=list)


@dataclass
class Geometry:
    """Primitives, and the inputs of each ``vertices`` by its id."""

    primitives: list[Primitive] = field(default_factory=list)
    vertices: dict[str, list[Input]] = field(default_factory=dict)


@dataclass
class Controller:
    """A skin over a geometry or a morph of one, with its matrix (4, 4) in the bind pose."""

    source: str = ""
    matrix: FloatArray = field(default_factory=lambda: np.eye(4))


@dataclass
class Node:
    """A node of a scene, or a scene.

    Attributes
    ----------
    matrix : (4, 4) float64
        Its transforms, multiplied in their order.
    children : list of Node
    placed : list of (str, str)
        "geometry", "controller" or "node", and its id; an id of another file begins with its name.
    """

    matrix: FloatArray = field(default_factory=lambda: np.eye(4))
    children: list["Node"] = field(default_factory=list)
    placed: list[tuple[str, str]] = field(default_factory=list)


@dataclass
class Content:
    """All of a file, by ids.

    Attributes
    ----------
    sources : dict
        By the id of the source.
    arrays : dict
        Sources by the id of the array that they hold.
    geometries, controllers, nodes, scenes : dict
    scene : str
        Id of the scene that is shown.
    up_axis : str
    noted : dict
        What is left alone, and how often it is there.
    """

    sources: dict[str, Source] = field(default_factory=dict)
    arrays: dict[str, Source] = field(default_factory=dict)
    geometries: dict[str, Geometry] = field(default_factory=dict)
    controllers: dict[str, Controller] = field(default_factory=dict)
    nodes: dict[str, Node] = field(default_factory=dict)
    scenes: dict[str, Node] = field(default_factory=dict)
    scene: str = ""
    up_axis: str = "Y_UP"
    noted: dict[str, int] = field(default_factory=dict)
