"""glTF 2.0, as GLB or as JSON with embedded buffers."""

from workers.geometry.formats.gltf.container import is_glb, is_gltf
from workers.geometry.formats.gltf.scene import read_gltf

__all__ = ["is_glb", "is_gltf", "read_gltf"]
