"""PLY: header, rows, and the mesh they make."""

from workers.geometry.formats.ply.header import is_ply
from workers.geometry.formats.ply.reader import read_ply

__all__ = ["is_ply", "read_ply"]
