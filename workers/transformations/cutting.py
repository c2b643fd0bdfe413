"""Parts taken away: holes, micro-holes, and all that lies on one side of a cut."""

import numpy as np
from scipy import sparse

from workers.geometry.arrays import BoolArray, FloatArray
from workers.geometry.edges import length_graph, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import face_components
from workers.transformations.metric import geodesic_distances, random_vertices
from workers.transformations.transformed import FEWEST_FACES, TransformedMesh, part

# Chosen, not measured.
_MICRO_HOLE = 2.5e-4  # of the area
_REACH = 4.0  # radii of a flat disc within which the faces of a hole are looked for
_HALVINGS = 30  # of the interval that a plane lies in
_PLANES = 8  # directions tried before a cut along the surface is made instead
_TOLERANCE = 0.02  # of the whole area: how well a plane leaves the part that is asked for


def punch_holes(
    mesh: TriangleMesh, *, area_left: float, discs: int, rng: np.random.Generator
) -> TransformedMesh:
    """Take geodesic discs away; they may touch, and what lies between them may float.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    area_left : float
        Share of the area.
    discs : int
        How many; the largest is about three times as large as the smallest.
    rng : Generator
        Draws centres and sizes.

    Returns
    -------
    TransformedMesh
        The faces that are left, at least 50 where there were as many.
    """
    sizes = rng.uniform(0.5, 1.5, discs)
    return _without_discs(mesh, (1.0 - area_left) * mesh.area * sizes / sizes.sum(), rng)


def punch_micro_holes(
    mesh: TriangleMesh, *, area_left: float, rng: np.random.Generator
) -> TransformedMesh:
    """Take very many tiny discs away, each a face or 1/4,000 of the area.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    area_left : float
        Share of the area.
    rng : Generator
        Draws the centres.

    Returns
    -------
    TransformedMesh
        The faces that are left, at least 50 where there were as many.
    """
    smallest = max(_MICRO_HOLE * mesh.area, mesh.area / mesh.n_faces)
    discs = max(1, round((1.0 - area_left) * mesh.area / smallest))
    return _without_discs(mesh, np.full(discs, (1.0 - area_left) * mesh.area / discs), rng)


def cut(mesh: TriangleMesh, *, area_left: float, rng: np.random.Generator) -> TransformedMesh:
    """Cut parts off, and keep one connected part of the area asked for.

    Half of the cuts are planes, as if parts had been sawn off. The others keep what is nearest to a
    random point along the surface.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    area_left : float
        Share of the area.
    rng : Generator
        Draws what kind of cut it is, and where.

    Returns
    -------
    TransformedMesh
        The faces that are left, at least 50 where there were as many.
    """
    if rng.integers(2):
        for _ in range(_PLANES):
            direction = rng.normal(size=3)
            kept = _below_plane(mesh, direction / np.linalg.norm(direction), area_left)
            if abs(_share(mesh, kept) - area_left) <= _TOLERANCE and kept.sum() >= FEWEST_FACES:
                return part(mesh, kept)
    distances = geodesic_distances(_graph(mesh), random_vertices(mesh, 1, rng))[0]
    return part(mesh, _nearest_faces(mesh, distances, area_left))


def _without_discs(
    mesh: TriangleMesh, areas: FloatArray, rng: np.random.Generator
) -> TransformedMesh:
    """The mesh without a disc of each area, as long as 50 faces are left."""
    graph, face_areas = _graph(mesh), mesh.face_areas
    kept: BoolArray = np.ones(mesh.n_faces, dtype=np.bool_)
    fewest = min(FEWEST_FACES, mesh.n_faces)
    mean_area = float(face_areas.mean())
    owed = 0.0  # area that should be gone by now and is not; below 0 if too much is
    for area, centre in zip(areas, random_vertices(mesh, len(areas), rng), strict=True):
        owed += float(area)
        if owed <= 0.5 * mean_area:
            continue
        reach = _REACH * (np.sqrt(owed / np.pi) + np.sqrt(mean_area))
        distances = geodesic_distances(graph, np.array([centre]), limit=reach)[0]  # (n,)
        near = np.flatnonzero(kept & np.isfinite(distances)[mesh.faces].all(axis=1))
        near = near[np.argsort(distances[mesh.faces[near]].sum(axis=1), kind="stable")]
        taken = np.cumsum(face_areas[near])
        disc = near[: np.searchsorted(taken, owed) + 1]
        if kept.sum() - len(disc) < fewest:
            break
        kept[disc] = False
        owed -= float(face_areas[disc].sum())
    return part(mesh, kept)


def _below_plane(mesh: TriangleMesh, direction: FloatArray, area_left: float) -> BoolArray:
    """Faces (m,) of the largest component below a plane that has the area asked for, at least.

    The component grows with the height of the plane, so that halving finds it.
    """
    heights = (mesh.vertices @ direction)[mesh.faces].mean(axis=1)  # (m,)
    low, high = float(heights.min()), float(heights.max())
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _share(mesh, _largest_component(mesh, heights <= middle)) < area_left:
            low = middle
        else:
            high = middle
    return _largest_component(mesh, heights <= high)


def _largest_component(mesh: TriangleMesh, kept: BoolArray) -> BoolArray:
    """Those of the faces kept that are in the component of the largest area, (m,)."""
    faces = np.flatnonzero(kept)
    piece = TriangleMesh(mesh.vertices, mesh.faces[faces])
    labels = face_components(piece)
    largest = np.zeros(mesh.n_faces, dtype=np.bool_)
    if len(faces):
        largest[faces[labels == np.argmax(np.bincount(labels, piece.face_areas))]] = True
    return largest


def _nearest_faces(mesh: TriangleMesh, distances: FloatArray, area_left: float) -> BoolArray:
    """Faces (m,) nearest by distances (n,) that have the share of the area, at least 50."""
    far = distances[np.isfinite(distances)].max()
    distances = np.where(np.isfinite(distances), distances, 2.0 * far)
    order = np.argsort(distances[mesh.faces].sum(axis=1), kind="stable")
    taken = np.cumsum(mesh.face_areas[order])
    count = max(FEWEST_FACES, int(np.searchsorted(taken, area_left * taken[-1])) + 1)
    kept = np.zeros(mesh.n_faces, dtype=np.bool_)
    kept[order[:count]] = True
    return kept


def _share(mesh: TriangleMesh, kept: BoolArray) -> float:
    """Share of the area that some faces have."""
    areas = mesh.face_areas
    return float(areas[kept].sum() / areas.sum())


def _graph(mesh: TriangleMesh) -> sparse.csr_array:
    """Lengths of the edges, (n, n)."""
    return length_graph(mesh, undirected_edges(mesh))
