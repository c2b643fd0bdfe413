"""Kinds of GLB files by their scenes: nodes, instances, what is left alone."""

from typing import Any

import numpy as np

from tests.formats.gltf_builders import plain
from tests.formats.kinds import BODY, Facts, kind, refused

THREE = Facts(area=3 * BODY.area, components=3, vertices=3 * BODY.n_vertices)
POSITIONS = BODY.vertices.astype("<f4")
INDICES = BODY.faces.astype("<u4").ravel()


def with_nodes(*nodes: dict[str, Any], **more: Any) -> bytes:
    """The body under these nodes."""
    builder = plain()
    builder.document |= {"nodes": list(nodes)} | more
    return builder.glb()


NO_SCENE = "the glTF file has no scene; all of its nodes were read"
EMPTY_SCENE = "no default scene with meshes; all of its nodes were read"
TWICE = "a node of the glTF file is reached twice; it was read once"


@kind("glTF", "default scene that lists no nodes", "All nodes are read.", repairs=(EMPTY_SCENE,))
def empty_scene() -> bytes:
    return with_nodes({"mesh": 0}, scenes=[{}])


@kind("glTF", "no scene", "All nodes are read.", repairs=(NO_SCENE,))
def no_scene() -> bytes:
    builder = plain()
    del builder.document["scene"], builder.document["scenes"]
    return builder.glb()


@kind("glTF", "empty list of scenes", "All nodes are read.", repairs=(NO_SCENE,))
def no_scenes() -> bytes:
    return with_nodes({"children": [1]}, {"mesh": 0}, scenes=[])


@kind(
    "glTF",
    "meshes without any node",
    "All meshes are read.",
    repairs=("no node of the glTF file has a mesh",),
)
def bare_meshes() -> bytes:
    return with_nodes(nodes=[], scenes=[])


@kind(
    "glTF",
    "default scene that does not exist",
    "The first scene is read.",
    repairs=("has no such scene; its first was read",),
)
def wrong_scene() -> bytes:
    return with_nodes({"mesh": 0}, scene=4)


@kind(
    "glTF",
    "several scenes",
    "The default scene is read.",
    found=("1 other scene: the default scene was read",),
)
def two_scenes() -> bytes:
    scenes = [{"nodes": [0, 1]}, {"nodes": [0]}]
    return with_nodes({"mesh": 0}, {"mesh": 0, "translation": [9, 0, 0]}, scenes=scenes, scene=1)


@kind(
    "glTF",
    "node listed as a root and as a child",
    "Read once, as a child.",
    repairs=("as a root and as a child; it was read as a child",),
)
def root_and_child() -> bytes:
    nodes = {"children": [1], "scale": [0.5] * 3}, {"mesh": 0, "scale": [2] * 3}
    return with_nodes(*nodes, scenes=[{"nodes": [1, 0]}])


@kind("glTF", "node reached twice", "Read once.", repairs=(TWICE,))
def reached_twice() -> bytes:
    return with_nodes({"children": [2]}, {"children": [2]}, {"mesh": 0}, scenes=[{"nodes": [0, 1]}])


@kind("glTF", "node that is its own ancestor", "Read once.", repairs=(TWICE,))
def circle() -> bytes:
    return with_nodes({"children": [1]}, {"mesh": 0, "children": [0]})


@kind(
    "glTF",
    "node that does not exist",
    "Passed over, and said.",
    repairs=("refers to a node that it does not have",),
)
def missing_node() -> bytes:
    return with_nodes({"mesh": 0, "children": [7]}, scenes=[{"nodes": [0, -1]}])


@kind("glTF", "nodes with matrices, rotations and scales", "Each mesh is placed.")
def placed() -> bytes:
    half = float(np.sqrt(0.5))
    matrix = [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1]
    nodes: list[dict[str, Any]] = [{"children": [1], "matrix": matrix}]
    nodes.append({"mesh": 0, "rotation": [half, 0, 0, half], "scale": [0.5] * 3})
    return with_nodes(*nodes)


@kind(
    "glTF",
    "rotation that is no unit quaternion",
    "Read as the rotation that it means.",
    facts=Facts(),  # turned, so that its extent is another
)
def long_quaternion() -> bytes:
    return with_nodes({"mesh": 0, "rotation": [0, 0, 3, 4]})


@kind("glTF", "mirrored node (negative scale)", "Read; its triangles are turned over, too.")
def mirrored() -> bytes:
    return with_nodes({"mesh": 0, "scale": [-1, 1, 1]})


