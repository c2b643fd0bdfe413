"""Pictures of shapes, drawn on the CPU: thumbnails and contact sheets.

The camera is orthographic and its direction fixed in the coordinates of the file. So all shapes of
a class, and all poses of a shape, are seen from the same side. Place and size follow the shape.
"""

import io
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import angle_weighted_normals, unit_vectors
from workers.rendering.colouring import finite_range, value_colours
from workers.rendering.rasterising import distinct, rasterise

Picture = NDArray[np.uint8]

# Chosen, not measured.
_SUPERSAMPLING = 2
_MARGIN = 0.06  # of the picture, on every side
_AZIMUTH, _ELEVATION = np.radians(35.0), np.radians(25.0)
_CREASE = np.cos(np.radians(40.0))  # corners bent more than this keep the normal of their face
_KEY = np.array([-0.42, 0.66, 0.62])  # direction to the light, in the camera's coordinates
_FILL = np.array([0.85, -0.05, 0.52])

# Of 1 to 9; measured on 12 thumbnails: 9 takes six times as long, for 5 % fewer bytes.
_COMPRESSION = 6


def render(
    mesh: TriangleMesh,
    *,
    size: int = 256,
    up: Literal["y", "z"] = "y",
    direction: Sequence[float] | None = None,
    background: tuple[int, int, int] | None = None,
    colour: tuple[int, int, int] = (126, 160, 203),
    values: FloatArray | None = None,
    value_range: tuple[float, float] | None = None,
    colours: FloatArray | None = None,
) -> Picture:
    """Shaded picture of a mesh of any unit, winding and topology.

    Parameters
    ----------
    mesh : TriangleMesh
        Faces that refer to a vertex that is not finite are left out; so are faces seen as lines.
    size : int
        Width and height in pixels, 1 to 4096.
    up : "y" or "z"
        The axis of the file that points upwards in the picture.
    direction : (3,) float, optional
        From the shape to the camera, in the file's coordinates; a three-quarter view without it.
    background : (red, green, blue), optional
        Transparent without it.
    colour : (red, green, blue)
        Of the surface in full light.
    values : (n,) float64, optional
        A function on the vertices that colours the surface instead, see `colouring`.
    value_range : (low, high), optional
        The values of the first and the last colour; the function's own range without them.
    colours : (n, 3) float64, optional
        Red, green and blue of each vertex, 0 to 255, where there are no values.

    Returns
    -------
    (size, size, 4) uint8 with alpha (not premultiplied), or (size, size, 3) with a background.

    Raises
    ------
    InvalidRequestError
        The size is outside 1 to 4096, the direction is zero, not finite, or no triple, there is
        not a value or a colour for each vertex, or their range does not ascend.
    """
    if not 1 <= size <= 4096:
        raise InvalidRequestError(f"a picture of {size} pixels was asked for, 1 to 4096 are drawn")
    camera = _camera(up, direction)  # (3, 3): rows right, up, towards the camera
    pixels = size * _SUPERSAMPLING
    vertices, faces = _finite(mesh)
    screen = _project(vertices, camera, pixels)  # (n, 3)
    face, weights = rasterise(screen, faces, pixels)  # (p²,), (p², 3)
    hit = np.flatnonzero(face >= 0)
    face, weights = face[hit], weights[hit]  # (h,), (h, 3)
    # rows of a picture grow downwards, the camera's second axis upwards
    seen = TriangleMesh(screen * np.array([1.0, -1.0, 1.0]), faces)
    shading = _shade(_normals(seen, face, weights))  # (h,)
    surface: FloatArray = np.array(colour, dtype=np.float64)  # (3,) or (h, 3)
    if values is not None:
        surface = _value_surface(mesh, values, value_range, faces[face], weights)
    elif colours is not None:
        surface = _coloured_surface(mesh, colours, faces[face], weights)
    return _develop(shading[:, None] * (surface / 255.0) ** 2.2, hit, pixels, background)


