"""Null shapes, poses and distractors below a folder, with their labels."""

import re
from collections.abc import Iterable
from pathlib import Path

from proteus.benchmark.sources import MeshFile, mesh_file
from proteus.files import find_files, is_archive_name
from workers.errors import InvalidRequestError
from workers.geometry.formats.naming import read_name

MARKS = ("reference", "null")
"""One of these is in the name of the null shape, where its folder holds other meshes too."""


def mesh_files(folder: Path) -> list[Path]:
    """Return the mesh files below a folder, in order of their paths; archives are not opened."""
    paths = [file.path for file in find_files([folder]).files]
    return [path for path in paths if not is_archive_name(path)]


def clean_label(text: str) -> str:
    """Return a name as a label: of letters, digits, ``_`` and ``-``, for a dot ends a label."""
    return re.sub(r"[^\w-]+", "-", text).strip("-")[:80] or "unnamed"


def find_nulls(folder: Path) -> dict[str, MeshFile]:
    """Find the null shapes below a folder, by label.

    Files directly in the folder are null shapes: ``<label>.ply`` or ``<label>.null.0.ply``. A
    folder ``<label>/`` in it has one null shape. That is its only mesh, or the only mesh whose
    name contains "reference" or "null".

    Raises
    ------
    InvalidRequestError
        There are none, two have one label, or a folder has no or several meshes that could be it.
    """
    groups: dict[Path, list[Path]] = {}
    for path in mesh_files(folder):
        groups.setdefault(path.parent, []).append(path)
    chosen = [(_own_label(path), path) for path in groups.pop(folder, [])]
    chosen += [(clean_label(place.name), _null_of(place, group)) for place, group in groups.items()]
    if not chosen:
        raise InvalidRequestError(
            f"there is no mesh below {folder}, expected <label>.ply or <label>/<file>"
        )
    nulls: dict[str, MeshFile] = {}
    for label, path in chosen:
        found = mesh_file(path, folder)
        if label in nulls:
            names = f"{nulls[label].name} and {found.name}"
            raise InvalidRequestError(f"two null shapes are labelled {label!r}: {names}")
        nulls[label] = found
    return nulls


def _own_label(path: Path) -> str:
    naming = read_name(path.name)
    if naming.label and naming.transformation == "null":
        return clean_label(naming.label)
    return clean_label(path.stem)


def _null_of(place: Path, group: list[Path]) -> Path:
    if len(group) == 1:
        return group[0]
    marked = [path for path in group if any(mark in path.stem.lower() for mark in MARKS)]
    if len(marked) != 1:
        raise InvalidRequestError(
            f"{place} holds {len(group)} meshes, {len(marked)} of which have "
            f'"reference" or "null" in their name; expected exactly one null shape'
        )
    return marked[0]


def find_poses(folder: Path, label: str, null: MeshFile) -> tuple[MeshFile, ...]:
    """Return the meshes in ``<folder>/<label>/`` except the null, in order of their names."""
    places = sorted(p for p in folder.iterdir() if p.is_dir() and clean_label(p.name) == label)
    found = [mesh_file(path, folder) for place in places for path in mesh_files(place)]
    return tuple(pose for pose in found if pose.sha256 != null.sha256)


def find_distractors(folder: Path) -> list[tuple[str, MeshFile]]:
    """Return the meshes below a folder, each with its stem as label; labels may repeat.

    Raises
    ------
    InvalidRequestError
        There are none.
    """
    paths = mesh_files(folder)
    if not paths:
        raise InvalidRequestError(f"there is no mesh below {folder}")
    return [(clean_label(path.stem), mesh_file(path, folder)) for path in paths]


def unique_label(label: str, taken: Iterable[str]) -> str:
    """Return the label, with the first free number behind it if it is taken: cat, cat-2, cat-3."""
    used = set(taken)
    if label not in used:
        return label
    number = next(n for n in range(2, len(used) + 3) if f"{label}-{n}" not in used)
    return f"{label}-{number}"
