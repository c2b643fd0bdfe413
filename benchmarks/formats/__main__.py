"""Our reader of mesh files beside those of other programs, on your own files.

``python -m benchmarks.formats FOLDER`` reads every file below a folder with ours, trimesh, meshio,
MeshLab and, for brain surfaces, nibabel. A line says where two make another mesh of the same file:
triangles, area, extent, or connected pieces differ by more than rounding. Meshes are compared as
they were read, before our repairs. Other lines say who refused a file, and with what words. A
table counts a format.

Each reader runs in a process of its own, and is ended where a file takes it too long or too much
memory. Raw results go to a JSON file; ``--from`` prints them again without reading. MeshLab takes
part where pymeshlab is installed, or in the environment whose Python ``--meshlab`` names.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.formats.comparison import (
    OURS,
    Record,
    Totals,
    added,
    format_of,
    is_mesh_file,
    report,
    totals,
)
from benchmarks.formats.process import Reader

PEERS = ("trimesh", "meshio", "meshlab", "nibabel")
ALIKE = 3
"""Lines of one format that say the same; the others are counted."""
LARGEST_BYTES = 512 << 20
KINDS = {
    "differs": "another mesh than a peer's",
    "refused": "refused by ours",
    "all": "refused by all",
    "fails": "refused by a peer, read by ours",
}


def files_below(folder: Path) -> list[Path]:
    """Return the files of a folder, at any depth; hidden ones are left out."""
    return sorted(
        path
        for path in folder.rglob("*")
        if path.is_file()
        and 0 < path.stat().st_size <= LARGEST_BYTES
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    )


def measure(paths: Sequence[Path], folder: Path, readers: Sequence[Reader]) -> Iterator[Record]:
    """Ask every reader about every file that it takes by its name; ours about each."""
    with ThreadPoolExecutor(len(readers)) as threads:
        for path in paths:
            asked = [one for one in readers if one.takes(path)]
            answers = threads.map(lambda one, path=path: one.ask(path), asked)
            yield {
                "path": str(path.relative_to(folder)),
                "bytes": path.stat().st_size,
                "answers": {one.name: answer for one, answer in zip(asked, answers, strict=True)},
            }


def read_folder(folder: Path, readers: Sequence[Reader], console: Console) -> dict[str, Any]:
    """Return the raw results of a folder."""
    paths = files_below(folder)
    files = []
    try:
        for record in track(
            measure(paths, folder, readers), "reading", len(paths), console=console
        ):
            files.append(record)
    finally:
        for one in readers:
            one.stop()
    versions = {one.name: one.version for one in readers}
    return {"folder": str(folder), "readers": versions, "files": files}


def summary(results: dict[str, Totals], readers: Sequence[str]) -> Table:
    """Return the table of totals."""
    peers = [name for name in readers if name != OURS]
    table = Table(caption="alone: read by ours, and by none of the peers that were asked")
    table.add_column("format")
    for column in ("files", OURS, "alone"):
        table.add_column(column, justify="right")
    for name in peers:
        table.add_column(name, justify="right", no_wrap=True)
        table.add_column("the same", justify="right")
    for form, one in {**results, "all": added(results.values())}.items():
        if form == "all":
            table.add_section()
        cells = [str(one.files), str(one.read[OURS]), str(one.alone)]
        for name in peers:
            cells += [f"{one.read[name]} of {one.asked[name]}", str(one.same[name])]
        table.add_row(form, *cells)
    return table


def show(results: dict[str, Any], console: Console, *, whole: bool) -> None:
    """Print the lines and the totals of raw results; files that fail alike as one, or whole."""
    meshes = [record for record in results["files"] if is_mesh_file(record)]
    lines = [(format_of(record), line) for record in meshes for line in report(record)]
    for kind, title in KINDS.items():
        chosen = [(form, line) for form, line in lines if line.kind == kind]
        chosen.sort(key=lambda pair: (pair[0], pair[1].path))
        console.rule(f"{title}: {len(chosen)}", align="left")
        alike = Counter((form, line.gist) for form, line in chosen)
        shown: Counter[tuple[str, str]] = Counter()
        for form, line in chosen:
            key = form, line.gist
            shown[key] += 1
            if shown[key] <= ALIKE or whole:
                console.print(f"{form}  {line.path}  {line.text}", markup=False, highlight=False)
            elif shown[key] == alike[key]:
                more = alike[key] - ALIKE
                console.print(f"{form}  … and {more} more: {line.gist}", markup=False)
    versions = ", ".join(
        f"{name} {version}".strip() for name, version in results["readers"].items()
    )
    passed_over = len(results["files"]) - len(meshes)
    console.rule(align="left")
    console.print(f"{len(meshes)} files; {passed_over} others are no meshes. Readers: {versions}.")
    console.print(summary(totals(meshes), list(results["readers"])))


def main() -> None:
    """Read, save, compare, print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.formats",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path, nargs="?", help="with the files, at any depth")
    parser.add_argument("--out", type=Path, default=Path("formats.json"), help="raw results")
    parser.add_argument("--from", dest="saved", type=Path, help="print raw results again")
    parser.add_argument("--seconds", type=float, default=60.0, help="for a reader and a file")
    parser.add_argument("--memory", type=float, default=4.0, help="GiB, for a reader")
    parser.add_argument("--meshlab", default=sys.executable, help="a Python that has pymeshlab")
    parser.add_argument("--all", action="store_true", help="a line for each of many alike")
    asked = parser.parse_args()
    console, messages = Console(soft_wrap=True, width=150), Console(stderr=True)
    if asked.saved is not None:
        show(json.loads(asked.saved.read_text()), console, whole=asked.all)
        return
    if asked.folder is None or not asked.folder.is_dir():
        parser.error(f"{asked.folder or 'FOLDER'} is no folder")
    started = []
    for name in (OURS, *PEERS):
        python = asked.meshlab if name == "meshlab" else sys.executable
        one = Reader(name, python, asked.seconds, round(asked.memory * (1 << 30)))
        if one.start():
            started.append(one)
        else:
            messages.print(f"{name} is not installed and takes no part")
    results = read_folder(asked.folder, started, messages)
    asked.out.write_text(json.dumps(results, indent=1) + "\n")
    messages.print(f"raw results: {asked.out}")
    show(results, console, whole=asked.all)


if __name__ == "__main__":
    main()
