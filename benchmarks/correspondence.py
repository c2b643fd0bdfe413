"""How near points are matched: the true places are known, and pyFM matches the same pairs.

``python -m benchmarks.correspondence --poses FOLDER [--each N] [--creatures N] [--out FILE.json]``

FOLDER has a folder for each class, with meshes that share their vertex order; the one that is named
``…-reference`` is matched with N of the others. Creatures are of species that nothing was tuned on.
For each class there are poses, parts with half of the area of another pose, copies that are scaled
and turned, and mirrored copies. Errors are distances along the second shape between found and true
places, in √A of it. CPU seconds are those of one thread, from solved working meshes to points.

Both are told that mirrored copies are mirrored. pyFM (``pip install pyfmaps``) is left out where it
is not installed. It fits a functional map of 30 functions to wave kernel signatures, with the
weights of its quick start, and refines it by ZoomOut up to 110. It takes both shapes as wholes.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import cKDTree

from tests.meshes import random_rotation
from workers.correspondence import correspond
from workers.creatures import TESTED_SPECIES, make_creature
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.geodesics import distances_from, surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution, solve
from workers.geometry.topology import is_closed
from workers.geometry.transfer import closest_points
from workers.geometry.views import mapping_view
from workers.storage.shipped_models import shipped_whitening
from workers.transformations import transform

CLOSE = 0.05  # of √A
MEASURED = 400  # vertices of each pair
FACTOR = 2.5
EIGENPAIRS, FITTED, STEP, ROUNDS = 128, 30, 5, 16  # of pyFM, as its quick start has them
Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Case:
    """Two meshes, and the true place on the second for each vertex of the first."""

    kind: str
    name: str
    first: TriangleMesh
    second: TriangleMesh
    places: FloatArray


def cases_of(name: str, rest: TriangleMesh, poses: list[TriangleMesh]) -> Iterator[Case]:
    """All pairs of one class."""
    rng = np.random.default_rng(len(name))
    for number, pose in enumerate(poses):
        yield Case("pose", name, rest, pose, pose.vertices)
        cut = transform(rest, "partial", 4, seed=number)
        yield Case("part in a pose", name, cut.mesh, pose, pose.vertices[cut.origin])
    turned = TriangleMesh(FACTOR * rest.vertices @ random_rotation(rng).T, rest.faces)
    yield Case("scaled and turned", name, rest, turned, turned.vertices)
    mirror = TriangleMesh(rest.vertices * [-1.0, 1.0, 1.0], rest.faces[:, ::-1])
    yield Case("mirrored", name, rest, mirror, mirror.vertices)


def classes_of_folder(folder: Path, each: int) -> Iterator[tuple[str, list[TriangleMesh]]]:
    """Name and meshes of each class, the reference first."""
    for group in sorted(path for path in folder.iterdir() if path.is_dir()):
        files = sorted(group.iterdir())
        rest = [path for path in files if "reference" in path.name]
        others = [path for path in files if path not in rest]
        if rest:
            chosen = [*rest, *others[:: max(1, len(others) // each)][:each]]
            yield group.name, [parse(path.read_bytes(), filename=path.name).mesh for path in chosen]


def classes_of_creatures(count: int, each: int) -> Iterator[tuple[str, list[TriangleMesh]]]:
    """The same of creatures of tested species."""
    for species in TESTED_SPECIES[:count]:
        creature = make_creature(species, seed=11, vertices=6000)
        yield species, [creature.rest, *(creature.posed(seed) for seed in range(each))]


def solved(mesh: TriangleMesh) -> Solution:
    """The solution that the service would match."""
    cleaned = clean(mesh).mesh
    return solve(cleaned, mapping_view(is_closed=is_closed(cleaned)))


def ours(first: Solution, second: Solution, kind: str) -> tuple[IntArray, Row]:
    """Vertex of the second working mesh nearest to each point, and what else is told."""
    mirrored = True if kind == "mirrored" else None
    found = correspond(first, second, shipped_whitening(), mirrored=mirrored)
    faces = second.mesh.faces[found.faces]
    nearest: IntArray = faces[np.arange(len(faces)), found.barycentric.argmax(axis=1)]
    told = {
        "scale": found.scale,
        "coverage": found.coverage,
        "told mirrored": found.mirrored,
        "confidence": found.confidence,
    }
    return nearest, told


def prepare_pyfm() -> Callable[[Solution, Solution, str], tuple[IntArray, Row]] | None:
    """The same by pyFM, if it is there; its spectra are computed before the clock starts."""
    try:
        from pyFM.functional import FunctionalMapping  # type: ignore[import-not-found]
        from pyFM.mesh import TriMesh  # type: ignore[import-not-found]
    except ImportError:
        return None

    def match(first: Solution, second: Solution, kind: str) -> tuple[IntArray, Row]:
        meshes = []
        for one in (second, first):  # its maps go from its second mesh to its first
            unit = np.sqrt(one.mesh.area)
            mesh = TriMesh(one.mesh.vertices / unit, one.mesh.faces)
            mesh.process(k=EIGENPAIRS, intrinsic=False)
            meshes.append(mesh)
        begun = time.process_time()
        model = FunctionalMapping(*meshes)
        model.preprocess(descr_type="WKS", subsample_step=2, k_process=EIGENPAIRS)
        weights = {"w_descr": 1.0, "w_lap": 0.1, "w_dcomm": 1.0, "w_orient": 1.0}
        model.fit(K=FITTED, **weights, orient_reversing=kind == "mirrored")
        refined = model.zoomout_refine(nit=ROUNDS, step=STEP)
        nearest = np.asarray(model.get_p2p(refined), dtype=np.int64)
        return nearest, {"seconds": time.process_time() - begun}

    return match


def measured(case: Case) -> Iterator[Row]:
    """Errors of both on one pair."""
    first, second = solved(case.first), solved(case.second)
    vertices = np.unique(np.linspace(0, first.mesh.n_vertices - 1, MEASURED).astype(np.int64))
    found = closest_points(case.first, first.mesh.vertices[vertices])
    truth = cKDTree(second.mesh.vertices).query(found.interpolate(case.places))[1]
    graph = surface_graph(second.mesh)
    unit = np.sqrt(second.mesh.area)
    for method, match in (("proteus", ours), ("pyFM", prepare_pyfm())):
        if match is None:
            continue
        begun = time.process_time()
        images, told = match(first, second, case.kind)
        seconds = told.pop("seconds", time.process_time() - begun)
        rows = distances_from(graph, np.asarray(truth, dtype=np.int64), np.inf)
        off = rows[np.arange(len(vertices)), images[vertices]] / unit
        off = np.where(np.isfinite(off), off, 1.0)  # another component
        close = off < CLOSE
        confidence = told.pop("confidence", None)
        if confidence is not None:
            sure = confidence[vertices]
            told |= {"confidence": float(sure.mean())}
            if (sure > 0.5).any():
                told |= {"close where sure": float(close[sure > 0.5].mean())}
        yield {
            "kind": case.kind,
            "class": case.name,
            "method": method,
            "error": float(off.mean()),
            "close": float(close.mean()),
            "seconds": seconds,
            **told,
        }


def show(title: str, rows: list[Row], by: str) -> None:
    """Print means over the pairs of each kind, or of each class."""
    table = Table(
        by, "pairs", "method", "mean error, √A", "median pair", f"within {CLOSE}", "CPU s a pair",
        title=title,
    )  # fmt: skip
    groups = dict.fromkeys((row[by], row["method"]) for row in rows)
    for group, method in sorted(groups, key=lambda one: str(one[0])):
        own = [row for row in rows if (row[by], row["method"]) == (group, method)]
        errors = [row["error"] for row in own]
        table.add_row(
            group, str(len(own)), method,
            f"{np.mean(errors):.3f}", f"{np.median(errors):.3f}",
            f"{100 * np.mean([row['close'] for row in own]):.0f} %",
            f"{np.median([row['seconds'] for row in own]):.2f}",
        )  # fmt: skip
    Console(width=120).print(table)


def main() -> None:
    """Measure all pairs and print means."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=Path, help="folder of classes")
    parser.add_argument("--creatures", type=int, default=0, help="how many tested species")
    parser.add_argument("--each", type=int, default=2, help="poses of a class")
    parser.add_argument("--out", type=Path, help="all rows as JSON")
    asked = parser.parse_args()
    groups = []
    if asked.poses is not None:
        groups.append(("poses", classes_of_folder(asked.poses, asked.each)))
    if asked.creatures:
        groups.append(("creatures", classes_of_creatures(asked.creatures, asked.each)))
    if prepare_pyfm() is None:
        sys.stderr.write("pyFM is not installed: pip install pyfmaps\n")
    everything: list[Row] = []
    for title, classes in groups:
        rows: list[Row] = []
        for name, (rest, *poses) in classes:
            for case in cases_of(name, rest, poses):
                rows += [{"set": title, **row} for row in measured(case)]
            sys.stderr.write(f"{name}\n")
        show(title, rows, "kind")
        show(f"{title}, poses alone", [row for row in rows if row["kind"] == "pose"], "class")
        everything += rows
    if asked.out is not None:
        asked.out.write_text(json.dumps(everything, indent=1))


if __name__ == "__main__":
    main()
