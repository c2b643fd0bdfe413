"""3MF: the package, its model parts, and what of them is built."""

from workers.geometry.formats.threemf.package import is_3mf, read_3mf

__all__ = ["is_3mf", "read_3mf"]
