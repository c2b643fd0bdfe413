"""From the mesh of a file to one whose Laplacian makes sense; says what it repaired."""

from dataclasses import dataclass

import numpy as np

from workers.errors import InvalidMeshError
from workers.geometry.arrays import FloatArray, IntArray, first_of_runs, frozen
from workers.geometry.degenerate import degenerate_faces
from workers.geometry.fragments import without_debris
from workers.geometry.mesh import TriangleMesh
from workers.geometry.seams import Sewn, sew
from workers.geometry.shells import doubled_faces
from workers.geometry.strays import without_strays, without_unreferenced
from workers.geometry.topology import count_referenced, is_closed, pass_on

MERGE_DISTANCE = 1e-9  # of the bounding box's diagonal
MOST_PASSES = 20
MOST_IN_A_KEY = 2_000_000  # vertices: three of their numbers are below 2^63 as one
MIXER = np.uint64(0x9E3779B97F4A7C15)  # odd, of no pattern: products spread over all bits
FEWEST_FACES = 4  # a closed surface has no fewer
VERTICES = ("vertex", "vertices")
FACES = ("face", "faces")
FRAGMENTS = ("fragment", "fragments")
SHELLS = ("shell", "shells")
SMALLEST_EXTENT, LARGEST_EXTENT = 1e-60, 1e60  # squared areas, also of needles, must be normal


@dataclass(frozen=True, eq=False)
class CleanedMesh:
    """A mesh without duplicates, degenerate faces and fragments.

    Attributes
    ----------
    mesh : TriangleMesh
        Every vertex has a face; the order of vertices and faces is that of the input.
    repairs : tuple of str
        What was done, in sentences for people; empty if nothing.
    """

    mesh: TriangleMesh
    repairs: tuple[str, ...]


def clean(mesh: TriangleMesh) -> CleanedMesh:
    """Repair a mesh; all thresholds are relative, so that units do not matter.

    - Unreferenced vertices are dropped.
    - Strays go: faces at vertices that are not finite or absurdly far away.
    - Vertices that lie on each other are merged.
    - Faces without area and repeated faces, of either winding, are dropped.
    - Seams between open edges are closed, see `sew`.
    - Debris goes, see `without_debris`.
    - One side of a wall without thickness goes, see `doubled_faces`.

    Parameters
    ----------
    mesh : TriangleMesh
        As it was read; anything may be wrong with it.

    Returns
    -------
    CleanedMesh
        With the mesh itself where nothing was to be repaired. Cleaning it again changes nothing.

    Raises
    ------
    InvalidMeshError
        No faces, an index out of range, many coordinates that are NaN or infinite, no extent
        or one beyond 1e±60, or fewer than 4 faces left.
    """
    _require_sound(mesh)
    repairs: list[str] = []
    for number in range(MOST_PASSES):  # one, where nothing is open; another to find nothing, else
        cleaned, final = _clean_once(mesh, debris=number == 0)  # the share that goes adds up
        repairs += cleaned.repairs
        mesh = cleaned.mesh
        if final or not cleaned.repairs:
            break
    return CleanedMesh(mesh, tuple(repairs))


def _clean_once(mesh: TriangleMesh, *, debris: bool) -> tuple[CleanedMesh, bool]:
    """One pass of cleaning, and whether it is certain that another would find nothing."""
    repairs: list[str] = []
    vertices, faces = without_unreferenced(mesh.vertices, mesh.faces)
    _report(repairs, "dropped {} unreferenced {}", mesh.n_vertices - len(vertices), VERTICES)
    vertices, faces, left_out = without_strays(vertices, faces)
    repairs += left_out
    extent = _require_extent(vertices)

    merge = _merged_soup if len(vertices) > len(faces) else _merged_vertices
    merged, representatives = merge(vertices, MERGE_DISTANCE * extent)
    _report(repairs, "merged {} duplicate {}", len(vertices) - len(representatives), VERTICES)
    if len(representatives) < len(vertices):
        vertices, faces = vertices[representatives], merged[faces]
    del merged, representatives

    scaled = frozen(_in_units_of(vertices, extent))
    kept = _chosen(faces, np.flatnonzero(~degenerate_faces(scaled, faces)))
    _report(repairs, "dropped {} zero-area {}", len(faces) - len(kept), FACES)
    faces = _chosen(kept, _first_of_their_kind(kept))
    _report(repairs, "dropped {} duplicate {}", len(kept) - len(faces), FACES)
    del kept

    whole = TriangleMesh(scaled, frozen(faces))
    sewn = Sewn(faces, (), was_open=False)
    if not is_closed(whole):
        sewn = sew(scaled, faces, extent * float(np.ldexp(1.0, -int(np.frexp(extent)[1]))))
    if sewn.faces is not faces:
        faces = sewn.faces
        whole = TriangleMesh(scaled, frozen(faces))
    repairs += sewn.repairs

    if debris and len(faces):
        found = without_debris(whole)
        share = f"{found.share:.2%}" if found.share >= 1e-4 else "less than 0.01%"
        sentence = f"left out {{}} {{}}, {share} of the area together"
        _report(repairs, sentence, found.n_left_out, FRAGMENTS)
        faces = _chosen(faces, found.faces)
        doubled, n_shells = doubled_faces(TriangleMesh(scaled, frozen(faces)), found.labels)
        _report(repairs, "left out {} {} that only doubled another one", n_shells, SHELLS)
        faces = faces[~doubled] if n_shells else faces
        del found, doubled
    same_faces = len(faces) == whole.n_faces
    vertices, faces = without_unreferenced(vertices, faces)
    if len(faces) < FEWEST_FACES:
        raise InvalidMeshError(
            f"{len(faces)} {FACES[len(faces) != 1]} left after cleaning, "
            f"but a shape needs at least {FEWEST_FACES}"
        )
    if repairs:
        mesh = TriangleMesh(frozen(vertices), frozen(faces))
    if same_faces:
        pass_on(whole, mesh)
    return CleanedMesh(mesh, tuple(repairs)), not sewn.was_open


