"""Correspondences as blobs: of two meshes, under a key that changes with what they depend on."""

import hashlib
import json

import numpy as np

from workers.correspondence import CORRESPONDENCES_VERSION, Correspondence
from workers.geometry.views import mapping_view
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import BlobStore, correspondence_key
from workers.storage.shipped_models import shipped_whitening

_UNTOLD = -1  # where it is not known whether a map is mirrored
_FLOATS = ("confidence", "stretch", "bending", "covered")


def key_of(first: str, second: str, *, working_vertices: int) -> str:
    """Key of the correspondence of two meshes.

    Parameters
    ----------
    first, second : str
        SHA-256 of the uploaded meshes.
    working_vertices : int
        Most vertices of a working mesh.

    Returns
    -------
    Made by `correspondence_key`; another one once views, solver or matching give other results.
    """
    views = [
        mapping_view(working_vertices=working_vertices, is_closed=is_closed).key
        for is_closed in (True, False)
    ]
    text = json.dumps([CORRESPONDENCES_VERSION, shipped_whitening().to_json(), *views])
    return correspondence_key(first, second, hashlib.sha256(text.encode()).hexdigest()[:16])


def store_correspondence(blobs: BlobStore, key: str, found: Correspondence) -> None:
    """Store a correspondence of two cleaned meshes.

    Parameters
    ----------
    blobs : BlobStore
        Where it goes.
    key : str
        As `key_of` makes it.
    found : Correspondence
        Kept in single precision.
    """
    mirrored = _UNTOLD if found.mirrored is None else int(found.mirrored)
    arrays = {name: getattr(found, name).astype(np.float32) for name in _FLOATS}
    arrays |= {
        "faces": found.faces.astype(np.int32),
        "barycentric": found.barycentric.astype(np.float32),
        "scale": np.array(found.scale),
        "mirrored": np.array(mirrored),
        "coverage": np.array(found.coverage),
    }
    blobs.put(key, pack(arrays))


def load_correspondence(blobs: BlobStore, key: str) -> tuple[Correspondence, bytes]:
    """Return a correspondence that was stored.

    Parameters
    ----------
    blobs : BlobStore
        Where it is.
    key : str
        As `key_of` makes it.

    Returns
    -------
    The correspondence, and the bytes of its npz.

    Raises
    ------
    BlobNotFoundError
        It was not computed, or its meshes were pruned.
    """
    data = blobs.get(key)
    arrays = unpack(data)
    mirrored = int(arrays["mirrored"])
    found = Correspondence(
        scale=float(arrays["scale"]),
        mirrored=None if mirrored == _UNTOLD else bool(mirrored),
        coverage=float(arrays["coverage"]),
        faces=arrays["faces"],
        barycentric=arrays["barycentric"],
        **{name: arrays[name] for name in _FLOATS},
    )
    return found, data
