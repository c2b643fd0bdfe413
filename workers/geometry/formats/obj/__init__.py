"""Wavefront OBJ."""

from workers.geometry.formats.obj.reader import read_obj
from workers.geometry.formats.obj.statements import is_obj

__all__ = ["is_obj", "read_obj"]
