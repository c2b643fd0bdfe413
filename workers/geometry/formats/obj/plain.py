"""OBJ files of plain lines, read some megabytes at a time: nearly all files are such.

A plain line begins with its letter, has nothing in it but numbers (and slashes in a face), and ends
where it ends. What is not plain is left to `workers.geometry.formats.obj.statements`, which knows
every other way of writing and says what is wrong.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.formats.text.tokens import Polygons

PIECE = 1 << 20  # bytes that are read at a time
WITHOUT_LETTERS = bytes.maketrans(b"vf\t", b"   ")
STRANGE = (b"#", b"\\", b",", b";")  # in a vertex
LONGEST_INDEX = 18  # digits: below 2^63
LINES_OF_A_RUN = 4  # at least, on average: files of shorter runs are no faster here
FEW_RUNS = 16_384  # in a piece: so many do no harm

BLANK, DIGIT, SLASH, OTHER = range(4)
KINDS = np.full(256, OTHER, dtype=np.uint8)
KINDS[[ord(" "), ord("\n")]] = BLANK
KINDS[ord("0") : ord("9") + 1] = DIGIT
KINDS[ord("/")] = SLASH


@dataclass(frozen=True, eq=False)
class PlainObj:
    """What the lines of a file hold.

    Attributes
    ----------
    vertices : (n, 3) float64
        Positions.
    width : int
        Numbers of a vertex, at least three.
    polygons : Polygons
        Corners as in the file, from 0 or from 1.
    others : bytes
        All lines that are neither vertices nor faces.
    """

    vertices: FloatArray
    width: int
    polygons: Polygons
    others: bytes


@dataclass(eq=False)
class _Parts:
    """What the pieces of a file hold."""

    vertices: list[FloatArray] = field(default_factory=list)
    counts: list[IntArray] = field(default_factory=list)
    corners: list[IntArray] = field(default_factory=list)
    others: list[bytes] = field(default_factory=list)
    width: int = 0


def read_plain(data: bytes) -> PlainObj | None:
    """Read a file of plain lines.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    PlainObj or None
        None where any line is not plain, or a face counts its vertices from the last one.
    """
    parts = _Parts()
    for piece in _pieces(data):
        if not _read_piece(piece, parts):
            return None
    if not parts.vertices or not parts.corners:
        return None
    polygons = Polygons(np.concatenate(parts.counts), np.concatenate(parts.corners))
    parts.counts, parts.corners = [], []
    vertices = np.concatenate(parts.vertices)
    return PlainObj(vertices, parts.width, polygons, b"".join(parts.others))


def _pieces(data: bytes) -> Iterator[bytes]:
    """Cut a text at line ends; each piece ends in one."""
    start = 0
    while start < len(data):
        end = data.find(b"\n", start + PIECE) + 1 or len(data)
        piece = data[start:end]
        if b"\r" in piece:
            piece = piece.replace(b"\r\n", b"\n")
        yield piece if piece.endswith(b"\n") else piece + b"\n"
        start = end


def _read_piece(piece: bytes, parts: _Parts) -> bool:
    """Add what a piece holds; False where it has a line that is not plain."""
    if b"\r" in piece:
        return False
    text = np.frombuffer(piece, dtype=np.uint8)
    ends = np.flatnonzero(text == ord("\n")) + 1  # (l,)
    starts = np.append(0, ends[:-1])
    letters = _letters(text, starts)
    if letters is None:
        return False
    first_of_run = np.flatnonzero(np.append(True, letters[1:] != letters[:-1]))
    if len(first_of_run) * LINES_OF_A_RUN > len(letters) + FEW_RUNS:
        return False
    last_of_run = np.append(first_of_run[1:], len(letters)) - 1
    runs = zip(
        letters[first_of_run].tolist(),
        starts[first_of_run].tolist(),
        ends[last_of_run].tolist(),
        strict=True,
    )
    of_letter: dict[int, list[bytes]] = {ord("v"): [], ord("f"): [], 0: []}
    for letter, start, end in runs:
        of_letter[letter].append(piece[start:end])
    parts.others += of_letter[0]
    n_vertices = int((letters == ord("v")).sum())
    vertices = b"".join(of_letter[ord("v")])
    return _read_vertices(vertices, n_vertices, parts) and _read_faces(
        b"".join(of_letter[ord("f")]), parts
    )


def _letters(text: NDArray[np.uint8], starts: IntArray) -> NDArray[np.uint8] | None:
    """Letter (l,) of each line that is a vertex or a face, 0 of others; None if one is unclear."""
    first = text[starts]
    second = text.take(np.minimum(starts + 1, len(text) - 1))
    is_element = ((first == ord("v")) | (first == ord("f"))) & (
        (second == ord(" ")) | (second == ord("\t"))
    )
    is_named = (first == ord("v")) & ((second == ord("t")) | (second == ord("n")))
    is_unclear: BoolArray = np.isin(first, np.frombuffer(b"vfVF \t", dtype=np.uint8))
    if (is_unclear & ~is_element & ~is_named).any():
        return None
    letters: NDArray[np.uint8] = np.where(is_element, first, 0)
    return letters


def _read_vertices(text: bytes, count: int, parts: _Parts) -> bool:
    """Add positions of lines ``v x y z …`` that all have as many numbers."""
    if not count:
        return True
    if any(sign in text for sign in STRANGE):
        return False
    if not parts.width:
        parts.width = len(text[: text.index(b"\n")].split()) - 1
    words = text.translate(WITHOUT_LETTERS).split()
    if parts.width < 3 or len(words) != parts.width * count:
        return False
    try:
        values = np.array(words, dtype=np.float64).reshape(count, parts.width)
    except ValueError:
        return False
    parts.vertices.append(values if parts.width == 3 else values[:, :3].copy())
    return True


def _read_faces(text: bytes, parts: _Parts) -> bool:
    """Add corners of lines ``f a b c …``, ``f a/t/n …`` whose indices are plain digits."""
    if not text:
        return True
    letters = np.frombuffer(text.translate(WITHOUT_LETTERS), dtype=np.uint8)
    kinds = KINDS.take(letters)
    if kinds.max() == OTHER:
        return False
    after_blank = kinds[:-1] == BLANK  # a piece begins with the letter, which is a blank by now
    starts = np.flatnonzero(after_blank & (kinds[1:] == DIGIT)) + 1  # (c,)
    if len(starts) != np.count_nonzero(after_blank & (kinds[1:] != BLANK)):
        return False  # a corner begins with a slash
    corners = np.zeros(len(starts), dtype=np.int64)
    going, place = np.arange(len(starts)), starts
    for _ in range(LONGEST_INDEX):
        corners[going] = 10 * corners[going] + (letters.take(place) - ord("0"))
        more = kinds.take(place + 1) == DIGIT  # a piece ends in a line end
        if not more.all():
            going, place = going[more], place[more]
        place = place + 1
        if len(place) == 0:
            break
    if len(place):
        return False
    before = np.searchsorted(starts, np.flatnonzero(letters == ord("\n")))
    parts.counts.append(np.diff(before, prepend=0))
    parts.corners.append(corners)
    return True
