"""Writes docs/formats.md from the kinds of files that the tests read.

``python -m tests.formats.document`` writes it; a test says when it is out of date.
"""

import re
from itertools import groupby
from pathlib import Path

from tests.formats.every_kind import every_kind
from tests.formats.kinds import Kind

PATH = Path(__file__).parents[2] / "docs" / "formats.md"
HEAD = """# Files that Proteus reads

This page is made from the tests by `python -m tests.formats.document`: each row is a kind of file
that a test builds and reads. The content decides on the format. The name matters only where the
content says nothing. To compare the readers with others on files of your own, run
`python -m benchmarks.formats FOLDER`.
"""


def table(kinds: list[Kind]) -> str:
    """Return the rows of one format."""
    rows = [f"| {kind.variant} | {kind.outcome} | {kind.treatment} |" for kind in kinds]
    return "\n".join(
        ["| kind of file | | what Proteus makes of it |", "| --- | --- | --- |", *rows]
    )


def document() -> str:
    """Return the whole page, one section a format."""
    ordered = sorted(every_kind(), key=lambda kind: kind.format.lower())
    found = {f: list(kinds) for f, kinds in groupby(ordered, key=lambda kind: kind.format)}
    contents = "\n".join(f"- [{f}](#{anchor(f)}): {len(kinds)}" for f, kinds in found.items())
    sections = [f"## {f}\n\n{table(kinds)}\n" for f, kinds in found.items()]
    return "\n".join([HEAD, contents, "", *sections])


def anchor(heading: str) -> str:
    """Return the part of a link that leads to a heading, as GitHub makes it."""
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")


if __name__ == "__main__":
    PATH.write_text(document())
