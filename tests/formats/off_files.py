"""Kinds of OFF files."""

from tests.formats.kinds import BODY, kind
from workers.geometry.formats import write


@kind("OFF", "as the format's text says", "Read.")
def plain() -> bytes:
    return write(BODY, "off")
