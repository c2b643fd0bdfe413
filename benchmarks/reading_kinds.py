"""What reading costs as files grow, for every kind of file that the tests build.

``python -m benchmarks.reading_kinds`` builds each kind of three bodies, each with four times the
faces of the one before, and prints the processor time of the largest per megabyte and the exponents
of the time, as ``benchmarks.reading`` does. Kinds whose size is not that of the body are left out.
``--only NAME`` takes those with NAME in theirs, ``--above X`` those of a larger exponent.
"""

import argparse
import math
import multiprocessing
from itertools import pairwise

from rich.console import Console
from rich.table import Table

from benchmarks.kinds import kinds_of
from benchmarks.reading import seconds
from tests.meshes import bumpy_sphere

LEVELS = (3, 4, 5)  # of a subdivided sphere: 1,280, 5,120 and 20,480 faces
LEAST_GROWTH = 2.0
SHORTEST_SECONDS = 1e-3  # what is shorter is mostly overhead
Point = tuple[int, float, str]
"""Bytes, seconds and outcome."""


def measure(level: int, only: str) -> dict[str, Point]:
    """Time the kinds of one body, in a process that was just started."""
    found = {}
    for kind, data in kinds_of(bumpy_sphere(level)):
        if only.lower() in kind.name.lower():
            taken, outcome = seconds(data, kind.filename)
            found[kind.name] = len(data), taken, outcome
    return found


def exponents(points: list[Point]) -> list[float]:
    """Return by what power of the size the time grows, from each size to the next."""
    return [
        math.log(max(after[1], SHORTEST_SECONDS) / max(before[1], SHORTEST_SECONDS))
        / math.log(after[0] / before[0])
        for before, after in pairwise(points)
    ]


def main() -> None:
    """Measure each size in a process of its own, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run those with this in their name")
    parser.add_argument("--above", type=float, default=-9.0, help="print larger exponents alone")
    asked = parser.parse_args()
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        sizes = [pool.apply(measure, (level, asked.only)) for level in LEVELS]
    table = Table(title="reading the kinds of files, three sizes each")
    for column in ("file", "largest (MB)", "ms a MB", "exponents", "outcome"):
        table.add_column(column, justify="left" if column in ("file", "outcome") else "right")
    for name in sizes[0]:
        points = [size[name] for size in sizes if name in size]
        lengths = [point[0] for point in points]
        if len(points) < len(LEVELS) or lengths[-1] < LEAST_GROWTH * lengths[-2]:
            continue
        found = exponents(points)
        length, taken, outcome = points[-1]
        if found[-1] > asked.above:
            table.add_row(
                *(name, f"{length / 1e6:.2f}", f"{1e9 * taken / length:.0f}"),
                *(" ".join(f"{x:.2f}" for x in found), outcome),
            )
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
