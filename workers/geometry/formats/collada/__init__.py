"""COLLADA (.dae): geometries, and the scene that places them."""

from workers.geometry.formats.collada.reader import is_collada, read_collada

__all__ = ["is_collada", "read_collada"]
