"""The demo's shapes: creatures for the collection, and deformed copies of them as questions."""

import functools
import hashlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import workers.geometry.creatures
from service.cli import deformations
from workers.geometry.creatures import SPECIES, Creature, make_creature
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh

SHAPES = 60
QUESTIONS = 12
STORED_POSES = (1, 2)
OTHER_POSE = 7
IN_ANOTHER_POSE = "in another pose"

Deformation = Callable[[TriangleMesh, np.random.Generator], TriangleMesh]

DEFORMATIONS: dict[str, Deformation] = {
    IN_ANOTHER_POSE: lambda mesh, rng: mesh,
    "3.7 times as large, turned": lambda mesh, rng: deformations.scale_and_turn(
        mesh, factor=3.7, rng=rng
    ),
    "noisy": lambda mesh, rng: deformations.add_noise(mesh, strength=0.15, rng=rng),
    "with holes": lambda mesh, rng: deformations.punch_holes(mesh, count=8, share=0.004, rng=rng),
    "coarser": lambda mesh, rng: deformations.coarsen(mesh, share=0.35),
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
        A key of ``DEFORMATIONS`` for a question, empty for a shape of the collection.
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
            how = self.deformation.split(",")[0].replace(" ", "-")
            return Path("questions", f"{self.creature}-{how}.ply")
        return Path("creatures", self.species, f"{self.creature}-{self.pose:02}.ply")

    def make(self) -> TriangleMesh:
        """Make it; the same each time."""
        mesh = _individual(self.species, self.individual).posed(self.pose)
        if not self.deformation:
            return mesh
        digest = hashlib.sha256(str(self.path).encode()).digest()
        rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
        return DEFORMATIONS[self.deformation](mesh, rng)


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


def demo_questions() -> list[DemoMesh]:
    """Return the questions: each of another species, the deformations in turn."""
    kinds = list(DEFORMATIONS)
    chosen = [SPECIES[i * len(SPECIES) // QUESTIONS] for i in range(QUESTIONS)]
    return [
        DemoMesh(species, 1, OTHER_POSE if kind == IN_ANOTHER_POSE else STORED_POSES[0], kind)
        for species, kind in zip(chosen, kinds * QUESTIONS, strict=False)
    ]


def write_meshes(meshes: Sequence[DemoMesh], folder: Path, *, processes: int) -> Iterator[int]:
    """Write the files that are not there yet, on several processors.

    Parameters
    ----------
    meshes : sequence of DemoMesh
        What there should be.
    folder : Path
        Below which the files are.
    processes : int
        How many to use.

    Yields
    ------
    int
        How many files are there now.
    """
    missing = [mesh for mesh in meshes if not (folder / mesh.path).exists()]
    done = len(meshes) - len(missing)
    yield done
    groups: dict[str, list[DemoMesh]] = {}
    for mesh in missing:  # an individual is made once for all its poses
        groups.setdefault(mesh.creature, []).append(mesh)
    if not groups:
        return
    pool = ProcessPoolExecutor(
        max_workers=min(processes, len(groups)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_leave_interrupts_to_the_parent,
    )
    try:
        parts = [pool.submit(_write_files, group, folder) for group in groups.values()]
        for part in as_completed(parts):
            done += part.result()
            yield done
    finally:
        pool.shutdown(cancel_futures=True)


def _write_files(meshes: Sequence[DemoMesh], folder: Path) -> int:
    """Write meshes, each so that a file that exists is whole; return how many."""
    for mesh in meshes:
        path = folder / mesh.path
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_suffix(".part")
        unfinished.write_bytes(write(mesh.make(), "ply"))
        unfinished.replace(path)
    return len(meshes)


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def generator_key() -> str:
    """Return a short name of the code that makes the meshes: another version, another folder."""
    package = Path(next(iter(workers.geometry.creatures.__path__)))
    sources = [Path(__file__), Path(deformations.__file__), *sorted(package.rglob("*.py"))]
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
