"""glTF 2.0, as GLB or as JSON with embedded buffers."""

from workers.geometry.formats.gltf.scene import read_glb, read_gltf

__all__ = ["read_glb", "read_gltf"]
