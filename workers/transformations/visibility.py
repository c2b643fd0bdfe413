"""View: the part of a surface that is seen from one side, as a scanner sees it."""

import numpy as np

from workers.geometry.arrays import BoolArray, FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import face_components
from workers.rendering.rasterising import rasterise
from workers.transformations.transformed import FEWEST_FACES, TransformedMesh, part

# Chosen, not measured.
_DIRECTIONS = 40  # ranked by how much of the surface faces them
_PIXELS_A_FACE = 40.0  # on average, so that few faces slip between pixels
_PIXELS = (128, 2048)  # of the picture's side, fewest and most
_SPECK = 1e-3  # of the area: smaller pieces are not scanned
_BEHIND = 1.5  # pixels that a face's middle may lie behind what is seen there


def see(
    mesh: TriangleMesh, *, rank: float, grazing_degrees: float, rng: np.random.Generator
) -> TransformedMesh:
    """Keep the faces that are seen from one direction and not at too grazing an angle.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology and winding.
    rank : float
        Place of the direction, 0 to 1, among 40 sorted by the area they see: 0 sees most, 1 least.
    grazing_degrees : float
        Largest angle between line of sight and normal.
    rng : Generator
        Draws the directions, and which one near that place it is.

    Returns
    -------
    TransformedMesh
        The faces that are left, at least 50 where there were as many.
    """
    direction = ranked_direction(mesh, rank=rank, rng=rng)
    seen = seen_faces(mesh, direction)
    steep = _cosines(mesh, direction) >= np.cos(np.radians(grazing_degrees))
    for kept in (_without_specks(mesh, seen & steep), seen & steep, seen):
        if kept.sum() >= min(FEWEST_FACES, mesh.n_faces):
            return part(mesh, kept)
    return part(mesh, np.ones(mesh.n_faces, dtype=np.bool_))


def ranked_direction(mesh: TriangleMesh, *, rank: float, rng: np.random.Generator) -> FloatArray:
    """Draw a direction that sees about so much of a surface.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology and winding.
    rank : float
        Its place, 0 to 1, among 40 sorted by the area they see: 0 sees most, 1 least.
    rng : Generator
        Draws the directions, and which one near that place it is.

    Returns
    -------
    (3,) float64
        Unit vector from the shape to the scanner.
    """
    directions = _random_directions(rng)
    shadows = np.abs(directions @ mesh.face_normals.T).sum(axis=1)  # (d,)
    place = (len(directions) - 1) * np.clip(rank + rng.uniform(-0.08, 0.08), 0.0, 1.0)
    chosen: FloatArray = directions[np.argsort(-shadows, kind="stable")[int(np.rint(place))]]
    return chosen


def _random_directions(rng: np.random.Generator) -> FloatArray:
    """Directions (d, 3), uniform over the sphere."""
    directions = rng.normal(size=(_DIRECTIONS, 3))
    unit: FloatArray = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return unit


def seen_faces(mesh: TriangleMesh, direction: FloatArray) -> BoolArray:
    """Faces that are seen from a direction: at some pixel, or in their middle.

    Parameters
    ----------
    mesh : TriangleMesh
        Of m faces.
    direction : (3,) float64
        Unit vector from the shape to the scanner.

    Returns
    -------
    (m,) bool
        True for a face that is seen.
    """
    pixels = int(np.clip(np.sqrt(_PIXELS_A_FACE * mesh.n_faces), *_PIXELS))
    screen = _screen(mesh.vertices, direction, pixels)
    nearest, weights = rasterise(screen, mesh.faces, pixels)
    hit = nearest >= 0
    depth = np.full(pixels * pixels, -np.inf)
    corners = screen[mesh.faces[nearest[hit]], 2]  # (hits, 3)
    depth[hit] = (weights[hit] * corners).sum(axis=1)
    middles = screen[mesh.faces].mean(axis=1)  # (m, 3)
    column, row = np.clip(middles[:, :2].astype(np.int64), 0, pixels - 1).T
    seen: BoolArray = middles[:, 2] >= depth[row * pixels + column] - _BEHIND
    seen[nearest[hit]] = True
    return seen


def viewing_axes(direction: FloatArray) -> FloatArray:
    """Axes of a picture that is taken from a direction.

    Parameters
    ----------
    direction : (3,) float64
        Unit vector from the shape to the scanner.

    Returns
    -------
    (3, 3) float64
        As columns two axes across the picture and the direction: right-handed, orthonormal.
    """
    aside = np.eye(3)[np.argmin(np.abs(direction))]
    right = np.cross(direction, aside)
    right /= np.linalg.norm(right)
    axes: FloatArray = np.stack([right, np.cross(direction, right), direction], axis=1)
    return axes


def _screen(vertices: FloatArray, direction: FloatArray, pixels: int) -> FloatArray:
    """Vertices in pixels, the third coordinate towards the scanner, (n, 3)."""
    seen = vertices @ viewing_axes(direction)
    low, high = seen.min(axis=0), seen.max(axis=0)
    extent = max(float((high - low)[:2].max()), np.finfo(np.float64).tiny)
    screen: FloatArray = 1.0 + (seen - low) * ((pixels - 2.0) / extent)
    return screen


def _cosines(mesh: TriangleMesh, direction: FloatArray) -> FloatArray:
    """Cosine between normal and line of sight, whichever way a face is wound, (m,)."""
    lengths = np.maximum(2.0 * mesh.face_areas, np.finfo(np.float64).tiny)
    cosines: FloatArray = np.abs(mesh.face_normals @ direction) / lengths
    return cosines


def _without_specks(mesh: TriangleMesh, seen: BoolArray) -> BoolArray:
    """The faces seen, (m,), without components below a thousandth of the area."""
    faces = np.flatnonzero(seen)
    piece = TriangleMesh(mesh.vertices, mesh.faces[faces])
    labels = face_components(piece)
    areas = np.bincount(labels, piece.face_areas)
    kept = seen.copy()
    kept[faces] = areas[labels] >= _SPECK * mesh.area
    return kept
