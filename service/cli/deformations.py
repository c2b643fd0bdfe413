"""Deformed copies of a mesh for the demo: noisy, with holes, scaled and turned, coarser."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray
from workers.geometry.mesh import TriangleMesh


def scale_and_turn(mesh: TriangleMesh, *, factor: float, rng: np.random.Generator) -> TriangleMesh:
    """Return the mesh scaled by a factor, turned at random and moved away from the origin."""
    rotation, upper = np.linalg.qr(rng.standard_normal((3, 3)))
    rotation = rotation * np.sign(np.diag(upper))
    rotation[:, 0] *= np.sign(np.linalg.det(rotation))  # no mirror image
    shift = rng.uniform(-5.0, 5.0, 3)
    return TriangleMesh(factor * mesh.vertices @ rotation.T + shift, mesh.faces)


def add_noise(mesh: TriangleMesh, *, strength: float, rng: np.random.Generator) -> TriangleMesh:
    """Return the mesh with normally distributed noise on its vertices.

    Parameters
    ----------
    mesh : TriangleMesh
        n vertices.
    strength : float
        Standard deviation as a share of the mean edge length.
    rng : Generator
        Source of the noise.
    """
    corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()
    noise = rng.normal(scale=strength * edge, size=mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + noise, mesh.faces)


def punch_holes(
    mesh: TriangleMesh, *, count: int, share: float, rng: np.random.Generator
) -> TriangleMesh:
    """Return the mesh without the faces around some random points.

    Parameters
    ----------
    mesh : TriangleMesh
        m faces.
    count : int
        Number of holes; they may touch.
    share : float
        Share of the faces that each hole takes.
    rng : Generator
        Chooses the centres.
    """
    centres = mesh.vertices[mesh.faces].mean(axis=1)  # (m, 3)
    kept: BoolArray = np.ones(len(centres), dtype=bool)
    for middle in rng.choice(len(centres), size=count, replace=False):
        distances: FloatArray = np.linalg.norm(centres - centres[middle], axis=1)
        kept[np.argsort(distances, kind="stable")[: max(1, int(share * len(centres)))]] = False
    return _used_part(mesh, kept)


def coarsen(mesh: TriangleMesh, *, share: float) -> TriangleMesh:
    """Return the mesh with about this share of its faces, simplified by quadric error."""
    from fast_simplification import simplify

    vertices, faces = simplify(
        mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), 1.0 - share
    )
    coarse = TriangleMesh(vertices.astype(np.float64), faces.astype(np.int64))
    return _used_part(coarse, np.ones(len(coarse.faces), dtype=bool))


def _used_part(mesh: TriangleMesh, kept: BoolArray) -> TriangleMesh:
    """Return the faces that are kept and the vertices they use."""
    used, faces = np.unique(mesh.faces[kept], return_inverse=True)
    return TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3))