@kind("glTF", "hidden node (KHR_node_visibility)", "Left out, and said.", found=("1 hidden node",))
def hidden() -> bytes:
    gone = {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": False}}}
    return with_nodes({"mesh": 0}, gone, scenes=[{"nodes": [0, 1]}])


def instanced(**attributes: np.ndarray) -> bytes:
    """The body at several places; accessors of integers are normalized."""
    builder = plain()
    numbers = {
        name: builder.accessor(values, normalized=values.dtype.kind == "i" or None)
        for name, values in attributes.items()
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": numbers}}
    builder.document["nodes"] = [{"mesh": 0, "extensions": extension}]
    builder.document["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    return builder.glb()


PLACES = np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0]], dtype="<f4")


@kind("glTF", "EXT_mesh_gpu_instancing", "Every instance is read.", facts=THREE)
def instances() -> bytes:
    turns = np.array([[0, 0, 0, 127], [90, 0, 0, 90], [0, 0, -127, 0]], dtype="<i1")
    return instanced(TRANSLATION=PLACES, ROTATION=turns, SCALE=np.ones((3, 3), dtype="<f4"))


@kind(
    "glTF",
    "EXT_mesh_gpu_instancing that mirrors and scales",
    "Every instance is read.",
    facts=Facts(area=6 * BODY.area, components=3, vertices=3 * BODY.n_vertices),
)
def scaled_instances() -> bytes:
    scales = np.array([[1, 1, 1], [-1, 1, 1], [2, 2, 2]], dtype="<f4")
    return instanced(TRANSLATION=PLACES * 2, SCALE=scales)


@kind(
    "glTF",
    "points and lines besides triangles",
    "The triangles are read; the rest is left out, and said.",
    found=("2 primitives of points or lines",),
)
def points_and_lines() -> bytes:
    builder = plain()
    primitives = builder.document["meshes"][0]["primitives"]
    primitives += [primitives[0] | {"mode": 0}, primitives[0] | {"mode": 1}]
    return builder.glb()


@refused("glTF", "points alone", "Refused: a surface is needed.", reason="points but no faces")
def points_alone() -> bytes:
    builder = plain()
    builder.document["meshes"][0]["primitives"][0]["mode"] = 0
    return builder.glb()


@kind(
    "glTF",
    "materials, textures, vertex colours, animations, cameras, lights, skins, morph targets",
    "The surface is read in its base shape and bind pose; the rest is left alone, and named.",
    found=(
        *("2 materials", "1 texture", "vertex colours", "1 animation", "1 camera", "1 light"),
        *("1 skin: the bind pose was read", "morph targets: the base shape was read"),
    ),
)
def everything() -> bytes:
    builder = plain()
    primitive = builder.document["meshes"][0]["primitives"][0]
    primitive["attributes"] |= {"COLOR_0": 0, "NORMAL": 0}
    primitive["targets"] = [{"POSITION": 0}]
    builder.document |= {
        "meshes": [{"primitives": [primitive], "weights": [1.0]}],
        "nodes": [{"mesh": 0, "skin": 0, "scale": [5, 5, 5]}],
        "skins": [{"joints": [0]}],
        "materials": [{}, {}],
        "textures": [{}],
        "images": [{"uri": "gone.png"}],
        "animations": [{}],
        "cameras": [{}],
        "extensions": {"KHR_lights_punctual": {"lights": [{}]}},
        "extensionsRequired": ["KHR_texture_basisu", "KHR_materials_unlit", "XYZ_unknown"],
    }
    return builder.glb()


def unknown_extension(where: str) -> bytes:
    """The body under an extension that nobody knows."""
    builder = plain()
    item = builder.document[where][0]
    (item["primitives"][0] if where == "meshes" else item)["extensions"] = {"XYZ_packed": {}}
    if where != "bufferViews":
        del builder.document["accessors"][0]["bufferView"]
    builder.document["extensionsRequired"] = ["XYZ_packed"]
    return builder.glb()


for where in ("bufferViews", "meshes", "accessors"):

    @refused(
        "glTF",
        f"geometry under an unknown required extension ({where})",
        "Refused, naming the extension; unknown ones for looks do not matter.",
        reason="of the glTF file needs the extension XYZ_packed",
    )
    def unknown(where: str = where) -> bytes:
        return unknown_extension(where)
