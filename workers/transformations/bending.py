"""Isometry: random bending that leaves lengths along the surface as they are."""

import numpy as np
from scipy.spatial.transform import Rotation

from workers.geometry.arrays import BoolArray, FloatArray
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.transformations.elasticity import Deformation, ElasticSurface, deformed
from workers.transformations.metric import farthest_vertices
from workers.transformations.transformed import TransformedMesh, moved

# Chosen, not measured.
_HANDLES = 8  # farthest points: the tips of limbs, mostly
_HANDLE_RADIUS = 0.3  # of the way to the nearest other handle: it turns as a whole
_ITERATIONS = 8  # of local and global steps: more of them unbend the surface
_LARGEST_STRAIN = 0.03  # relative change of length, median over edges
_MOST_FLIPPED = 0.002  # of the faces
_CALMER = 0.65  # factor on the angles of a pose that strains too much
_ATTEMPTS = 5


def bend(mesh: TriangleMesh, *, degrees: float, rng: np.random.Generator) -> TransformedMesh:
    """Bend a mesh as isometrically as possible, by random rotations of its extremities.

    Farthest points along the surface are turned at random about the middle. The rotation between
    them is the smoothest, which bends thin parts and leaves thick ones. Then a few
    as-rigid-as-possible iterations take the strain out (Sorkine, Alexa 2007). A bending that still
    strains edges by more than 3 % (median) is made again with smaller angles.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology; several components are bent as if they hung together.
    degrees : float
        Largest rotation of an extremity against the middle.
    rng : Generator
        Draws axes and angles.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    seed = int(rng.integers(2**62))
    return moved(mesh, deformed(mesh, lambda one: _bent(one, degrees, np.random.default_rng(seed))))


def _bent(mesh: TriangleMesh, degrees: float, rng: np.random.Generator) -> Deformation:
    """The first attempt that does not strain, or the last."""
    surface = ElasticSurface(mesh)
    held, turns = _handles(surface, np.radians(degrees), rng)
    turns = surface.interpolate(held, turns)  # (n, 3) rotation vectors
    for attempt in range(_ATTEMPTS):
        rotations = Rotation.from_rotvec(_CALMER**attempt * turns).as_matrix()
        for _ in range(_ITERATIONS):
            positions = surface.positions(rotations)
            rotations = surface.rotations(positions)
        if _is_sound(mesh, positions, rotations):
            break
    return Deformation(positions, rotations)


def _handles(
    surface: ElasticSurface, angle: float, rng: np.random.Generator
) -> tuple[BoolArray, FloatArray]:
    """Vertices in a handle, (n,), and the rotation vector of each, (n, 3), 0 elsewhere."""
    graph = surface.graph
    tips, distances = farthest_vertices(graph, 0, _HANDLES)  # (h,), (h, n)
    middle = int(np.argmin(distances.max(axis=0)))  # of all vertices the least remote
    axes = rng.normal(size=(len(tips), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = angle * rng.uniform(0.5, 1.0, len(tips))[:, None] * axes
    between = distances[:, tips] + np.diag(np.full(len(tips), np.inf))  # (h, h)
    radii = _HANDLE_RADIUS * np.minimum(between.min(axis=1), distances[:, middle])
    inside = distances <= radii[:, None]  # (h, n)
    owner = np.argmin(np.where(inside, distances, np.inf), axis=0)  # (n,)
    held = inside.any(axis=0)
    values = np.where(held[:, None], turns[owner], 0.0)
    held[middle] = True
    values[middle] = 0.0
    return held, values


def _is_sound(mesh: TriangleMesh, positions: FloatArray, rotations: FloatArray) -> bool:
    """Whether lengths are kept and no part is folded over."""
    edges = undirected_edges(mesh)
    before, after = edge_lengths(mesh.vertices, edges), edge_lengths(positions, edges)
    strain = np.abs(after - before) / np.maximum(before, np.finfo(np.float64).tiny)
    turned = np.einsum("mij,mj->mi", rotations[mesh.faces[:, 0]], mesh.face_normals)
    now = TriangleMesh(positions, mesh.faces).face_normals
    flipped = np.mean(np.einsum("mi,mi->m", turned, now) < 0)
    return bool(np.median(strain) <= _LARGEST_STRAIN and flipped <= _MOST_FLIPPED)
