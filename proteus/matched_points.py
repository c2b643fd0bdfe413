"""A correspondence as the service answers it: its arrays, its figures, and a picture."""

import io
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from proteus.client import Document
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh
from workers.rendering.render import contact_sheet, encode_png, render

PICTURE_PIXELS = 512
GREY = 170.0  # of what has no counterpart
DARKEST, LIGHTEST = 60.0, 250.0
Arrays: TypeAlias = Mapping[str, NDArray[Any]]


def read(data: bytes) -> Arrays:
    """Read the npz of ``/correspondence?format=npz``.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    mapping of str to array
        Arrays by their names.
    """
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def summary(arrays: Arrays) -> Document:
    """Return what a correspondence says in a few figures.

    Parameters
    ----------
    arrays : mapping of str to array
        As `read` gives them.

    Returns
    -------
    dict
        ``scale``, ``mirrored``, ``coverage``, ``mean_confidence`` and ``points``, their number.
    """
    mirrored = int(arrays["mirrored"])
    return {
        "scale": float(arrays["scale"]),
        "mirrored": None if mirrored < 0 else bool(mirrored),
        "coverage": float(arrays["coverage"]),
        "mean_confidence": float(arrays["confidence"].mean()),
        "points": len(arrays["faces"]),
    }


def draw(first_glb: bytes, second_glb: bytes, arrays: Arrays) -> bytes:
    """Draw both shapes side by side; points that correspond have the same colour.

    Parameters
    ----------
    first_glb, second_glb : bytes
        The meshes that the correspondence is of, as GLB.
    arrays : mapping of str to array
        ``faces``, ``barycentric``, ``confidence`` and ``covered``.

    Returns
    -------
    bytes
        A PNG file. What has no counterpart is grey.
    """
    first, second = (parse(data, filename="mesh.glb").mesh for data in (first_glb, second_glb))
    colours = _position_colours(second)
    corners = second.faces[arrays["faces"]]
    carried = np.einsum("nc,nci->ni", arrays["barycentric"], colours[corners])
    pictures = [
        render(mesh, size=PICTURE_PIXELS, background=(255, 255, 255), colours=_greyed(own, weights))
        for mesh, own, weights in (
            (first, carried, arrays["confidence"]),
            (second, colours, arrays["covered"]),
        )
    ]
    return encode_png(contact_sheet(pictures, columns=2))


def _position_colours(mesh: TriangleMesh) -> FloatArray:
    """A colour for each vertex (n, 3) that tells where it is."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    places = (mesh.vertices - low) / np.maximum(high - low, 1e-300)
    colours: FloatArray = DARKEST + (LIGHTEST - DARKEST) * places
    return colours


def _greyed(colours: FloatArray, weights: FloatArray) -> FloatArray:
    """Colours (n, 3), grey where the weights (n,) are 0."""
    shares = np.clip(weights, 0.0, 1.0)[:, None]
    mixed: FloatArray = shares * colours + (1.0 - shares) * GREY
    return mixed
