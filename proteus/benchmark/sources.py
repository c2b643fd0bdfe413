"""Sources of a benchmark's meshes: files, or procedural creatures."""

import functools
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from workers.creatures import Creature, make_creature
from workers.geometry.cleaning import clean
from workers.geometry.edges import undirected_edges
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh

REFINEMENTS = 6  # rings of neighbours that a vertex's colour depends on
MULTIPLIER = 0x9E3779B97F4A7C15  # odd: no colour is lost


@dataclass(frozen=True)
class MeshFile:
    """A mesh file.

    Attributes
    ----------
    path : Path
        Where it is.
    name : str
        Its path below the given folder, as the manifest has it.
    sha256 : str
        Of its bytes, in hex.
    """

    path: Path
    name: str
    sha256: str

    def to_json(self) -> dict[str, Any]:
        """Return its entry in the manifest."""
        return {"file": self.name, "sha256": self.sha256}


@dataclass(frozen=True)
class CreatureMesh:
    """An individual of a species; its poses are made when they are needed.

    Attributes
    ----------
    species : str
        One of `SPECIES`.
    individual : int
        Its seed.
    vertices : int
        Their number, roughly.
    """

    species: str
    individual: int
    vertices: int

    def to_json(self) -> dict[str, Any]:
        """Return its entry in the manifest."""
        return {
            "species": self.species,
            "individual": self.individual,
            "vertices": self.vertices,
        }


Source = MeshFile | CreatureMesh


def mesh_file(path: Path, folder: Path) -> MeshFile:
    """Return a file below a folder with the hash of its bytes."""
    name = path.relative_to(folder).as_posix()
    return MeshFile(path, name, hashlib.sha256(path.read_bytes()).hexdigest())


@functools.lru_cache(maxsize=4)
def load_creature(source: CreatureMesh) -> Creature:
    """Return the individual. The last few are cached."""
    return make_creature(source.species, seed=source.individual, vertices=source.vertices)


@functools.lru_cache(maxsize=16)
def load_file(source: MeshFile) -> TriangleMesh:
    """Return a file's mesh in its own vertex order. The last few are cached.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        It cannot be read.
    """
    return parse(source.path.read_bytes(), filename=source.path.name).mesh


def load_null(source: Source, *, keep_order: bool) -> TriangleMesh:
    """Return the null shape's mesh, repaired unless the vertex order is to be kept.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        It cannot be read, or is no usable mesh.
    """
    if isinstance(source, CreatureMesh):
        return load_creature(source).rest
    mesh = load_file(source)
    cleaned = clean(mesh).mesh
    return mesh if keep_order else cleaned


@functools.cache
def connectivity(source: MeshFile) -> str:
    """Return a digest of how a file's vertices are connected, in any order and any pose.

    Files of the same digest are one mesh in several poses. A vertex's colour depends on the degrees
    of its neighbours, some rings out (colour refinement; Weisfeiler, Leman 1968).

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        It cannot be read, or is no usable mesh.
    """
    mesh = clean(load_file(source)).mesh
    edges = undirected_edges(mesh)
    colours = np.bincount(edges.ravel(), minlength=mesh.n_vertices).astype(np.uint64)
    for _ in range(REFINEMENTS):
        sums = np.zeros_like(colours)  # modulo 2^64
        np.add.at(sums, edges[:, 0], colours[edges[:, 1]])
        np.add.at(sums, edges[:, 1], colours[edges[:, 0]])
        colours = (colours * np.uint64(MULTIPLIER) + sums) ^ (sums >> np.uint64(29))
    return hashlib.sha256(np.sort(colours).tobytes()).hexdigest()
