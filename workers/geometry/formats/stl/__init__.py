"""STL, binary and text."""

from workers.geometry.formats.stl.binary import is_binary_stl
from workers.geometry.formats.stl.reader import read_stl
from workers.geometry.formats.stl.text import is_text_stl

__all__ = ["is_binary_stl", "is_text_stl", "read_stl"]