def contact_sheet(
    images: Sequence[Picture], *, columns: int, labels: Sequence[str] | None = None
) -> Picture:
    """Pictures in rows on white, each with its label underneath; a long one ends with "…".

    Parameters
    ----------
    images : sequence of (h, w, 3 or 4) uint8
        Pictures, as from `render`.
    columns : int
        Pictures in a row, at least 1.
    labels : sequence of str, optional
        One for each picture.

    Returns
    -------
    (height, width, 3) uint8
        Red, green and blue.

    Raises
    ------
    InvalidRequestError
        There are no images, no columns, or not a label for each image.
    """
    if not images or columns < 1:
        raise InvalidRequestError(
            f"a contact sheet needs images and columns, found {len(images)} and {columns}"
        )
    if labels is not None and len(labels) != len(images):
        raise InvalidRequestError(f"{len(labels)} labels were given for {len(images)} images")
    width = max(image.shape[1] for image in images)
    height = max(image.shape[0] for image in images)
    text = max(10, height // 11)
    line = 0 if labels is None else round(1.5 * text)
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * width, rows * (height + line)), "white")
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=text)
    for number, image in enumerate(images):
        left, top = number % columns * width, number // columns * (height + line)
        picture = Image.fromarray(image)
        sheet.paste(picture, (left, top), picture if picture.mode == "RGBA" else None)
        if labels is not None:
            middle = (left + width / 2, top + height + 0.45 * line)
            label = _fitting(labels[number], font, width)
            draw.text(middle, label, fill=(70, 74, 82), font=font, anchor="mm")
    return np.asarray(sheet, dtype=np.uint8)


