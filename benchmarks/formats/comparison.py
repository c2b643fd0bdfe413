"""Where two readers differ on a file, in words, and how often a format."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any

import numpy as np

Answer = Mapping[str, Any]
Record = Mapping[str, Any]
"""A file: ``path``, ``bytes``, and ``answers`` by the reader's name."""
OURS = "ours"
ROUNDING = 1e-5
"""Relative; files in text often have six digits."""
SINGLE = float(np.finfo(np.float32).eps)
NOT_A_MESH = "UnsupportedFormatError"


@dataclass(frozen=True)
class Line:
    """One line of the report.

    Attributes
    ----------
    path : str
    kind : "differs", "refused", "fails" or "all"
        Another mesh than a peer's; refused by ours but read by a peer; refused by a peer but read
        by ours; refused by all.
    text : str
    """

    path: str
    kind: str
    text: str

    @property
    def gist(self) -> str:
        """The text without its numbers: equal for files that fail alike."""
        return re.sub(r"[\d.,]*\d|'[^']*'|\"[^\"]*\"", "…", self.text)


@dataclass
class Totals:
    """What became of the files of one format.

    Attributes
    ----------
    files : int
    read : Counter
        Files that a reader read, by its name.
    asked, same : Counter
        Files that a peer was asked for, and those of which it and ours made the same mesh.
    alone : int
        Files that ours alone read, of those of which a peer was asked.
    """

    files: int = 0
    read: Counter[str] = field(default_factory=Counter)
    asked: Counter[str] = field(default_factory=Counter)
    same: Counter[str] = field(default_factory=Counter)
    alone: int = 0


def is_mesh_file(record: Record) -> bool:
    """Whether ours knows the file for one of a mesh by its content, or a peer reads it."""
    answers = record["answers"]
    unknown = answers[OURS].get("type") == NOT_A_MESH
    return not unknown or any(_has_surface(answer) for answer in answers.values())


def format_of(record: Record) -> str:
    """Return the format that our reader found, or the ending of the file's name."""
    ending = PurePath(record["path"]).suffix[1:].lower()
    return str(record["answers"][OURS].get("format") or ending or "no ending")


def report(record: Record) -> Iterator[Line]:
    """Yield what is to be said of a file; nothing where all agree."""
    answers: Mapping[str, Answer] = record["answers"]
    ours = answers[OURS]
    peers = {name: answer for name, answer in answers.items() if name != OURS}
    path = str(record["path"])
    if "error" in ours:
        readers = [f"{name} {_mesh(a)}" for name, a in peers.items() if _has_surface(a)]
        kind = "refused" if readers else "all"
        text = f"refused: {ours['error']}"
        others = readers or [f"{name}: {a['error']}" for name, a in peers.items() if "error" in a]
        yield Line(path, kind, "; ".join([text, *others]))
        return
    if "error" in ours["cleaned"]:
        yield Line(path, "refused", f"refused when cleaned: {ours['cleaned']['error']}")
    for name, answer in peers.items():
        if "error" in answer:
            yield Line(path, "fails", f"{name} fails: {answer['error']}")
        elif found := differences(ours, answer):
            yield Line(path, "differs", f"{name}: " + "; ".join(found))


def differences(ours: Answer, theirs: Answer) -> list[str]:
    """Return how two meshes differ by more than rounding, empty where they do not."""
    if ours["faces"] and not theirs["faces"]:
        return [f"no faces, ours {ours['faces']:,}"]
    low, high = np.array(ours["low"]), np.array(ours["high"])
    size = float(np.linalg.norm(high - low)) or 1.0
    farthest = float(max(np.abs(low).max(), np.abs(high).max()))
    rounding = ROUNDING + 8 * SINGLE * farthest / size
    found = [
        f"{name} {theirs.get(key, 0):,}, ours {ours.get(key, 0):,}"
        for key, name in (
            ("faces", "faces"),
            ("components", "components"),
            ("faces_not_finite", "faces that are not finite"),
        )
        if ours.get(key, 0) != theirs.get(key, 0)
    ]
    if abs(ours["area"] - theirs["area"]) > 10 * rounding * max(ours["area"], theirs["area"]):
        found.append(f"area {theirs['area']:.6g}, ours {ours['area']:.6g}")
    other_low, other_high = np.array(theirs["low"]), np.array(theirs["high"])
    if max(np.abs(low - other_low).max(), np.abs(high - other_high).max()) > rounding * size:
        found.append(_bounds(high - low, other_high - other_low, rounding))
    return found


def _bounds(ours: Any, theirs: Any, rounding: float) -> str:
    """Say how bounds differ: moved, turned, of another scale, or otherwise."""
    size = float(np.linalg.norm(ours)) or 1.0
    factor = float(np.linalg.norm(theirs)) / size
    if np.allclose(ours, theirs, rtol=0, atol=rounding * size):
        return "the same size at another place"
    if np.allclose(np.sort(ours), np.sort(theirs), rtol=0, atol=rounding * size):
        return "the axes are others"
    if factor and np.allclose(factor * ours, theirs, rtol=0, atol=factor * rounding * size):
        return f"{factor:.6g} times as large"
    return f"extent {_extent(theirs)}, ours {_extent(ours)}"


def totals(records: Iterable[Record]) -> dict[str, Totals]:
    """Count a format's files by what became of them."""
    found: dict[str, Totals] = {}
    for record in records:
        one = found.setdefault(format_of(record), Totals())
        answers = record["answers"]
        one.files += 1
        one.read.update(name for name, answer in answers.items() if "error" not in answer)
        one.asked.update(name for name in answers if name != OURS)
        if "error" in answers[OURS]:
            continue
        peers = {name: a for name, a in answers.items() if name != OURS}
        read = {name: a for name, a in peers.items() if "error" not in a}
        one.alone += bool(peers) and not read
        one.same.update(name for name, a in read.items() if not differences(answers[OURS], a))
    return dict(sorted(found.items()))


def added(several: Iterable[Totals]) -> Totals:
    """Return the totals of several formats together."""
    whole = Totals()
    for one in several:
        whole.files += one.files
        whole.alone += one.alone
        whole.read.update(one.read)
        whole.asked.update(one.asked)
        whole.same.update(one.same)
    return whole


def _has_surface(answer: Answer) -> bool:
    return bool(answer.get("faces"))


def _mesh(answer: Answer) -> str:
    return f"reads {answer['faces']:,} faces of area {answer['area']:.6g}"


def _extent(extent: Any) -> str:
    return " × ".join(f"{length:.6g}" for length in extent)
