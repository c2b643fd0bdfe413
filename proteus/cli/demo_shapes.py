"""The demo's meshes: creatures for the collection, and deformed copies of them as queries."""

import functools
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import workers.creatures
import workers.transformations
from proteus.processes import run_in_processes, write_whole
from workers.creatures import SPECIES, Creature, make_creature
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.transformations import transform

SHAPES = 60
QUERIES = 12
STORED_POSES = (1, 2)
OTHER_POSE = 7
IN_ANOTHER_POSE = "in another pose"

DEFORMATIONS: dict[str, tuple[str, int]] = {  # transformation and strength
    IN_ANOTHER_POSE: ("isometry", 1),
    "of another scale": ("scale", 5),
    "noisy": ("noise", 1),
    "with holes": ("holes", 1),
    "coarser": ("sampling", 2),
}


@dataclass(frozen=True)
class DemoMesh:
    """One mesh of the demo.

    Attributes
    ----------
    species : str
        Its label.
    individual, pose : int
        Seeds; a mesh of the same individual in another pose is the same creature.
    deformation : str
        A key of ``DEFORMATIONS`` for a query, empty for a shape of the collection.
    """

    species: str
    individual: int
    pose: int
    deformation: str = ""

    @property
    def creature(self) -> str:
        """Name of the individual."""
        return f"{self.species}-{self.individual:02}"

    @property
    def path(self) -> Path:
        """Where its file is, below the demo's folder."""
        if self.deformation:
            how = self.deformation.replace(" ", "-")
            return Path("queries", f"{self.creature}-{how}.ply")
        return Path("creatures", self.species, f"{self.creature}-{self.pose:02}.ply")

    def make(self) -> TriangleMesh:
        """Make it; the same each time."""
        creature = _individual(self.species, self.individual)
        mesh = creature.posed(self.pose)
        if not self.deformation:
            return mesh
        name, strength = DEFORMATIONS[self.deformation]
        seed = SPECIES.index(self.species)
        return transform(creature.rest, name, strength, seed=seed, pose=mesh).mesh


@functools.lru_cache(maxsize=4)
def _individual(species: str, individual: int) -> Creature:
    return make_creature(species, seed=individual)


def demo_shapes() -> list[DemoMesh]:
    """Return the shapes of the collection: every species, as evenly as their number allows."""
    first, second = STORED_POSES
    shapes = [
        DemoMesh(species, individual, pose)
        for individual, pose in ((1, first), (2, first), (1, second))
        for species in SPECIES
    ]
    return shapes[: max(SHAPES, len(SPECIES))]


def demo_queries() -> list[DemoMesh]:
    """Return the queries: each of another species, the deformations in turn."""
    kinds = list(DEFORMATIONS)
    chosen = [SPECIES[i * len(SPECIES) // QUERIES] for i in range(QUERIES)]
    return [
        DemoMesh(species, 1, OTHER_POSE if kind == IN_ANOTHER_POSE else STORED_POSES[0], kind)
        for species, kind in zip(chosen, kinds * QUERIES, strict=False)
    ]


def write_meshes(meshes: Sequence[DemoMesh], folder: Path, *, processes: int) -> Iterator[int]:
    """Write the missing files, on several processors.

    Parameters
    ----------
    meshes : sequence of DemoMesh
        To be written.
    folder : Path
        Of the files.
    processes : int
        Number to use.

    Yields
    ------
    int
        Number of files that exist now.
    """
    missing = [mesh for mesh in meshes if not (folder / mesh.path).exists()]
    done = len(meshes) - len(missing)
    yield done
    groups: dict[str, list[DemoMesh]] = {}
    for mesh in missing:  # an individual is made once for all its poses
        groups.setdefault(mesh.creature, []).append(mesh)
    if not groups:
        return
    write_group = partial(_write_files, folder=folder)
    for count in run_in_processes(write_group, list(groups.values()), processes=processes):
        done += count
        yield done


def _write_files(meshes: Sequence[DemoMesh], folder: Path) -> int:
    """Write meshes; return their number."""
    for mesh in meshes:
        write_whole(folder / mesh.path, write(mesh.make(), "ply"))
    return len(meshes)


def generator_key() -> str:
    """Return a digest of the code that makes the meshes: another version has another folder."""
    sources = [Path(__file__)]
    for package in (workers.creatures, workers.transformations):
        sources += sorted(Path(next(iter(package.__path__))).rglob("*.py"))
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
