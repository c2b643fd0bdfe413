"""PLY: header, rows, and the mesh they make."""

from workers.geometry.formats.ply.reader import read_ply

__all__ = ["read_ply"]
