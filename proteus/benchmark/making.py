"""The files of a benchmark, made for one shape and one transformation at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from proteus.benchmark.plan import (
    COMMON_AREA,
    NULL,
    UNPOSED,
    BenchmarkOptions,
    ShapePlan,
    pose_number,
    shape_seed,
)
from proteus.benchmark.sources import CreatureMesh, MeshFile, load_creature, load_file, load_null
from proteus.processes import write_whole
from workers.errors import ProteusError
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.transformations import transform


@dataclass(frozen=True)
class Work:
    """The files of one shape and one transformation, or its null shape.

    Attributes
    ----------
    shape : ShapePlan
    transformation : str
        One of `TRANSFORMATIONS`, or "null".
    strengths : tuple of int
        One file each; (0,) for the null shape.
    """

    shape: ShapePlan
    transformation: str
    strengths: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The files' names."""
        return tuple(f"{self.shape.label}.{self.transformation}.{s}.ply" for s in self.strengths)


@dataclass(frozen=True)
class Outcome:
    """The outcome of one piece of work.

    Attributes
    ----------
    work : Work
    failure : str
        Why the shape could not be made; empty if it could.
    left_out : tuple of (file, reason)
        Poses that were not used.
    """

    work: Work
    failure: str = ""
    left_out: tuple[tuple[str, str], ...] = ()


def plan_work(shapes: Sequence[ShapePlan], options: BenchmarkOptions) -> list[Work]:
    """Return all pieces of work, those of one shape one after the other."""
    work = []
    for shape in shapes:
        if shape.same_as:
            continue
        work.append(Work(shape, NULL, (0,)))
        if shape.is_query:
            work += [Work(shape, name, options.strengths) for name in options.transformations]
    return work


def make_files(work: Work, options: BenchmarkOptions, out: Path) -> Outcome:
    """Write the missing files of one piece of work. Existing files are whole, and are kept."""
    missing = [
        s for s, name in zip(work.strengths, work.names, strict=True) if not exists(out, name)
    ]
    try:
        poses, left_out = _usable_poses(work.shape)
        if missing:
            null = load_null(work.shape.source, keep_order=bool(poses))
            for strength in missing:
                mesh = _make(work, null, poses, strength, options)
                path = out / f"{work.shape.label}.{work.transformation}.{strength}.ply"
                write_whole(path, write(mesh, "ply"))
    except ProteusError as error:
        return Outcome(work, failure=str(error))
    return Outcome(work, left_out=left_out)


def exists(out: Path, name: str) -> bool:
    """Whether a file was made."""
    return (out / name).exists()


def _make(
    work: Work,
    null: TriangleMesh,
    poses: Sequence[MeshFile],
    strength: int,
    options: BenchmarkOptions,
) -> TriangleMesh:
    """Return the mesh of one file."""
    resize = _resizing(null, options)
    if work.transformation == NULL:
        return resize(null)
    pose = None
    if work.transformation not in UNPOSED:
        pose = _pose(work.shape, poses, pose_number(work.transformation, strength))
    seed = shape_seed(options.seed, work.shape.label)
    changed = transform(
        resize(null),
        work.transformation,
        strength,
        seed=seed,
        pose=None if pose is None else resize(pose),
    )
    return changed.mesh


def _resizing(
    null: TriangleMesh, options: BenchmarkOptions
) -> Callable[[TriangleMesh], TriangleMesh]:
    """Return the function that scales the null shape and its poses to the common area."""
    if options.normalise == "none":
        return lambda mesh: mesh
    factor = (COMMON_AREA / null.area) ** 0.5
    return lambda mesh: TriangleMesh(factor * mesh.vertices, mesh.faces)


def _pose(shape: ShapePlan, poses: Sequence[MeshFile], number: int) -> TriangleMesh | None:
    """Return a pose; a creature has another for every number."""
    if isinstance(shape.source, CreatureMesh):
        return load_creature(shape.source).posed(number + 1)
    return load_file(poses[number % len(poses)]) if poses else None


def _usable_poses(shape: ShapePlan) -> tuple[list[MeshFile], tuple[tuple[str, str], ...]]:
    """Return the poses that share the null's vertex order, and the others with the reason."""
    usable, left_out = [], []
    for pose in shape.poses:
        if not isinstance(shape.source, MeshFile):
            break
        expected = load_file(shape.source).n_vertices
        try:
            found = load_file(pose).n_vertices
        except ProteusError as error:
            left_out.append((pose.name, str(error)))
            continue
        if found == expected:
            usable.append(pose)
        else:
            reason = f"it has {found} vertices, the null shape {expected}"
            left_out.append((pose.name, reason))
    return usable, tuple(left_out)
