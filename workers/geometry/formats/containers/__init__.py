"""Files within files: what is compressed, and what an archive holds."""

from workers.geometry.formats.containers.unwrapping import unwrap

__all__ = ["unwrap"]