def without_useless_faces(mesh: TriangleMesh) -> TriangleMesh:
    """Drop degenerate and repeated faces and the vertices that only they had.

    For meshes that a preparation step made.

    Parameters
    ----------
    mesh : TriangleMesh
        With indices in range.

    Returns
    -------
    TriangleMesh
        The mesh itself where nothing is to be dropped; it may have no face at all.

    Raises
    ------
    InvalidMeshError
        The mesh has no extent, or one beyond 1e±60.
    """
    faces = _chosen(mesh.faces, useful_faces(mesh))
    if len(faces) == mesh.n_faces and count_referenced(mesh) == mesh.n_vertices:
        return mesh
    return TriangleMesh(*without_unreferenced(mesh.vertices, faces))


def useful_faces(mesh: TriangleMesh) -> IntArray:
    """Find the faces that are neither degenerate nor repeat an earlier one.

    Parameters
    ----------
    mesh : TriangleMesh
        With indices in range.

    Returns
    -------
    (f,) int64
        Their numbers, ascending.

    Raises
    ------
    InvalidMeshError
        The mesh has no extent, or one beyond 1e±60.
    """
    extent = _require_extent(mesh.vertices)
    sound = np.flatnonzero(~degenerate_faces(_in_units_of(mesh.vertices, extent), mesh.faces))
    useful: IntArray = sound[_first_of_their_kind(_chosen(mesh.faces, sound))]
    return useful


def _chosen(faces: IntArray, numbers: IntArray) -> IntArray:
    """Faces of these ascending numbers: the array itself where they are all."""
    return faces if len(numbers) == len(faces) else faces[numbers]


def _report(repairs: list[str], sentence: str, count: int, noun: tuple[str, str]) -> None:
    """Add the sentence if there was anything to repair."""
    if count:
        repairs.append(sentence.format(f"{count:,}", noun[count != 1]))


