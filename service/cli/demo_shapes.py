"""The demo's shapes: creatures for the collection, and deformed copies of them as questions."""

import functools
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import workers.geometry.creatures
from service.cli.deformations import add_noise, coarsen, punch_holes, scale_and_turn
from workers.geometry.creatures import SPECIES, Creature, make_creature
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh

SHAPES = 60
QUESTIONS = 12
STORED_POSES = (1, 2)
OTHER_POSE = 7

Deformation = Callable[[TriangleMesh, np.random.Generator], TriangleMesh]

DEFORMATIONS: dict[str, Deformation] = {
    "in another pose": lambda mesh, rng: mesh,
    "3.7 times as large, turned": lambda mesh, rng: scale_and_turn(mesh, factor=3.7, rng=rng),
    "noisy": lambda mesh, rng: add_noise(mesh, strength=0.15, rng=rng),
    "with holes": lambda mesh, rng: punch_holes(mesh, count=8, share=0.004, rng=rng),
    "coarser": lambda mesh, rng: coarsen(mesh, share=0.35),
}


@functools.lru_cache(maxsize=128)
def _individual(species: str, individual: int) -> Creature:
    return make_creature(species, seed=individual)


@dataclass(frozen=True)
class DemoShape:
    """One shape of the demo collection.

    Attributes
    ----------
    species : str
        Its label.
    individual, pose : int
        Seeds; a shape of the same individual in another pose is the same creature.
    """

    species: str
    individual: int
    pose: int

    @property
    def creature(self) -> str:
        """Name of the individual."""
        return f"{self.species}-{self.individual:02}"

    @property
    def name(self) -> str:
        """Name of the file."""
        return f"{self.creature}-{self.pose:02}.ply"

    def make(self) -> TriangleMesh:
        """Make its mesh."""
        return _individual(self.species, self.individual).posed(self.pose)


@dataclass(frozen=True)
class DemoQuestion:
    """One question of the demo: a deformed copy of a stored creature.

    Attributes
    ----------
    source : DemoShape
        What is deformed.
    deformation : str
        A key of ``DEFORMATIONS``.
    """

    source: DemoShape
    deformation: str

    @property
    def name(self) -> str:
        """Name of the file."""
        return f"{self.source.creature}-{self.deformation.split(',')[0].replace(' ', '-')}.ply"

    def make(self) -> TriangleMesh:
        """Make its mesh; the same each time."""
        digest = hashlib.sha256(self.name.encode()).digest()
        rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
        return DEFORMATIONS[self.deformation](self.source.make(), rng)


def demo_shapes() -> list[DemoShape]:
    """Return the shapes of the collection: every species, as evenly as their number allows."""
    shapes = [
        DemoShape(species, individual, pose)
        for individual, pose in ((1, STORED_POSES[0]), (2, STORED_POSES[0]), (1, STORED_POSES[1]))
        for species in SPECIES
    ]
    return shapes[: max(SHAPES, len(SPECIES))]


def demo_questions() -> list[DemoQuestion]:
    """Return the questions: each of another species, the deformations in turn."""
    kinds = list(DEFORMATIONS)
    step = len(SPECIES) / QUESTIONS
    chosen = [SPECIES[int(i * step)] for i in range(QUESTIONS)]
    return [
        DemoQuestion(
            DemoShape(species, 1, OTHER_POSE if i % len(kinds) == 0 else STORED_POSES[0]),
            kinds[i % len(kinds)],
        )
        for i, species in enumerate(chosen)
    ]


def write_files(
    directory: Path, shapes: list[DemoShape] | list[DemoQuestion], *, by_species: bool
) -> Iterator[Path]:
    """Iterate over the shapes' files, making those that are not there yet.

    Parameters
    ----------
    directory : Path
        Where they are kept.
    shapes : list
        What to make.
    by_species : bool
        Put each into a folder named by its species.
    """
    for shape in shapes:
        species = shape.species if isinstance(shape, DemoShape) else shape.source.species
        folder = directory / species if by_species else directory
        path = folder / shape.name
        if not path.exists():
            folder.mkdir(parents=True, exist_ok=True)
            unfinished = path.with_suffix(".part")
            unfinished.write_bytes(write(shape.make(), "ply"))
            unfinished.replace(path)
        yield path


def generator_key() -> str:
    """Return a short name of the code that makes creatures: another version, another cache."""
    package = Path(workers.geometry.creatures.__path__[0])
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for source in sorted(package.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
