"""STL as text: ``vertex x y z`` three times in each facet."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats.limits import MeshLimits
from workers.geometry.formats.reading import Reading
from workers.geometry.formats.stl.plain import read_plain
from workers.geometry.formats.stl.records import soup
from workers.geometry.formats.surfaces.polygons import polygon_mesh, require_faces
from workers.geometry.formats.text.numerals import with_decimal_points
from workers.geometry.formats.text.tokens import Polygons, floats

BEGINNING = re.compile(rb"\s*(?:solid\b.*?\bfacet\b|facet\s+normal\b)", re.IGNORECASE | re.DOTALL)
LOOP = re.compile(rb"\bouter\s+loop\s+vertex\s", re.IGNORECASE)
ROW = rb"vertex\s+(\S+\s+\S+\s+\S+)\s+"
TRIANGLE = re.compile(rb"\b" + ROW + ROW + ROW + rb"end\s?loop\b", re.IGNORECASE)
KEYWORD = re.compile(rb"\b(vertex|facet|outer|(?:end[ \t]*)?(?:loop|facet|solid))\b", re.IGNORECASE)
SOLID = re.compile(rb"(?:\A|(?<=[\r\n]))[ \t]*solid\b", re.IGNORECASE)
NAME = re.compile(
    rb"^([ \t]*(?:end[ \t]*)?solid)\b(?:(?!\bfacet\b)[^\n])*", re.IGNORECASE | re.MULTILINE
)
END = re.compile(rb"\bend(\s*)solid\b", re.IGNORECASE)
FACETS = ("facet", "facets")


def is_text_stl(head: bytes) -> bool:
    """Whether text has the words of an STL file, with or without ``solid`` before them.

    Parameters
    ----------
    head : bytes
        The file's beginning.

    Returns
    -------
    bool
        False for a file that declares a solid and has no facet.
    """
    return BEGINNING.match(head) is not None or LOOP.search(head) is not None


def read_text_stl(data: bytes, limits: MeshLimits) -> Reading:
    """Read an STL file in text.

    Parameters
    ----------
    data : bytes
        The whole file. A facet may have any number of corners, and ``endsolid`` may be missing.
    limits : MeshLimits
        Most faces that are accepted.

    Returns
    -------
    Reading
        Vertices of its own for each facet, in the order of the file.

    Raises
    ------
    InvalidMeshError
        No facet, a vertex without three numbers, or an end within a facet.
    UploadTooLargeError
        Over the limits.
    """
    corners = read_plain(data)
    if corners is not None:
        limits.check(faces=len(corners) // 3)
        return Reading(soup(corners), repairs=tuple(_frame_repairs(data, 1)))
    triangles = TRIANGLE.findall(data)
    facets = _Facets(list(chain.from_iterable(triangles)), [3] * len(triangles))
    if len(facets.rows) != data.lower().count(b"vertex"):
        facets = _facets_by_line(data)
    limits.check(faces=sum(facets.counts) - 2 * len(facets.counts))
    require_faces(0, len(facets.counts))
    text, commas = with_decimal_points(b"\n".join(facets.rows))
    counts = np.array(facets.counts, dtype=np.int64)
    polygons = Polygons(counts, np.arange(len(facets.rows), dtype=np.int64))
    mesh = polygon_mesh(_coordinates(text, len(facets.rows)), polygons, _without_vertices(limits))
    n_solids = len(SOLID.findall(data))
    return Reading(
        mesh,
        repairs=(*commas, *facets.repairs(), *_frame_repairs(data, n_solids)),
        found=(f"{n_solids:,} solids",) if n_solids > 1 else (),
    )


@dataclass
class _Facets:
    """Rows of coordinates, and how many of them each facet has."""

    rows: list[bytes] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    n_short: int = 0

    def add(self, rows: list[bytes]) -> None:
        """Add a facet of so many corners; less than three make none."""
        if len(rows) >= 3:
            self.rows += rows
            self.counts.append(len(rows))
        elif rows:
            self.n_short += 1

    def repairs(self) -> Iterable[str]:
        """Say what is unusual about the facets."""
        n_large = sum(count > 3 for count in self.counts)
        if n_large:
            yield f"cut {n_large:,} {FACETS[n_large != 1]} of more than 3 corners into triangles"
        if self.n_short:
            yield f"left out {self.n_short:,} {FACETS[self.n_short != 1]} of fewer than 3 corners"


def _facets_by_line(data: bytes) -> _Facets:
    """Facets of a file that does not have three vertices in each loop."""
    facets = _Facets()
    rows: list[bytes] = []
    any_end = False
    text = NAME.sub(rb"\1", data.replace(b"\r", b"\n"))
    for line in KEYWORD.sub(rb"\n\1 ", text).split(b"\n"):
        word, _, rest = line.strip().partition(b" ")
        match word.lower():
            case b"vertex":
                rows.append(rest)
            case b"endloop" | b"endfacet" | b"endsolid" | b"end" | b"facet" | b"outer" | b"solid":
                any_end = any_end or bool(rows)
                facets.add(rows)
                rows = []
    if not any_end:  # nothing but vertices
        facets.rows, facets.counts = rows[: len(rows) // 3 * 3], [3] * (len(rows) // 3)
        rows = rows[len(facets.rows) :]
    if len(rows) in (1, 2) or (rows and not data[-1:].isspace()):
        raise InvalidMeshError(
            f"the file ends within facet {len(facets.counts):,}: it is truncated; "
            "save or copy it again"
        )
    facets.add(rows)
    return facets


def _coordinates(text: bytes, n_rows: int) -> FloatArray:
    """Positions (n, 3) of rows ``x y z [anything]``."""
    values = floats(text)
    if len(values) == 3 * n_rows:
        return values.reshape(-1, 3)
    rows = [line.split(None, 3)[:3] for line in text.split(b"\n")]
    for vertex, row in enumerate(rows):
        if len(row) < 3:
            raise InvalidMeshError(
                f"vertex {vertex} of the STL file has {len(row)} coordinates; expected 3"
            )
    return floats(b"\n".join(b" ".join(row) for row in rows)).reshape(-1, 3)


def _frame_repairs(data: bytes, n_solids: int) -> Iterable[str]:
    """Say what is missing around the facets."""
    if not n_solids:
        yield "the file does not begin with 'solid'"
    end = END.search(data, max(0, len(data) - 4096))
    if end is None:
        yield "the file ends without 'endsolid'; all its facets are whole"
    elif end[1]:
        yield "read 'end solid' as 'endsolid'"


def _without_vertices(limits: MeshLimits) -> MeshLimits:
    """Limits of triangles alone: each has vertices of its own here."""
    return MeshLimits(vertices=3 * limits.faces, faces=limits.faces, unpacked=limits.unpacked)
