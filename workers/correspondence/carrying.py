"""A correspondence of working meshes, carried to the meshes that people look at."""

from dataclasses import replace

import numpy as np

from workers.correspondence.matching import Correspondence
from workers.geometry.arrays import BoolArray, FloatArray, lengths
from workers.geometry.edges import edge_lengths, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.transfer import SurfacePoints, closest_points

_APART = 6.0  # mean edges between the images of one face's corners, from which they are torn
_FAR = 0.05  # √A from the working mesh: what lies farther away is not on it


def carry(
    found: Correspondence,
    working: tuple[TriangleMesh, TriangleMesh],
    cleaned: tuple[TriangleMesh, TriangleMesh],
) -> Correspondence:
    """A correspondence for the vertices of a finer or coarser mesh of the same two surfaces.

    Parameters
    ----------
    found : Correspondence
        Of the working meshes.
    working, cleaned : (TriangleMesh, TriangleMesh)
        Of the first and the second shape, in the same position.

    Returns
    -------
    Correspondence
        One point on the second cleaned mesh for each vertex of the first, and one value of
        ``covered`` for each vertex of the second. What the working mesh left out, such as
        components that count for next to nothing, has no confidence.
    """
    first = closest_points(working[0], cleaned[0].vertices)
    second = closest_points(working[1], cleaned[1].vertices)
    images = closest_points(cleaned[1], _places(found, first, working[1]))
    near = _is_near(first, working[0])
    confidence = np.where(near, first.interpolate(found.confidence), 0.0)
    return replace(
        found,
        faces=images.faces,
        barycentric=images.weights,
        confidence=confidence,
        stretch=first.interpolate(found.stretch),
        bending=first.interpolate(found.bending),
        covered=np.where(_is_near(second, working[1]), second.interpolate(found.covered), 0.0),
    )


def _places(found: Correspondence, first: SurfacePoints, target: TriangleMesh) -> FloatArray:
    """Where the vertices (n, 3) go: between the images of the corners around them."""
    corners = target.vertices[target.faces[found.faces]]
    images = np.einsum("nc,nci->ni", found.barycentric, corners)
    around = images[first.corners]  # (n, 3, 3)
    nearest = around[np.arange(len(around)), first.weights.argmax(axis=1)]
    spread = np.max([lengths(around[:, i] - nearest) for i in range(3)], axis=0)
    usual = float(edge_lengths(target.vertices, undirected_edges(target)).mean())
    between = np.einsum("nc,nci->ni", first.weights, around)
    torn = spread > _APART * usual
    places: FloatArray = np.where(torn[:, None], nearest, between)
    return places


def _is_near(points: SurfacePoints, mesh: TriangleMesh) -> BoolArray:
    """Which points (n,) are on the working mesh, up to what simplifying moves."""
    near: BoolArray = points.squared_distances <= _FAR**2 * mesh.area
    return near
