"""Kinds of COLLADA files."""

import numpy as np

from tests.formats.kinds import BODY, Facts, kind, refused
from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh

SHOWN = '<scene><instance_visual_scene url="#scene"/></scene>'
BODY_NODE = '<node id="n"><instance_geometry url="#body"/></node>'


def numbers(values: FloatArray) -> str:
    """Numbers between blanks."""
    return " ".join(map(repr, values.ravel().tolist()))


def source(vertices: FloatArray, id: str = "positions", stride: int = 3) -> str:
    """Source of positions."""
    params = "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
    return (
        f'<source id="{id}"><float_array id="{id}-array" count="{vertices.size}">'
        f"{numbers(vertices)}</float_array><technique_common><accessor "
        f'source="#{id}-array" count="{len(vertices)}" stride="{stride}">{params}</accessor>'
        "</technique_common></source>"
    )


def geometry(primitives: str, vertices: FloatArray = BODY.vertices, id: str = "body") -> str:
    """Geometry of these primitives, whose vertices are called ``points``."""
    positions = source(vertices, f"{id}-positions")
    return (
        f'<geometry id="{id}"><mesh>{positions}<vertices id="{id}-points">'
        f'<input semantic="POSITION" source="#{id}-positions"/></vertices>{primitives}'
        "</mesh></geometry>"
    )


def inputs(more: str = "", id: str = "body", offset: int = 0) -> str:
    """Inputs of a primitive."""
    return f'<input semantic="VERTEX" source="#{id}-points" offset="{offset}"/>{more}'


def triangles(mesh: TriangleMesh = BODY, id: str = "body") -> str:
    """All triangles of a mesh."""
    text = " ".join(map(str, mesh.faces.ravel().tolist()))
    return f'<triangles count="{mesh.n_faces}">{inputs(id=id)}<p>{text}</p></triangles>'


def dae(library: str, scene: str = BODY_NODE, more: str = "", up: str = "Y_UP") -> bytes:
    """File of these geometries and this scene."""
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        f'<asset><unit name="inch" meter="0.0254"/><up_axis>{up}</up_axis></asset>\n'
        f"<library_geometries>{library}</library_geometries>\n{more}"
        f'<library_visual_scenes><visual_scene id="scene">{scene}</visual_scene>'
        f"</library_visual_scenes>\n{SHOWN}</COLLADA>\n"
    ).encode()


@kind("COLLADA", "triangles", "Read.")
def plain() -> bytes:
    return dae(geometry(triangles()))


@kind("COLLADA", "several inputs with offsets of their own", "The positions are taken.")
def offsets() -> bytes:
    rows = [f"0 {corner} 0" for corner in BODY.faces.ravel().tolist()]
    more = '<input semantic="NORMAL" source="#a" offset="0"/>'
    more += '<input semantic="TEXCOORD" source="#b" offset="2" set="0"/>'
    text = f"<triangles>{inputs(more, offset=1)}<p>{' '.join(rows)}</p></triangles>"
    return dae(geometry(text))


@kind("COLLADA", "polylist", "Cut into triangles.")
def polylist() -> bytes:
    counts = " ".join(["3"] * BODY.n_faces)
    text = " ".join(map(str, BODY.faces.ravel().tolist()))
    return dae(geometry(f"<polylist>{inputs()}<vcount>{counts}</vcount><p>{text}</p></polylist>"))


@kind("COLLADA", "polygons", "Cut into triangles.")
def polygons() -> bytes:
    rows = "".join(f"<p>{a} {b} {c}</p>" for a, b, c in BODY.faces.tolist())
    return dae(geometry(f"<polygons>{inputs()}{rows}</polygons>"))


@kind("COLLADA", "strips of triangles", "Cut into triangles; the winding alternates.")
def strips() -> bytes:
    rows = "".join(f"<p>{a} {b} {c}</p>" for a, b, c in BODY.faces.tolist())
    return dae(geometry(f"<tristrips>{inputs()}{rows}</tristrips>"))


@kind("COLLADA", "fans of triangles", "Cut into triangles.")
def fans() -> bytes:
    rows = "".join(f"<p>{a} {b} {c}</p>" for a, b, c in BODY.faces.tolist())
    return dae(geometry(f"<trifans>{inputs()}{rows}</trifans>"))


FRAME = np.array(
    [[x, y, z] for z in (0, 1) for s in (3, 1) for x, y in ((-s, -s), (s, -s), (s, s), (-s, s))],
    dtype=np.float64,
)


@kind(
    *("COLLADA", "polygons with holes", "Cut into triangles without the holes."),
    facts=Facts(area=2 * (36 - 4) + 24 + 8, vertices=16),
)
def holes() -> bytes:
    top = "<ph><p>8 9 10 11</p><h>15 14 13 12</h></ph>"
    bottom = "<ph><p>3 2 1 0</p><h>4 5 6 7</h></ph>"
    rows = [[i, (i + 1) % 4, 8 + (i + 1) % 4, 8 + i] for i in range(4)]
    rows += [[4 + (i + 1) % 4, 4 + i, 12 + i, 12 + (i + 1) % 4] for i in range(4)]
    sides = "".join(f"<p>{' '.join(map(str, row))}</p>" for row in rows)
    return dae(geometry(f"<polygons>{inputs()}{sides}{top}{bottom}</polygons>", FRAME))


