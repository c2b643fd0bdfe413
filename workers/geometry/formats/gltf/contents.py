"""What a glTF document holds besides its surface."""

from typing import Any

from workers.geometry.formats.gltf.document import Json, part
from workers.geometry.formats.gltf.notes import counted

LISTS = {
    **{"materials": "material", "textures": "texture", "animations": "animation"},
    "cameras": "camera",
}
ATTRIBUTES = {"COLOR_0": "vertex colours", "TEXCOORD_0": "texture coordinates"}


def describe_contents(document: Json) -> tuple[str, ...]:
    """Name what is left alone.

    Parameters
    ----------
    document : dict
        Content of the JSON.

    Returns
    -------
    tuple of str
        "2 textures", "vertex colours", "morph targets: the base shape was read" and so on.
    """
    found = [
        counted(len(items), noun)
        for key, noun in LISTS.items()
        if (items := _listed(document, key))
    ]
    lights = _listed(part(document, "extensions", "KHR_lights_punctual"), "lights")
    if lights:
        found.append(counted(len(lights), "light"))
    primitives = [
        primitive
        for mesh in _listed(document, "meshes")
        for primitive in _listed(mesh, "primitives")
    ]
    attributes = {name for primitive in primitives for name in part(primitive, "attributes")}
    found += [words for name, words in ATTRIBUTES.items() if name in attributes]
    if any(primitive.get("targets") for primitive in primitives):
        found.append("morph targets: the base shape was read")
    if _listed(document, "skins"):
        found.append(f"{counted(len(_listed(document, 'skins')), 'skin')}: the bind pose was read")
    others = len(_listed(document, "scenes")) - 1
    if others > 0:
        found.append(f"{counted(others, 'other scene')}: the default scene was read")
    return tuple(found)


def _listed(item: Json, key: str) -> list[Any]:
    """Objects of a list; damage to what is left alone does not matter."""
    found = item.get(key)
    return [x for x in found if isinstance(x, dict)] if isinstance(found, list) else []
