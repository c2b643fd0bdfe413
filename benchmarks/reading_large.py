"""Large files read: ours beside trimesh and meshio, each in a process of its own.

``python -m benchmarks.reading_large`` writes a creature as PLY, OBJ and STL, binary and text, each
of about 57 MB. It prints the seconds of one processor that reading takes, and the peak of memory
above that before, as a multiple of the arrays that the file holds: vertices as float64 and faces as
int64, three vertices a face in STL. "merged" has one vertex for each place, and is cleaned where we
read it. meshio merges STL always, and nothing else. ``--megabytes`` makes other sizes.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import trimesh
from rich.console import Console
from rich.table import Table

from benchmarks.cost import creature_file
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh

MEGABYTES = 57
SPECIES = "human"
FEWEST = 2000  # vertices of a creature
BYTES_OF_A_VERTEX = {"ply": 38, "obj": 75, "stl": 100, "text.stl": 530}  # with its two faces
Sizes = tuple[int, int]


def ply_of_singles(mesh: TriangleMesh) -> bytes:
    """Write binary PLY with single precision, as scanners do."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {mesh.n_vertices}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {mesh.n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(mesh.n_faces, dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    return header.encode() + mesh.vertices.astype("<f4").tobytes() + faces.tobytes()


def obj_of_six_decimals(mesh: TriangleMesh) -> bytes:
    """Write OBJ as most programs do."""
    rows = [f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in mesh.vertices.tolist()]
    rows += [f"f {a} {b} {c}\n" for a, b, c in (mesh.faces + 1).tolist()]
    return "".join(rows).encode()


def text_stl(mesh: TriangleMesh) -> bytes:
    """Write STL as text, indented as most programs do."""
    normals = mesh.face_normals
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rows = ["solid shape\n"]
    for (x, y, z), corners in zip(
        normals.tolist(), mesh.vertices[mesh.faces].tolist(), strict=True
    ):
        rows.append(f"  facet normal {x:e} {y:e} {z:e}\n    outer loop\n")
        rows += [f"      vertex {a:e} {b:e} {c:e}\n" for a, b, c in corners]
        rows.append("    endloop\n  endfacet\n")
    return "".join([*rows, "endsolid shape\n"]).encode()


WRITERS: dict[str, Callable[[TriangleMesh], bytes]] = {
    "ply": ply_of_singles,
    "obj": obj_of_six_decimals,
    "stl": lambda mesh: write(mesh, "stl"),
    "text.stl": text_stl,
}


def ours(path: Path) -> Sizes:
    """As it is in the file."""
    mesh = parse(path.read_bytes(), filename=path.name).mesh
    return mesh.n_vertices, mesh.n_faces


def ours_merged(path: Path) -> Sizes:
    """Read and cleaned, as every upload is."""
    mesh = clean(parse(path.read_bytes(), filename=path.name).mesh).mesh
    return mesh.n_vertices, mesh.n_faces


def by_trimesh(path: Path) -> Sizes:
    """As it is in the file."""
    mesh = trimesh.load_mesh(path, process=False, maintain_order=True)
    return len(mesh.vertices), len(mesh.faces)


def by_trimesh_merged(path: Path) -> Sizes:
    """As trimesh reads where it is told nothing."""
    mesh = trimesh.load_mesh(path)
    return len(mesh.vertices), len(mesh.faces)


def by_meshio(path: Path) -> Sizes:
    """As it is in the file."""
    mesh = meshio.read(path)
    return len(mesh.points), len(mesh.cells_dict["triangle"])


READERS: dict[str, Callable[[Path], Sizes]] = {
    "ours": ours,
    "trimesh": by_trimesh,
    "meshio": by_meshio,
    "ours, merged and cleaned": ours_merged,
    "trimesh, merged": by_trimesh_merged,
}


def read_once(reader: str, path: Path, warm: Path) -> dict[str, float]:
    """Seconds and bytes of reading a file, after a small one of its format was read."""
    warnings.simplefilter("ignore")
    READERS[reader](warm)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = memory("VmRSS")
    start = time.process_time()
    vertices, faces = READERS[reader](path)
    seconds = time.process_time() - start
    return {
        "seconds": seconds,
        "bytes": 1024 * (memory("VmHWM") - before),
        "vertices": vertices,
        "faces": faces,
    }


def memory(kind: str) -> int:
    """Kilobytes that the system counts for this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(kind))


def in_its_own_process(reader: str, path: Path, warm: Path) -> dict[str, float] | str:
    """What `read_once` measures, or the last words of the error."""
    command = [sys.executable, "-m", "benchmarks.reading_large", "--one"]
    command += [reader, str(path), str(warm)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, env=environment, text=True, check=False)
    if done.returncode:
        return str((done.stderr.splitlines() or ["nothing"])[-1][:40])
    measured: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return measured


def main() -> None:
    """Write, read in turns, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--megabytes", type=float, default=MEGABYTES)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", nargs="+", default=list(WRITERS), choices=list(WRITERS))
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        reader, path, warm = options.one
        sys.stdout.write(json.dumps(read_once(reader, Path(path), Path(warm))))
        return
    table = Table("file", "of MB", "reader", "vertices", "faces", "seconds", "MB", "/ arrays")
    with tempfile.TemporaryDirectory() as folder:
        for kind in options.only:
            path, warm = (Path(folder) / f"{name}.{kind}" for name in ("large", "small"))
            vertices = round(1e6 * options.megabytes / BYTES_OF_A_VERTEX[kind])
            for target, count in ((path, vertices), (warm, FEWEST)):
                target.write_bytes(WRITERS[kind](parse(creature_file(SPECIES, count)).mesh))
            found: dict[str, list[dict[str, float] | str]] = {reader: [] for reader in READERS}
            for _ in range(options.repeats):
                for reader, ones in found.items():
                    ones.append(in_its_own_process(reader, path, warm))
            vertices, faces = ours(path)
            arrays = 24 * (vertices + faces)
            size = f"{path.stat().st_size / 1e6:.1f}"
            for reader, ones in found.items():
                table.add_row(kind, size, reader, *_columns(ones, arrays))
            table.add_section()
    Console(width=120).print(table)


def _columns(ones: list[dict[str, float] | str], arrays: int) -> list[str]:
    """Medians of what was measured beside the bytes of the arrays, or the error."""
    measured = [one for one in ones if not isinstance(one, str)]
    if not measured:
        return [str(ones[0]), "", "", "", ""]
    vertices, faces = (int(measured[0][key]) for key in ("vertices", "faces"))
    seconds = statistics.median(one["seconds"] for one in measured)
    peak = statistics.median(one["bytes"] for one in measured)
    memory = f"{peak / 1e6:,.0f}", f"{peak / arrays:.1f}"
    return [f"{vertices:,}", f"{faces:,}", f"{seconds:.2f}", *memory]


if __name__ == "__main__":
    main()
