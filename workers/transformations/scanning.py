"""Scan: a shape as one range image of a scanner gives it, with the scanner's own triangles."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_cdt, gaussian_filter
from scipy.special import ndtr

from workers.geometry.arrays import BoolArray, FloatArray, IntArray, lengths
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import surface_components
from workers.rendering.rasterising import rasterise
from workers.transformations.transformed import FEWEST_FACES, TransformedMesh, part
from workers.transformations.visibility import ranked_direction, viewing_axes

# Chosen, not measured.
_STANDOFF = 4.0  # radii of the shape from its middle to the scanner
_COARSE = 128  # pixels of the first picture's side, which tells how large the shadow is
_PIXELS = 1024  # of the picture's side, most
_MARGIN = 2  # pixels around the shape
_STEP = 4.0  # pixels: neighbours that differ by more in depth are not joined (Turk, Levoy 1994)
_RIM = 3  # pixels: this near to a border they may be lost, each one in half as often
_ISLAND = 0.005  # of the faces: smaller pieces are dropped, as the scanners' programs do
_BLUR = 1.2  # pixels: how far noise is alike
_WHITE = 0.3  # of the noise's variance: each pixel's own part
_CLIPPED = 3.0  # standard deviations: no noise is larger


@dataclass(frozen=True)
class Scanner:
    """What a scanner can do.

    Attributes
    ----------
    samples : int
        Pixels on the shape, about.
    grazing_degrees : float
        Largest angle between line of sight and normal.
    rim_loss : float
        Share of the pixels at a border that are lost.
    noise : float
        Standard deviation along the line of sight, in √area.
    quantum : float
        Smallest difference of depth that is told apart, in √area.
    """

    samples: int
    grazing_degrees: float
    rim_loss: float
    noise: float
    quantum: float


@dataclass(frozen=True, eq=False)
class RangeImage:
    """The depth at each pixel of a square picture in perspective.

    Attributes
    ----------
    eye : (3,) float64
        Where the scanner stands.
    axes : (3, 3) float64
        As columns two axes across the picture and the direction to the scanner.
    low : (2,) float64
        Where the picture begins, on the plane at the standoff.
    standoff, pitch : float
        Depth of the shape's middle, and the distance of two pixels there.
    depth : (p, p) float64
        Along the axis from the scanner; infinite where nothing is.
    face : (p, p) int64
        The face that is seen; -1 for none.
    """

    eye: FloatArray
    axes: FloatArray
    low: FloatArray
    standoff: float
    pitch: float
    depth: FloatArray
    face: IntArray

    def points(self, depth: FloatArray, cells: IntArray) -> FloatArray:
        """Return the points in space of pixels.

        Parameters
        ----------
        depth : (p, p) float64
            Along the axis from the scanner.
        cells : (q,) int64
            Pixels, row by row.

        Returns
        -------
        (q, 3) float64
            In the unit of the mesh.
        """
        row, column = np.divmod(cells, depth.shape[1])
        across = self.low + self.pitch * (np.stack([column, row], axis=1) + 0.5)  # (q, 2)
        away = depth.ravel()[cells]  # (q,)
        right, up = (across * (away / self.standoff)[:, None]).T  # (q,), (q,)
        # axis by axis: a product of matrices may round otherwise on another processor
        first, second, towards = self.axes.T
        points: FloatArray = self.eye + (
            right[:, None] * first + up[:, None] * second - away[:, None] * towards
        )
        return points


def scan(
    mesh: TriangleMesh, scanner: Scanner, *, rank: float, rng: np.random.Generator
) -> TransformedMesh:
    """Scan a shape from one side.

    Where a direction leaves fewer than 50 faces, one of half the rank is tried, then the one that
    sees most. If that leaves too few as well, the mesh comes back as it is.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology and winding.
    scanner : Scanner
        What it can do.
    rank : float
        Place of the direction, 0 to 1, among 40 sorted by the area they see: 0 sees most, 1 least.
    rng : Generator
        Draws the direction, the pixels that are lost, and the noise.

    Returns
    -------
    TransformedMesh
        Two faces between neighbouring pixels, wound to be seen from the scanner. The origin of a
        vertex is the nearest corner of the face that its pixel sees; pixels may share one.
    """
    for place in (rank, rank / 2, 0.0):
        direction = ranked_direction(mesh, rank=place, rng=rng)
        found = scan_from(mesh, direction, scanner, rng=rng)
        if found.mesh.n_faces >= FEWEST_FACES:
            return found
    return part(mesh, np.ones(mesh.n_faces, dtype=np.bool_))


def scan_from(
    mesh: TriangleMesh, direction: FloatArray, scanner: Scanner, *, rng: np.random.Generator
) -> TransformedMesh:
    """Scan a shape from a given direction, however little is seen.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology and winding.
    direction : (3,) float64
        Unit vector from the shape to the scanner.
    scanner : Scanner
        What it can do.
    rng : Generator
        Draws the pixels that are lost, and the noise.

    Returns
    -------
    TransformedMesh
        As from `scan`, perhaps without any face.
    """
    image = range_image(mesh, direction, scanner.samples)
    joined = join_pixels(image, image.depth, scanner.grazing_degrees)
    kept = np.where(_lost(joined, image, scanner.rim_loss, rng), np.inf, image.depth)
    joined = join_pixels(image, kept, scanner.grazing_degrees)
    joined = _without_islands(joined, kept.size)
    cells, faces = np.unique(joined, return_inverse=True)
    unit = float(np.sqrt(mesh.area))
    measured = _measured(image.depth, scanner.noise * unit, scanner.quantum * unit, rng)
    scanned = TriangleMesh(image.points(measured, cells), faces.reshape(-1, 3))
    return TransformedMesh(scanned, _nearest_corners(mesh, image, cells))


def range_image(mesh: TriangleMesh, direction: FloatArray, samples: int) -> RangeImage:
    """Measure the depth of a shape without any noise, at about so many pixels.

    Parameters
    ----------
    mesh : TriangleMesh
        Of any topology and winding.
    direction : (3,) float64
        Unit vector from the shape to the scanner.
    samples : int
        Pixels on the shape; a thin shape that crosses the whole picture has fewer.

    Returns
    -------
    RangeImage
        Of at most 1024 pixels a side.
    """
    axes = viewing_axes(direction)
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    centred = (mesh.vertices - middle) @ axes  # (n, 3)
    standoff = _STANDOFF * max(float(lengths(centred).max()), np.finfo(np.float64).tiny)
    away = standoff - centred[:, 2]  # (n,)
    # 1/depth is linear in a picture in perspective, and larger when nearer: a z-buffer takes it
    flat = np.column_stack([centred[:, :2], np.ones(len(away))]) * (standoff / away)[:, None]
    low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    extent = max(float((high - low).max()), 1e-9 * standoff)
    coarse, _ = rasterise(_on_screen(flat, low, extent / _COARSE), mesh.faces, _COARSE)
    shadow = max(float((coarse >= 0).mean()), 1.0 / _COARSE**2)  # of the picture
    across = min(float(np.sqrt(samples / shadow)), _PIXELS - 2.0 * _MARGIN)
    pitch = extent / across
    low = low - _MARGIN * pitch
    pixels = int(np.ceil(across)) + 2 * _MARGIN
    screen = _on_screen(flat, low, pitch)
    face, weights = rasterise(screen, mesh.faces, pixels)
    depth = np.full(pixels * pixels, np.inf)
    hit = np.flatnonzero(face >= 0)
    nearness = (weights[hit] * screen[mesh.faces[face[hit]], 2]).sum(axis=1)
    depth[hit] = standoff * weights[hit].sum(axis=1) / nearness
    shape = (pixels, pixels)
    eye = middle + standoff * direction
    return RangeImage(eye, axes, low, standoff, pitch, depth.reshape(shape), face.reshape(shape))


def _on_screen(flat: FloatArray, low: FloatArray, pitch: float) -> FloatArray:
    """Positions on the plane at the standoff in pixels; the third coordinate stays, (n, 3)."""
    return np.column_stack([(flat[:, :2] - low) / pitch, flat[:, 2]])


def join_pixels(image: RangeImage, depth: FloatArray, grazing_degrees: float) -> IntArray:
    """Make faces of neighbouring pixels, across no step of depth and at no grazing angle.

    Parameters
    ----------
    image : RangeImage
        Says where the pixels are.
    depth : (p, p) float64
        Along the axis from the scanner; infinite for a pixel that is not there.
    grazing_degrees : float
        Largest angle between line of sight and normal.

    Returns
    -------
    (m, 3) int64
        Pixels, row by row; seen from the scanner, faces go round anticlockwise.
    """
    found = []
    for corners in _corner_triples(depth):
        away = depth.ravel()[corners]  # (c, 3)
        steps = np.abs(away - away[:, [1, 2, 0]]).max(axis=1)  # (c,)
        corners = corners[steps <= _STEP * image.pitch]
        a, b, c = (image.points(depth, corners[:, i]) for i in range(3))
        normals = np.cross(b - a, c - a)
        sight = image.eye - (a + b + c) / 3
        cosines = (normals * sight).sum(axis=1) / (lengths(normals) * lengths(sight))
        found.append(corners[cosines >= np.cos(np.radians(grazing_degrees))])
    return np.concatenate(found)


def _corner_triples(depth: FloatArray) -> Iterator[IntArray]:
    """Triples of pixels that are there, (c, 3): each square is cut along its flatter diagonal."""
    size = depth.shape[1]
    there = np.isfinite(depth)
    count = there[:-1, :-1].astype(np.int64)  # (p - 1, p - 1) corners of each square
    for corners in (there[:-1, 1:], there[1:, :-1], there[1:, 1:]):
        count += corners
    row, column = np.nonzero(count >= 3)
    first = row * size + column
    square = np.stack([first, first + 1, first + size + 1, first + size], axis=1)  # (q, 4)
    away = depth.ravel()[square]  # (q, 4)
    present = np.isfinite(away)
    # Seen from the scanner, columns go right and rows up: 0, 1, 2, 3 is anticlockwise.
    ways = (((0, 1, 2), (0, 2, 3)), ((0, 1, 3), (1, 2, 3)))
    gaps = []
    for one, other in ((0, 2), (1, 3)):
        both = present[:, one] & present[:, other]
        gap = np.full(len(square), np.inf)
        gap[both] = np.abs(away[both, one] - away[both, other])
        gaps.append(gap)
    along_first = gaps[0] <= gaps[1]
    for chosen, pair in zip((along_first, ~along_first), ways, strict=True):
        for triple in pair:
            whole = chosen & present[:, triple].all(axis=1)
            yield square[np.ix_(whole, triple)]


def _lost(
    joined: IntArray, image: RangeImage, rim_loss: float, rng: np.random.Generator
) -> BoolArray:
    """Pixels that are lost near the borders of the faces, (p, p), several side by side."""
    # A pixel is inside if the four squares around it have both faces each. How many of those meet
    # in the pixel itself depends on the diagonals, so squares are counted, by their first pixel.
    size = image.depth.shape[1]
    corner = joined.min(axis=1)
    corner = corner - (joined % size < corner[:, None] % size).any(axis=1)  # of three without it
    full = (np.bincount(corner, minlength=size * size) == 2).reshape(size, size)
    inside = np.zeros_like(full)
    inside[1:, 1:] = full[1:, 1:] & full[:-1, 1:] & full[1:, :-1] & full[:-1, :-1]
    ring = distance_transform_cdt(inside, metric="chessboard")  # 0 at the border itself
    chance = np.where(ring < _RIM, rim_loss * 0.5**ring, 0.0)
    lost: BoolArray = ndtr(_noise(inside.shape, 0.5, rng)) < chance
    return lost


def _noise(shape: tuple[int, ...], white: float, rng: np.random.Generator) -> FloatArray:
    """Normally distributed numbers of variance 1; neighbours share all but the white part."""
    smooth = gaussian_filter(rng.standard_normal(shape), _BLUR, mode="wrap")
    smooth /= smooth.std()
    mixed: FloatArray = np.sqrt(1.0 - white) * smooth
    mixed += np.sqrt(white) * rng.standard_normal(shape)
    return mixed


def _measured(
    depth: FloatArray, noise: float, quantum: float, rng: np.random.Generator
) -> FloatArray:
    """The depth as the scanner tells it, (p, p), in multiples of its smallest step."""
    drawn = np.clip(_noise(depth.shape, _WHITE, rng), -_CLIPPED, _CLIPPED)
    return quantum * np.rint((depth + noise * drawn) / quantum)


def _without_islands(joined: IntArray, n_pixels: int) -> IntArray:
    """The faces without the pieces that have less than a two-hundredth of them, (m', 3)."""
    if len(joined) == 0:
        return joined
    labels = surface_components(TriangleMesh(np.zeros((n_pixels, 3)), joined))
    return joined[np.bincount(labels)[labels] >= _ISLAND * len(joined)]


def _nearest_corners(mesh: TriangleMesh, image: RangeImage, cells: IntArray) -> IntArray:
    """Of the corners of the face that each pixel sees, the one nearest to what it sees, (q,)."""
    corners = mesh.faces[image.face.ravel()[cells]]  # (q, 3)
    gaps = mesh.vertices[corners] - image.points(image.depth, cells)[:, None]  # (q, 3, 3)
    nearest: IntArray = corners[np.arange(len(corners)), (gaps**2).sum(axis=2).argmin(axis=1)]
    return nearest
