"""A correspondence as the service answers it: its arrays, its figures, and a picture."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from proteus.client import Document
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh
from workers.rendering.render import Picture, contact_sheet, encode_png, render

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


@dataclass(frozen=True, eq=False)
class Pair:
    """Two shapes to be drawn side by side.

    Attributes
    ----------
    first, second : bytes
        Their meshes, as GLB.
    arrays : mapping of str to array, optional
        ``faces``, ``barycentric``, ``confidence`` and ``covered`` of their correspondence; nothing
        where there is none.
    label : str
        Below the second.
    """

    first: bytes
    second: bytes
    arrays: Arrays | None
    label: str = ""


def draw(pairs: Sequence[Pair]) -> bytes:
    """Draw shapes side by side, a row for each pair; points that correspond have the same colour.

    Parameters
    ----------
    pairs : sequence of Pair
        At least one.

    Returns
    -------
    bytes
        A PNG file. What has no counterpart is grey.
    """
    pictures = [picture for pair in pairs for picture in _drawn(pair)]
    labels = [label for pair in pairs for label in ("", pair.label)]
    has_labels = any(labels)
    return encode_png(contact_sheet(pictures, columns=2, labels=labels if has_labels else None))


def _drawn(pair: Pair) -> tuple[Picture, Picture]:
    """Both pictures of a pair."""
    first, second = (parse(data, filename="mesh.glb").mesh for data in (pair.first, pair.second))
    colours = _position_colours(second)
    if pair.arrays is None:
        carried, sure = np.zeros((first.n_vertices, 3)), np.zeros(first.n_vertices)
        covered = np.zeros(second.n_vertices)
    else:
        corners = second.faces[pair.arrays["faces"]]
        carried = np.einsum("nc,nci->ni", pair.arrays["barycentric"], colours[corners])
        sure, covered = pair.arrays["confidence"], pair.arrays["covered"]
    return _coloured(first, _greyed(carried, sure)), _coloured(second, _greyed(colours, covered))


def _coloured(mesh: TriangleMesh, colours: FloatArray) -> Picture:
    return render(mesh, size=PICTURE_PIXELS, background=(255, 255, 255), colours=colours)


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
