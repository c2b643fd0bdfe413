"""The nodes of a glTF scene, each once, with its place."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from workers.errors import UploadTooLargeError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.gltf.document import Json, entries, part
from workers.geometry.formats.gltf.notes import Notes
from workers.geometry.formats.gltf.transforms import local_transforms

MOST_NODES = 100_000
TWICE = "a node of the glTF file is reached twice; it was read once"


@dataclass(frozen=True, eq=False)
class Placement:
    """A mesh at its place in the scene.

    Attributes
    ----------
    mesh : any
        Its number, as the document has it.
    transform : (4, 4) float64
        From the node's coordinates to the scene's.
    node : dict
        Which may say that there are several instances.
    """

    mesh: Any
    transform: FloatArray
    node: Json


class Nodes:
    """The nodes of one document.

    Parameters
    ----------
    document : dict
        Content of the JSON.
    notes : Notes
        Takes what breaks the rules.

    Raises
    ------
    InvalidMeshError
        A transform is damaged.
    UploadTooLargeError
        Too many nodes.
    """

    def __init__(self, document: Json, notes: Notes) -> None:
        self._document = document
        self._nodes = entries(document, "nodes")
        self._notes = notes
        self._seen: set[int] = set()
        if len(self._nodes) > MOST_NODES:
            raise UploadTooLargeError(f"the glTF file has over {MOST_NODES:,} nodes")
        self._local = local_transforms(self._nodes)

    def placements(self) -> list[Placement]:
        """Meshes of the default scene; else of all nodes; else those without a node.

        Returns
        -------
        list of Placement
            In the order of the scene, parents before their children.

        Raises
        ------
        InvalidMeshError
            A list is damaged.
        """
        found = list(self._walk(self._scene_roots()))
        if not found:
            found = list(self._walk(self._all_roots()))
            scene = "default scene with meshes" if entries(self._document, "scenes") else "scene"
            said = [f"the glTF file has no {scene}; all of its nodes were read"] if found else []
            self._notes.repairs += said
        if not found:
            meshes = entries(self._document, "meshes")
            found = [Placement(index, np.eye(4), {}) for index in range(len(meshes))]
            if found:
                self._notes.repairs.append(
                    "no node of the glTF file has a mesh; its meshes were read without nodes"
                )
        return found

    def _scene_roots(self) -> list[int]:
        """Nodes that the default scene lists, children of others last."""
        scenes = entries(self._document, "scenes")
        chosen = self._document.get("scene", 0)
        if not scenes:
            return []
        if not isinstance(chosen, int) or not 0 <= chosen < len(scenes):
            self._notes.repairs.append("the glTF file has no such scene; its first was read")
            chosen = 0
        listed = _children(scenes[chosen], "nodes")
        children = {child for node in self._nodes for child in _children(node, "children")}
        both = [index for index in listed if index in children]
        if len(set(listed)) < len(listed):
            self._notes.repairs.append(TWICE)
        if both:
            self._notes.repairs.append(
                "the glTF file lists a node as a root and as a child; it was read as a child"
            )
        return [index for index in listed if index not in children] + both

    def _all_roots(self) -> list[int]:
        """Nodes that are nobody's children, then all others."""
        children = {child for node in self._nodes for child in _children(node, "children")}
        return sorted(range(len(self._nodes)), key=lambda index: index in children)

    def _walk(self, roots: Iterable[int]) -> Iterator[Placement]:
        """Placements of the meshes below some roots, each node once."""
        for root in roots:
            waiting = deque([(root, np.eye(4), True)])
            while waiting:
                index, parent, is_root = waiting.popleft()
                if not 0 <= index < len(self._nodes):
                    self._say("the glTF file refers to a node that it does not have")
                    continue
                if index in self._seen:
                    if not is_root:
                        self._say(TWICE)
                    continue
                self._seen.add(index)
                node = self._nodes[index]
                if part(node, "extensions", "KHR_node_visibility").get("visible") is False:
                    self._notes.found["hidden node"] += 1
                    continue
                with np.errstate(all="ignore"):  # what is not finite is cleaning's to report
                    transform = parent @ self._local[index]
                if node.get("mesh") is not None:
                    # A skinned mesh stands where its bones hold it, whatever its node says.
                    placed = np.eye(4) if node.get("skin") is not None else transform
                    yield Placement(node["mesh"], placed, node)
                waiting.extend((child, transform, False) for child in _children(node, "children"))

    def _say(self, sentence: str) -> None:
        """Note a repair."""
        if sentence not in self._notes.repairs[-3:]:
            self._notes.repairs.append(sentence)


def _children(item: Json, key: str) -> list[int]:
    """Numbers of nodes under a key; -1 for what is no number."""
    found = item.get(key)
    if not isinstance(found, list):
        return []
    return [int(x) if isinstance(x, int | float) and x == x // 1 else -1 for x in found]
