"""OFF: text and binary, with every prefix of the keyword."""

from workers.geometry.formats.off.keyword import begins_with_counts, is_off
from workers.geometry.formats.off.reader import read_off

__all__ = ["begins_with_counts", "is_off", "read_off"]