@kind("COLLADA", "positions of four numbers each, from an offset on", "Read as the file says.")
def stride() -> bytes:
    rows = np.column_stack([BODY.vertices, np.ones(BODY.n_vertices)])
    text = geometry(triangles()).replace(numbers(BODY.vertices), "9 9 " + numbers(rows))
    return dae(text.replace('stride="3"', 'stride="4" offset="2"'))


NESTED = (
    '<node id="a"><translate>1 2 3</translate><rotate>0 0 1 90</rotate><node id="b">'
    "<matrix>0 0 1 5 1 0 0 6 0 1 0 7 0 0 0 1</matrix>"
    '<instance_geometry url="#body"/></node></node>'
)


@kind("COLLADA", "nested nodes with transforms", "Placed by all of them, in their order.")
def nested() -> bytes:
    return dae(geometry(triangles()), NESTED)


TWICE = Facts(area=2 * BODY.area, components=2, vertices=2 * BODY.n_vertices)


@kind("COLLADA", "a node of the library placed twice", "Both are read.", facts=TWICE)
def library_node() -> bytes:
    library = f"<library_nodes>{BODY_NODE}</library_nodes>"
    scene = '<node><instance_node url="#n"/></node>'
    scene += '<node><translate>500 0 0</translate><instance_node url="#n"/></node>'
    return dae(geometry(triangles()), scene, library)


SKIN = (
    '<library_controllers><controller id="skin"><skin source="#body"><bind_shape_matrix>'
    '1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix><source id="w"><float_array id="wa">'
    "1</float_array></source></skin></controller></library_controllers>"
)


@kind(
    *("COLLADA", "a skin on a skeleton", "Read in the pose it was bound in."),
    found=("a skin, read in the pose",),
)
def skin() -> bytes:
    scene = '<node><scale>7 1 1</scale><instance_controller url="#skin"/></node>'
    return dae(geometry(triangles()), scene, SKIN)


@kind("COLLADA", "geometry that no scene places", "All is read.", repairs=("no scene places",))
def unplaced() -> bytes:
    return dae(geometry(triangles()), "")


@kind("COLLADA", "geometry beside what the scene places", "Only what is placed is read.")
def library() -> bytes:
    return dae(geometry(triangles()) + geometry(triangles(id="b"), id="b"))


@kind("COLLADA", "lines beside the mesh", "Left alone and named.", found=("lines",))
def lines() -> bytes:
    return dae(geometry(f"<lines>{inputs()}<p>0 1 1 2</p></lines>" + triangles()))


@kind(
    *("COLLADA", "materials, textures and animations", "Left alone and named."),
    found=("materials", "1 texture", "animations"),
)
def looks() -> bytes:
    more = (
        '<library_images><image id="i"/></library_images><library_materials><material id="m"/>'
        '</library_materials><library_animations><animation><source id="s"><float_array>1 2'
        "</float_array></source></animation></library_animations>"
    )
    return dae(geometry(triangles()), more=more)


@kind("COLLADA", "a node that refers to another file", "Left out.", repairs=("in another file",))
def elsewhere() -> bytes:
    return dae(geometry(triangles()), BODY_NODE + '<node><instance_geometry url="b.dae#x"/></node>')


@kind("COLLADA", "the x axis up", "Turned so that y is up.", repairs=("x axis points up",))
def x_up() -> bytes:
    return dae(geometry(triangles()), up="X_UP")


@kind("COLLADA", "prefixes, Latin-1, blanks before the XML", "Read.")
def prefixes() -> bytes:
    text = dae(geometry(triangles())).decode().partition("\n")[2]
    text = (
        text.replace("<", "<c:").replace("<c:/", "</c:").replace('id="n"', 'id="n" name="Würfel"')
    )
    return b" \r\n" + text.encode("latin-1")


@refused(
    *("COLLADA", "curves only", "Turn them into a mesh in the program that made them."),
    reason="curves only, no mesh",
)
def splines() -> bytes:
    return dae('<geometry id="body"><spline><source id="a"/></spline></geometry>')


@refused(
    *(
        "COLLADA",
        "CAD surfaces (brep) only",
        "Turn them into a mesh in the program that made them.",
    ),
    reason="CAD surfaces only, no mesh",
)
def brep() -> bytes:
    return dae('<geometry id="body"><brep><curves/></brep></geometry>')


@refused("COLLADA", "nodes in a circle", "Damaged.", reason="in a circle")
def circle() -> bytes:
    scene = '<node id="n"><instance_node url="#n"/><instance_node url="#n"/></node>'
    return dae(geometry(triangles()), scene)
