"""Scale: of the whole, of parts of the surface, and of one direction against another."""

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.transformations.elasticity import Deformation, ElasticSurface, deformed
from workers.transformations.metric import geodesic_distances, random_vertices
from workers.transformations.transformed import TransformedMesh, moved

# Chosen, not measured.
_PLACE_RADIUS = 0.18  # of √A: standard deviation of a place that swells or shrinks


def scale(mesh: TriangleMesh, *, factor: float, rng: np.random.Generator) -> TransformedMesh:
    """Multiply all coordinates by the factor or its inverse, as a coin says.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    factor : float
        Above 0.
    rng : Generator
        Tosses the coin.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    return moved(mesh, mesh.vertices * (factor if rng.integers(2) else 1.0 / factor))


def scale_affinely(
    mesh: TriangleMesh, *, ratio: float, rng: np.random.Generator
) -> TransformedMesh:
    """Stretch along random orthogonal axes, volume kept.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    ratio : float
        Of the longest stretch over the shortest; the third is drawn in between.
    rng : Generator
        Draws the axes.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    logarithms = np.log(ratio) * np.array([0.0, rng.uniform(), 1.0])
    stretches = np.exp(logarithms - logarithms.mean())
    centre = mesh.vertices.mean(axis=0)
    return moved(mesh, centre + (mesh.vertices - centre) @ (axes * stretches) @ axes.T)


def scale_locally(
    mesh: TriangleMesh, *, factor: float, places: int, rng: np.random.Generator
) -> TransformedMesh:
    """Let places of the surface swell or shrink, smoothly and with all that is there.

    A field of scales is given, and positions are found whose edges fit it best (Poisson). So a limb
    gets longer and thicker alike, and nothing turns inside out.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology.
    factor : float
        Scale in the middle of a place, or its inverse in a shrinking one.
    places : int
        How many, drawn uniformly over the area.
    rng : Generator
        Draws them, and which shrink.

    Returns
    -------
    TransformedMesh
        The same faces and vertex order.
    """
    seed = int(rng.integers(2**62))

    def swell(one: TriangleMesh) -> Deformation:
        surface = ElasticSurface(one)
        scales = _scales(surface, factor, places, np.random.default_rng(seed))
        maps = scales[:, None, None] * np.eye(3)
        return Deformation(surface.positions(maps), maps)

    return moved(mesh, deformed(mesh, swell))


def _scales(
    surface: ElasticSurface, factor: float, places: int, rng: np.random.Generator
) -> FloatArray:
    """Scale at each vertex, (n,), between the factor and its inverse."""
    mesh = surface.mesh
    centres = random_vertices(mesh, places, rng)
    signs = np.where(np.arange(places) % 2 == rng.integers(2), 1.0, -1.0)
    reach = geodesic_distances(surface.graph, centres) / (_PLACE_RADIUS * np.sqrt(mesh.area))
    total = signs @ np.exp(-0.5 * reach**2)  # (n,)
    return np.asarray(np.exp(np.log(factor) * np.clip(total, -1.0, 1.0)), dtype=np.float64)
