"""Meshes of finite element programs: Gmsh's MSH and Medit's MESH."""

from workers.geometry.formats.msh.medit import is_medit, read_medit
from workers.geometry.formats.msh.reader import is_msh, read_msh

__all__ = ["is_medit", "is_msh", "read_medit", "read_msh"]