def _fitting(label: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> str:
    """As much of a label as is not wider than its picture."""
    if font.getlength(label) <= width:
        return label
    kept = label
    while kept and font.getlength(f"{kept}…") > width:
        kept = kept[:-1]
    return f"{kept}…"


def encode_png(image: Picture, *, palette: int | None = None) -> bytes:
    """Bytes of a PNG file.

    Parameters
    ----------
    image : (h, w, 3 or 4) uint8
        A picture, as from `render`.
    palette : int, optional
        Most colours, 2 to 256; such a file is a third as large. All colours without it.

    Returns
    -------
    bytes
        The file.
    """
    picture = Image.fromarray(image)
    if palette is not None:
        opaque = picture.mode == "RGB"
        method = Image.Quantize.MEDIANCUT if opaque else Image.Quantize.FASTOCTREE
        picture = picture.quantize(palette, method=method)
    buffer = io.BytesIO()
    picture.save(buffer, format="PNG", compress_level=_COMPRESSION)
    return buffer.getvalue()


def _value_surface(
    mesh: TriangleMesh,
    values: FloatArray,
    limits: tuple[float, float] | None,
    corners: IntArray,
    weights: FloatArray,
) -> FloatArray:
    """Colours of a function, linear on each face, at the points that are seen, (hits, 3)."""
    if values.shape != (mesh.n_vertices,):
        raise InvalidRequestError(
            f"values of shape {values.shape} were given for {mesh.n_vertices} vertices"
        )
    low, high = finite_range(values) if limits is None else limits
    return value_colours(np.einsum("hc,hc->h", weights, values[corners]), low, high)


def _coloured_surface(
    mesh: TriangleMesh, colours: FloatArray, corners: IntArray, weights: FloatArray
) -> FloatArray:
    """Colours between those of the vertices, at the points that are seen, (hits, 3)."""
    if colours.shape != (mesh.n_vertices, 3):
        raise InvalidRequestError(
            f"colours of shape {colours.shape} were given for {mesh.n_vertices} vertices"
        )
    between: FloatArray = np.einsum("hc,hci->hi", weights, colours[corners])
    return np.clip(between, 0.0, 255.0)


def _camera(up: str, direction: Sequence[float] | None) -> FloatArray:
    """Right, up and towards the camera as the rows of a rotation, (3, 3)."""
    upwards = np.array([0.0, 1.0, 0.0] if up == "y" else [0.0, 0.0, 1.0])
    if direction is None:
        x, y, z = (
            np.sin(_AZIMUTH) * np.cos(_ELEVATION),
            np.sin(_ELEVATION),
            np.cos(_AZIMUTH) * np.cos(_ELEVATION),
        )
        direction = (x, y, z) if up == "y" else (x, -z, y)
    towards = np.asarray(direction, dtype=np.float64)
    length = np.linalg.norm(towards) if towards.shape == (3,) else np.nan
    if not (np.isfinite(length) and length > 0):
        raise InvalidRequestError(f"a direction of three numbers is expected, found {direction}")
    towards = towards / length
    right = np.cross(upwards, towards)
    if np.linalg.norm(right) < 1e-6:  # from straight above or below
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


def _finite(mesh: TriangleMesh) -> tuple[FloatArray, IntArray]:
    """Vertices and the faces whose three corners are finite; the other vertices as zeros."""
    finite = np.asarray(np.isfinite(mesh.vertices).all(axis=1), dtype=np.bool_)  # (n,)
    faces = mesh.faces if finite.all() else mesh.faces[finite[mesh.faces].all(axis=1)]
    return np.where(finite[:, None], mesh.vertices, 0.0), faces


def _project(vertices: FloatArray, camera: FloatArray, pixels: int) -> FloatArray:
    """Column, row and height above the picture in pixels, (n, 3); the shape fills the picture."""
    if len(vertices) == 0:
        return np.zeros((0, 3))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    unit = max(float((high / 2 - low / 2).max()), np.finfo(np.float64).tiny)
    seen = ((vertices - (low / 2 + high / 2)) / unit) @ camera.T  # (n, 3), about 1 in size
    low, high = seen.min(axis=0), seen.max(axis=0)
    extent = max(float((high - low)[:2].max()), 1e-12)
    scale = (1.0 - 2.0 * _MARGIN) * pixels / extent
    seen = (seen - (low + high) / 2) * scale
    return np.stack([pixels / 2 + seen[:, 0], pixels / 2 - seen[:, 1], seen[:, 2]], axis=1)


def _normals(seen: TriangleMesh, face: IntArray, weights: FloatArray) -> FloatArray:
    """Normals (h, 3), of any length, at points of faces (h,) with weights (h, 3) of corners."""
    drawn, place = distinct(face, seen.n_faces)  # each face is seen at many points
    lit = _corner_normals(seen, drawn)
    normals: FloatArray = np.zeros((len(face), 3))
    for axis in range(3):
        for corner in range(3):
            normals[:, axis] += weights[:, corner] * lit[:, corner, axis].take(place)
    return normals


def _corner_normals(seen: TriangleMesh, drawn: IntArray) -> FloatArray:
    """Normals at the corners of the faces drawn (h,), (h, 3, 3): smooth, but sharp at creases."""
    corners = seen.faces[drawn]  # (h, 3)
    flat = unit_vectors(TriangleMesh(seen.vertices, corners).face_normals)[:, None]  # (h, 1, 3)
    # Of a fine mesh most faces are not drawn: only those around the corners count.
    is_corner = np.zeros(seen.n_vertices, dtype=np.bool_)
    is_corner[corners] = True
    near = np.logical_or.reduce([is_corner.take(seen.faces[:, i]) for i in range(3)])  # (m,)
    around = TriangleMesh(seen.vertices, seen.faces[near])
    smooth = angle_weighted_normals(around)[corners]  # (h, 3, 3)
    creased = (smooth * flat).sum(axis=2, keepdims=True) < _CREASE
    both: FloatArray = np.where(creased, flat, smooth)
    return np.where(flat[:, :, 2:] < 0, -both, both)  # windings differ; both sides are lit


def _shade(normals: FloatArray) -> FloatArray:
    """Linear light that the eye receives from unit normals, (h,): two soft lights and a sky."""
    unit = unit_vectors(normals)
    key, fill = (_wrapped(unit @ unit_vectors(light)) for light in (_KEY, _FILL))
    sky = 0.5 + 0.5 * unit[:, 1]
    facing = np.clip(unit[:, 2], 0.0, 1.0)
    light = 1.0 * key + 0.2 * fill + 0.22 * sky + 0.05
    shading: FloatArray = light * (0.62 + 0.38 * facing**0.7)  # silhouettes a little darker
    return shading


def _wrapped(cosine: FloatArray) -> FloatArray:
    """Light of a large source: it reaches a little beyond the terminator."""
    return np.clip((cosine + 0.25) / 1.25, 0.0, None) ** 1.4


def _develop(
    colours: FloatArray, hit: IntArray, pixels: int, background: tuple[int, ...] | None
) -> Picture:
    """Average the samples of each pixel, (h, 3) at places (h,) of p² → (size, size, 3 or 4)."""
    size, step = pixels // _SUPERSAMPLING, _SUPERSAMPLING
    cell = hit // pixels // step * size + hit % pixels // step  # (h,)
    drawn, place = distinct(cell, size * size)  # (d,) pixels that are not empty
    samples = np.bincount(place, minlength=len(drawn))
    sums = [np.bincount(place, colours[:, i], minlength=len(drawn)) for i in range(3)]
    light = np.stack(sums, axis=1) / step**2  # (d, 3), premultiplied
    alpha = samples[:, None] / step**2  # (d, 1)
    if background is None:
        shown = np.clip(light / alpha, 0.0, 1.0) ** (1 / 2.2)
        image = np.zeros((size * size, 4), dtype=np.uint8)
        image[drawn] = np.round(255 * np.concatenate([shown, alpha], axis=1))
    else:
        behind = (np.array(background) / 255.0) ** 2.2
        shown = np.clip(light + (1.0 - alpha) * behind, 0.0, 1.0) ** (1 / 2.2)
        image = np.empty((size * size, 3), dtype=np.uint8)
        image[:] = np.round(255 * np.clip(behind, 0.0, 1.0) ** (1 / 2.2))
        image[drawn] = np.round(255 * shown)
    return image.reshape(size, size, -1)
