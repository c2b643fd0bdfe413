"""Readers on damaged files: ours beside trimesh's, on the same bytes.

``python -m benchmarks.readers`` prints for each format how often a reader named the fault, raised
another error, returned nonsense in silence (no faces, indices out of range, NaN), or returned a
mesh. Our readers leave ranges and NaN to the cleaning that follows them.
"""

import io
import logging
import random
import warnings
from collections import Counter
from collections.abc import Callable

import numpy as np
import trimesh
from rich.console import Console
from rich.table import Table

from tests.meshes import bumpy_sphere
from workers.errors import ProteusError
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse, write
from workers.geometry.mesh import TriangleMesh

FORMATS = ("off", "ply", "stl", "obj", "glb")
FILES = 150
OUTCOMES = ("said why", "raised something else", "nonsense", "mesh")


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Cut, flip bytes of, or insert digits or bytes into a file, most often near its start."""
    copy = bytearray(data)
    kind = rng.choice(("cut", "flip", "digits", "bytes"))
    place = rng.randrange(len(copy) if kind != "digits" else min(len(copy), 400))
    if kind == "cut":
        del copy[place:]
    elif kind == "flip":
        for _ in range(rng.randrange(1, 6)):
            near = min(len(copy), 600) if rng.random() < 0.5 else len(copy)
            copy[rng.randrange(near)] = rng.randrange(256)
    elif kind == "digits":
        copy[place : place + 1] = b"9999999"
    else:
        copy[place:place] = rng.randbytes(8)
    return bytes(copy)


def read_ours(data: bytes, form: str) -> TriangleMesh:
    """Read and clean as an upload is."""
    return clean(parse(data, filename=f"a.{form}").mesh).mesh


def read_trimesh(data: bytes, form: str) -> TriangleMesh:
    """Read as trimesh does when it is told to change nothing."""
    loaded = trimesh.load_mesh(io.BytesIO(data), file_type=form, process=False)
    return TriangleMesh(loaded.vertices, loaded.faces)


def outcome(read: Callable[[bytes, str], TriangleMesh], data: bytes, form: str) -> str:
    """What came of reading a file; a ``ValueError`` of trimesh counts as a reason."""
    try:
        mesh = read(data, form)
    except (ProteusError, ValueError):
        return "said why"
    except Exception:  # what it is does not matter: no caller could tell it from a bug
        return "raised something else"
    sound = mesh.n_faces and mesh.faces.min() >= 0 and mesh.faces.max() < mesh.n_vertices
    return "mesh" if sound and np.isfinite(mesh.vertices).all() else "nonsense"


def main() -> None:
    """Damage, read, count, print."""
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    table = Table(title=f"{FILES} damaged files a format")
    for column in ("format", "reader", *OUTCOMES):
        table.add_column(column, justify="right")
    for form in FORMATS:
        whole = write(bumpy_sphere(3, seed=1), form)
        for name, read in (("trimesh", read_trimesh), ("ours", read_ours)):
            rng = random.Random(1)
            found = Counter(outcome(read, damaged(whole, rng), form) for _ in range(FILES))
            table.add_row(form, name, *(str(found[kind]) for kind in OUTCOMES))
    Console().print(table)


if __name__ == "__main__":
    main()
