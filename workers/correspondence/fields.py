"""What a map does to a surface: stretch and bending, averaged over small neighbourhoods."""

from dataclasses import dataclass

import numpy as np

from workers.correspondence.surface import Surface, summed
from workers.geometry.arrays import FloatArray, IntArray, lengths
from workers.geometry.edges import edge_lengths
from workers.geometry.normals import unit_vectors
from workers.geometry.shared_edges import SharedEdges

TIME = 0.002
"""How far values are averaged: as heat spreads in this time at area 1, about 0.09 √A wide."""

LARGEST_STRETCH = 3.0
"""Of ln of a ratio of areas: a factor of 20. More is a fault of the map."""


@dataclass(frozen=True, eq=False)
class Images:
    """Points of a target, one for each vertex of a source.

    Attributes
    ----------
    faces : (n,) int64
        Faces of the target.
    weights : (n, 3) float64
        Barycentric coordinates in them.
    """

    faces: IntArray
    weights: FloatArray

    def of(self, target: Surface, values: FloatArray) -> FloatArray:
        """Values of a field of the target at the points.

        Parameters
        ----------
        target : Surface
            Of m vertices.
        values : (m, ...) float64
            A value at each vertex.

        Returns
        -------
        (n, ...) float64
            Linear on each face.
        """
        corners = target.mesh.faces[self.faces]
        found: FloatArray = np.einsum("nc,nc...->n...", self.weights, values[corners])
        return found


def stretch(
    source: Surface, target: Surface, images: Images, scale: float, *, is_mirrored: bool = False
) -> FloatArray:
    """Local change of area beyond that of the scale: ln(dA′/dA) - 2 ln(scale).

    The image of a face counts with its sign, so that folds cancel out: negative where it is turned
    over.

    Parameters
    ----------
    source, target : Surface
        Of area 1 each.
    images : Images
        A point of the target for each vertex of the source.
    scale : float
        Lengths on the source, times this, are lengths on the target.
    is_mirrored : bool
        Whether the map turns all faces over: then they count the other way.

    Returns
    -------
    (n,) float64
        0 where areas are as the scale has them; 0.69 where they are twice as large.
    """
    mesh = source.mesh
    places = images.of(target, target.mesh.vertices)  # (n, 3)
    normals = images.of(target, target.normals)
    a, b, c = (places[mesh.faces[:, i]] for i in range(3))
    facing = unit_vectors(normals[mesh.faces].sum(axis=1))
    across = np.cross(b - a, c - a)
    # Where the surface is bent sharply inside a face, the sign still is one of the two.
    turn = np.sign(np.einsum("mi,mi->m", across, facing))
    signed = 0.5 * lengths(across) * turn
    before = source.averaged(_to_corners(mesh.faces, mesh.face_areas, mesh.n_vertices), TIME)
    after = source.averaged(_to_corners(mesh.faces, signed, mesh.n_vertices), TIME)
    after *= -1.0 if is_mirrored else 1.0
    ratio = after / np.maximum(before, 1e-12) / scale**2
    bound = np.exp(LARGEST_STRETCH)
    stretched: FloatArray = np.log(np.clip(ratio, 1.0 / bound, bound))
    return stretched


def bending(source: Surface, target: Surface, images: Images, scale: float) -> FloatArray:
    """Change of the mean curvature H = (κ₁ + κ₂) / 2 in units of 1 / √A of the source.

    Parameters
    ----------
    source, target : Surface
        Of area 1 each; wound outwards, H is positive where they are convex.
    images : Images
        A point of the target for each vertex of the source.
    scale : float
        Lengths on the source, times this, are lengths on the target.

    Returns
    -------
    (n,) float64
        scale · H′ - H: 0 for a scaled copy, √A / 2r for a plane that is rolled up to radius r.
    """
    before = mean_curvature(source, TIME)
    after = mean_curvature(target, TIME * scale**2)
    bent: FloatArray = scale * images.of(target, after) - before
    return bent


def mean_curvature(surface: Surface, time: float) -> FloatArray:
    """Mean curvature at the vertices, from the angles at the edges.

    An edge of length l between faces at an angle θ has the integral θ l / 2 (Steiner's formula).

    Parameters
    ----------
    surface : Surface
        Wound outwards.
    time : float
        How far it is averaged, see `Surface.averaged`.

    Returns
    -------
    (n,) float64
        In 1/length; 1/r on a sphere.
    """
    mesh = surface.mesh
    shared = SharedEdges.of(mesh.faces, mesh.n_vertices)
    normals = unit_vectors(mesh.face_normals)
    one, other = normals[shared.faces[:, 0]], normals[shared.faces[:, 1]]
    sines = lengths(np.cross(one, other))
    angles = np.arctan2(sines, np.einsum("ei,ei->e", one, other))
    tip = mesh.vertices[shared.tips[:, 1]] - mesh.vertices[shared.ends[:, 0]]
    convex = np.where(np.einsum("ei,ei->e", one, tip) <= 0.0, 1.0, -1.0)
    amounts = 0.25 * convex * angles * edge_lengths(mesh.vertices, shared.ends)  # an end each
    at_vertices = summed(shared.ends.ravel(), np.repeat(amounts, 2), mesh.n_vertices)
    return surface.averaged(at_vertices, time)


def _to_corners(faces: IntArray, amounts: FloatArray, count: int) -> FloatArray:
    """A third of what each face has to each of its corners, (count,)."""
    return summed(faces.ravel(), np.repeat(amounts / 3.0, 3), count)