def _require_sound(mesh: TriangleMesh) -> None:
    """Raise ``InvalidMeshError`` for a mesh that cannot be repaired."""
    if mesh.n_faces == 0:
        raise InvalidMeshError(
            f"the mesh has no faces ({mesh.n_vertices:,} points); expected a surface"
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= mesh.n_vertices:
        bad = (mesh.faces < 0) | (mesh.faces >= mesh.n_vertices)  # (m, 3)
        face, corner = np.argwhere(bad)[0]
        raise InvalidMeshError(
            f"face {face} refers to vertex {mesh.faces[face, corner]}, "
            f"but the mesh has {mesh.n_vertices} vertices"
        )


def _require_extent(vertices: FloatArray) -> float:
    """Diagonal of the bounding box, or ``InvalidMeshError`` if it is no sensible number."""
    with np.errstate(over="ignore"):
        sides = vertices.max(axis=0) - vertices.min(axis=0)  # (3,)
    longest = float(sides.max())
    if longest == 0.0:
        raise InvalidMeshError(f"all {len(vertices):,} vertices lie in one point")
    if not SMALLEST_EXTENT < longest < LARGEST_EXTENT:
        raise InvalidMeshError(
            f"the mesh is {longest:g} units long; "
            f"expected between {SMALLEST_EXTENT:g} and {LARGEST_EXTENT:g}"
        )
    return longest * float(np.linalg.norm(sides / longest))


def _in_units_of(vertices: FloatArray, extent: float) -> FloatArray:
    """Vertices (n, 3) divided by about the extent: by a power of two, which rounds nothing.

    So nothing is decided otherwise when a mesh is cleaned again, or given in another unit.
    """
    return np.ldexp(vertices, -int(np.frexp(extent)[1]))


def _merged_vertices(vertices: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
    """New index (n,) of every vertex, and the old index of the first vertex of each group.

    Along each axis the sorted coordinates are cut where they are more than ``distance``
    apart; vertices in the same piece along all three axes are one. Other than a grid of
    cells this has no walls that could separate two vertices in nearly the same place.
    """
    n = len(vertices)
    group = np.zeros(n, dtype=np.int64)
    unsure = np.arange(n)  # vertices that share their pieces so far with others
    for axis in range(3):
        piece = _pieces(vertices[:, axis], distance)
        keys = group[unsure] * (piece.max(initial=0) + 1) + piece[unsure]  # below n², so this fits
        order = np.argsort(keys, kind="stable")
        new = first_of_runs(keys[order])
        group[unsure[order]] = np.cumsum(new) - 1
        several = ~(new & np.append(new[1:], True))
        unsure = np.sort(unsure[order[several]])
        if len(unsure) == 0:
            return np.arange(n), np.arange(n)
    to = np.arange(n)  # the first vertex of the group of each
    order = np.argsort(group[unsure], kind="stable")
    new = first_of_runs(group[unsure][order])
    ordered = unsure[order]
    to[ordered] = ordered[new][np.cumsum(new) - 1]
    kept = to == np.arange(n)
    return (np.cumsum(kept) - 1)[to], np.flatnonzero(kept)


def _merged_soup(vertices: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
    """What `_merged_vertices` gives, sooner where most vertices are there several times."""
    same, firsts = _merged_equal(vertices)
    merged, representatives = _merged_vertices(vertices[firsts], distance)
    return merged.take(same), firsts.take(representatives)


def _merged_equal(vertices: FloatArray) -> tuple[IntArray, IntArray]:
    """New index (n,) of every vertex, and the old index of the first vertex of each group.

    Vertices of a group have the very same bits. A few that have may be in different groups.
    """
    # A number of 64 bits that equal vertices share, of which the lowest make way for the index.
    mixed = np.zeros(len(vertices), dtype=np.uint64)
    for axis in range(3):
        mixed += np.ascontiguousarray(vertices[:, axis]).view(np.uint64)
        mixed *= MIXER
        mixed ^= mixed >> np.uint64(32)
    bits = np.uint64(len(vertices).bit_length())
    index_mask = (np.uint64(1) << bits) - np.uint64(1)
    mixed &= ~index_mask
    mixed |= np.arange(len(vertices), dtype=np.uint64)
    mixed.sort()
    order = (mixed & index_mask).view(np.int64)  # equal ones beside each other, the first in front
    new = first_of_runs(mixed >> bits)
    firsts = order[new].take(np.cumsum(new) - 1)  # (n,)
    to = np.arange(len(vertices))
    equal = ~new
    for axis in range(3):  # others may share their number by chance
        values = np.ascontiguousarray(vertices[:, axis]).view(np.int64)
        equal &= values.take(order) == values.take(firsts)
    to[order[equal]] = firsts[equal]
    kept = to == np.arange(len(vertices))
    return (np.cumsum(kept) - 1).take(to), np.flatnonzero(kept)


def _pieces(coordinates: FloatArray, distance: float) -> IntArray:
    """Number (n,) of the piece of each, along one axis, cut at gaps above the distance."""
    order = np.argsort(coordinates)
    pieces = np.empty(len(coordinates), dtype=np.int64)
    pieces[order] = np.cumsum(np.diff(coordinates[order], prepend=-np.inf) > distance)
    return pieces


def _first_of_their_kind(faces: IntArray) -> IntArray:
    """Indices of the faces that do not repeat the vertices of an earlier one, sorted."""
    if not _has_repeated(faces):
        return np.arange(len(faces))
    ordered = np.sort(faces, axis=1)
    order = np.lexsort(ordered.T[::-1])  # stable: the earlier face comes first
    ordered = ordered[order]
    new = np.ones(len(faces), dtype=np.bool_)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return np.sort(order[new])


def _has_repeated(faces: IntArray) -> bool:
    """Whether two faces may have the same corners: surely, where one number holds all three."""
    n = int(faces.max(initial=0)) + 1
    if n > MOST_IN_A_KEY:
        return True
    a, b, c = np.ascontiguousarray(faces.T)
    low = np.minimum(np.minimum(a, b), c)
    high = np.maximum(np.maximum(a, b), c)
    keys = (low * n + (a + b + c - low - high)) * n + high
    keys.sort()
    return bool((keys[1:] == keys[:-1]).any())
