"""From bytes to descriptors: parse, clean, prepare, solve, describe."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from workers.errors import (
    BlobNotFoundError,
    KernelDomainError,
    ProteusError,
    SpectrumError,
)
from workers.geometry.arrays import Float32Array
from workers.geometry.cleaning import clean
from workers.geometry.formats import MeshLimits, ParsedMesh, parse
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution, Solver
from workers.geometry.views import View
from workers.pipeline.progress import DESCRIBING, Progress
from workers.pipeline.windows import take_signature
from workers.retrieval.model import Model, describe
from workers.settings import Settings
from workers.storage.blobs import BlobStore, mesh_key
from workers.storage.solutions import load_solution, store_solution

UNHEARD = Progress().enter
"""Of what is told nobody takes notice."""

UNPACKED = 2
"""A compressed file may unpack to so many times the bytes that one file may have."""


@dataclass(frozen=True)
class ReadMesh:
    """A mesh as it was read: cleaned, with what was done to it and how the file was written.

    Attributes
    ----------
    mesh : TriangleMesh
        The cleaned mesh.
    repairs : tuple of str
        What reading and cleaning did.
    found : tuple of str
        What else the file holds.
    format : str
        As `ParsedMesh` has it.
    up : "y" or "z"
        The axis that points up.
    """

    mesh: TriangleMesh
    repairs: tuple[str, ...]
    found: tuple[str, ...]
    format: str
    up: Literal["y", "z"]


def read_mesh(blobs: BlobStore, sha256: str, *, filename: str, settings: Settings) -> ReadMesh:
    """Parse and clean uploaded bytes.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    filename : str
        Of the file; it matters only where the bytes do not say their format.
    settings : Settings
        They limit vertices and faces.

    Returns
    -------
    ReadMesh
        The cleaned mesh, and what was repaired.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        The bytes hold no mesh that can be used.
    """
    parsed = parse_upload(blobs, sha256, filename=filename, settings=settings)
    cleaned = clean(parsed.mesh)
    repairs = (*parsed.repairs, *cleaned.repairs)
    return ReadMesh(cleaned.mesh, repairs, parsed.found, parsed.format, parsed.up)


def parse_upload(blobs: BlobStore, sha256: str, *, filename: str, settings: Settings) -> ParsedMesh:
    """Parse uploaded bytes; the vertices are in the order of the file.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    filename : str
        Of the file; it matters only where the bytes do not say their format.
    settings : Settings
        They limit vertices and faces.

    Returns
    -------
    ParsedMesh
        The mesh, its format, and which axis points up.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        The bytes hold no mesh that can be used.
    """
    limits = MeshLimits(
        vertices=settings.max_vertices,
        faces=settings.max_faces,
        unpacked=UNPACKED * settings.max_upload_bytes,
    )
    return parse(blobs.get(mesh_key(sha256)), filename=filename, limits=limits)


def solve_view(
    blobs: BlobStore,
    sha256: str,
    mesh: TriangleMesh,
    view: View,
    solver: Solver | None = None,
) -> Solution:
    """Return a cleaned mesh's solution under a view, solved only if nothing is stored.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    mesh : TriangleMesh
        The cleaned mesh.
    view : View
        How it is prepared.
    solver : Solver, optional
        Of the mesh, where it is solved under other views, too.

    Returns
    -------
    Solution
        As it is stored, so that it does not matter who solved it first.

    Raises
    ------
    SpectrumError
        The eigenpairs could not be certified.
    """
    try:
        return load_solution(blobs, sha256, view, cleaned=mesh)
    except BlobNotFoundError:
        found = (solver or Solver(mesh)).under(view)
        return store_solution(blobs, sha256, view, found, cleaned=mesh)


@dataclass(frozen=True)
class Described:
    """Descriptors by model name, and errors by the names of the other models.

    Models that compare windows have signatures, too. What is out of the ordinary in how it was
    solved is noted by view.
    """

    vectors: Mapping[str, Float32Array]
    errors: Mapping[str, ProteusError]
    notes: tuple[str, ...] = ()
    signatures: Mapping[str, bytes] = field(default_factory=dict)


def describe_mesh(
    blobs: BlobStore,
    sha256: str,
    mesh: TriangleMesh,
    models: Sequence[Model],
    *,
    enter: Callable[[str], None] = UNHEARD,
    solver: Solver | None = None,
) -> Described:
    """Describe a cleaned mesh; a view is solved once for all models.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    mesh : TriangleMesh
        The cleaned mesh.
    models : sequence of Model
        Under which it is described.
    enter : callable
        Is told the name of each step before it begins.
    solver : Solver, optional
        Of the mesh, where more is computed of it.

    Returns
    -------
    Described
        Under every one of them.

    Raises
    ------
    SpectrumError, KernelDomainError
        It cannot be described under one of them.
    """
    described = describe_under_each(blobs, sha256, mesh, models, enter=enter, solver=solver)
    for error in described.errors.values():
        raise error
    return described


def describe_under_each(
    blobs: BlobStore,
    sha256: str,
    mesh: TriangleMesh,
    models: Sequence[Model],
    *,
    enter: Callable[[str], None] = UNHEARD,
    solver: Solver | None = None,
) -> Described:
    """Describe a cleaned mesh under each model that it can be described under.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    mesh : TriangleMesh
        The cleaned mesh.
    models : sequence of Model
        Under which it is described.
    enter : callable
        Is told the name of each step before it begins.
    solver : Solver, optional
        Of the mesh, where more is computed of it.

    Returns
    -------
    Described
        Its descriptors, and the errors of the other models.
    """
    solutions: dict[str, Solution] = {}
    vectors: dict[str, Float32Array] = {}
    errors: dict[str, ProteusError] = {}
    notes: dict[str, None] = {}
    signatures: dict[str, bytes] = {}
    taken: dict[str, bytes | None] = {}
    solver = solver or Solver(mesh, enter)
    for model in models:
        try:
            for view in model.views:
                if view.key not in solutions:
                    solutions[view.key] = solve_view(blobs, sha256, mesh, view, solver)
                    told = solutions[view.key].notes
                    notes |= dict.fromkeys(f"{view.name} view: {note}" for note in told)
            enter(DESCRIBING)
            own = {view.name: solutions[view.key] for view in model.views}
            vectors[model.name] = describe(own, model)
        except (KernelDomainError, SpectrumError) as error:
            errors[model.name] = error
            continue
        if model.windows is not None:
            key = model.windows.view.key
            if key not in taken:
                taken[key] = take_signature(solver, mesh, model.windows)
            found = taken[key]
            if found is not None:
                signatures[model.name] = found
    return Described(vectors, errors, tuple(notes), signatures)
