"""Building a benchmark: its files on several processors, and its manifest."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from proteus.benchmark.making import Outcome, Work, exists, make_files, plan_work
from proteus.benchmark.plan import (
    BENCHMARK_VERSION,
    NULL,
    BenchmarkOptions,
    ShapePlan,
    near_twins,
    plan_shapes,
)
from proteus.benchmark.sources import MeshFile
from proteus.processes import run_in_processes, write_whole
from proteus.version import program_version
from workers.creatures import CREATURES_VERSION
from workers.errors import InvalidRequestError
from workers.transformations import TRANSFORMATION_VERSION

MANIFEST = "benchmark.json"
IDENTITY = ("parameters", "versions", "shapes")
"""Entries of the manifest that two equal benchmarks share."""
Manifest = dict[str, Any]
Advance = Callable[[int, int], None]
"""Called with the number of files that exist, and the number that will."""


@dataclass(frozen=True)
class Built:
    """A benchmark in a folder.

    Attributes
    ----------
    folder : Path
    manifest : dict
        The contents of ``benchmark.json``.
    """

    folder: Path
    manifest: Manifest

    @property
    def files(self) -> list[Path]:
        """The meshes, in order of their names."""
        return [self.folder / name for name in self.manifest["files"]]

    @property
    def digest(self) -> str:
        """A short digest of its contents."""
        identity = {name: self.manifest[name] for name in (*IDENTITY, "files")}
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:8]


def build_benchmark(
    options: BenchmarkOptions, out: Path, *, processes: int, advance: Advance = lambda *_: None
) -> Built:
    """Make the missing files of a benchmark, and its manifest.

    Parameters
    ----------
    options : BenchmarkOptions
    out : Path
        Empty, missing, or the same benchmark, finished or not.
    processes : int
        Number to use; the files do not depend on it.
    advance : callable

    Raises
    ------
    InvalidRequestError
        A source cannot be used, or ``out`` holds something else.
    """
    shapes = plan_shapes(options)
    manifest = _begin(options, shapes, out)
    work = plan_work(shapes, options)
    outcomes = []
    done, total = 0, sum(len(item.names) for item in work)
    advance(done, total)
    for outcome in _in_processes(work, options, out, processes):
        outcomes.append(outcome)
        done += len(outcome.work.names)
        advance(done, total)
    for unfinished in out.glob("*.part"):  # of a run that was killed
        unfinished.unlink()
    finished = manifest | _result(shapes, work, outcomes, out)
    finished |= {"made_by": f"proteus {program_version()}", "complete": True}
    _write_json(out / MANIFEST, finished)
    return Built(out, finished)


def read_benchmark(folder: Path) -> Built:
    """Return the benchmark in a folder.

    Raises
    ------
    InvalidRequestError
        There is none, or its build is not finished.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InvalidRequestError(f"{folder} holds no {MANIFEST}; see proteus benchmark build")
    manifest = json.loads(path.read_text())
    if not manifest.get("complete"):
        raise InvalidRequestError(
            f"the benchmark in {folder} is not finished; proteus benchmark build continues it"
        )
    return Built(folder, manifest)


def _begin(options: BenchmarkOptions, shapes: Sequence[ShapePlan], out: Path) -> Manifest:
    """Make the folder and its first manifest, or check that they are of this benchmark."""
    identity = {
        "parameters": options.to_json(),
        "versions": versions(),
        "shapes": [shape.to_json() for shape in shapes],
    }
    path = out / MANIFEST
    if path.is_file():
        known = json.loads(path.read_text())
        different = [name for name, value in identity.items() if known.get(name) != value]
        if different:
            raise InvalidRequestError(
                f"{out} holds another benchmark (its {' and '.join(different)} differ); "
                "choose another folder, or remove this one"
            )
    elif out.exists() and any(out.iterdir()):
        raise InvalidRequestError(f"{out} is not empty and holds no {MANIFEST}; choose another")
    out.mkdir(parents=True, exist_ok=True)
    if not path.is_file():
        _write_json(path, identity | {"complete": False})
    return identity


def versions() -> dict[str, str]:
    """Return the versions of the code that decides on the files."""
    return {
        "benchmark": BENCHMARK_VERSION,
        "transformations": TRANSFORMATION_VERSION,
        "creatures": CREATURES_VERSION,
    }


def _in_processes(
    work: Sequence[Work], options: BenchmarkOptions, out: Path, processes: int
) -> Iterator[Outcome]:
    """Do the work on several processors; outcomes come as they are ready."""
    make = partial(make_files, options=options, out=out)
    if all(exists(out, name) for item in work for name in item.names):
        yield from map(make, work)
    else:
        yield from run_in_processes(make, work, processes=processes)


def _result(
    shapes: Sequence[ShapePlan], work: Sequence[Work], outcomes: Sequence[Outcome], out: Path
) -> Manifest:
    """Return what was made; the files of a shape that failed are removed."""
    failures = _failures(shapes, work, outcomes)
    for item in work:
        if item.shape.label in failures:
            for name in item.names:
                (out / name).unlink(missing_ok=True)
    made = [item for item in work if item.shape.label not in failures]
    left_out = sorted(
        {pair for outcome in outcomes for pair in outcome.left_out} | set(_same_again(shapes))
    )
    nulls = [item.shape for item in made if item.transformation == NULL]
    return {
        "files": sorted(name for item in made for name in item.names),
        "counts": {
            "nulls": sum(shape.is_query for shape in nulls),
            "distractors": sum(not shape.is_query for shape in nulls),
            "queries": sum(len(item.names) for item in made if item.transformation != NULL),
        },
        "failures": list(failures.values()),
        "left_out": [{"file": file, "reason": reason} for file, reason in left_out],
        "notes": [
            f"{count} individuals of one species, {species}, are query classes: near-twins"
            for species, count in near_twins(shapes).items()
        ],
    }


def _same_again(shapes: Sequence[ShapePlan]) -> Iterator[tuple[str, str]]:
    """Iterate over files that are a query class in another pose, with the reason."""
    for shape in shapes:
        if shape.same_as and isinstance(shape.source, MeshFile):
            reason = f"its vertices are connected as those of {shape.same_as}: the same shape"
            yield shape.source.name, reason


def _failures(
    shapes: Sequence[ShapePlan], work: Sequence[Work], outcomes: Sequence[Outcome]
) -> dict[str, Mapping[str, Any]]:
    """Return the failures by label; of several the first in the order of the work."""
    order = {item: number for number, item in enumerate(work)}
    failed = sorted((o for o in outcomes if o.failure), key=lambda o: order[o.work])
    found: dict[str, Mapping[str, Any]] = {}
    for outcome in failed:
        shape = outcome.work.shape
        item = {"label": shape.label, "transformation": outcome.work.transformation}
        found.setdefault(shape.label, {**item, "reason": outcome.failure})
    return found


def _write_json(path: Path, document: Manifest) -> None:
    write_whole(path, (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode())
