"""A region of a stored shape becomes a mesh to query with, as if it had been sent."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from service.schemas.queries import Region, RegionAnswer
from workers.errors import BlobNotFoundError, InvalidRequestError
from workers.geometry.formats import write
from workers.geometry.mesh import TriangleMesh
from workers.geometry.regions import cut_disc, cut_vertices, require_vertices
from workers.storage.blobs import BlobStore
from workers.storage.solutions import load_cleaned
from workers.storage.stored_meshes import StoredMesh

FILE_NAME = "region.ply"


@dataclass(frozen=True)
class StoredRegion:
    """A region as a file.

    Attributes
    ----------
    sha256 : str
        Of the file.
    name : str
        Of the file.
    content : bytes or None
        None for a region of all faces: it is the file of the shape, which is stored.
    found : RegionAnswer
        What the region holds.
    """

    sha256: str
    name: str
    content: bytes | None
    found: RegionAnswer


def cut_stored(blobs: BlobStore, stored: StoredMesh, region: Region) -> StoredRegion:
    """Cut a region out of the cleaned mesh of a shape; the same region has the same bytes.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    stored : StoredMesh
        Mesh of the shape.
    region : Region
        Its vertices are those of ``/mesh?format=glb``.

    Returns
    -------
    StoredRegion
        A binary PLY with every bit of the coordinates, or the file of the shape.

    Raises
    ------
    InvalidRequestError
        A vertex is none of the mesh, or the region has too few faces.
    ShapeNotReadyError
        The shape has no cleaned mesh.
    """
    try:
        mesh = load_cleaned(blobs, stored.sha256)
    except BlobNotFoundError:
        raise stored.absence from None
    cut = _cut(mesh, region)
    found = RegionAnswer(n_vertices=cut.n_vertices, n_faces=cut.n_faces)
    if cut is mesh:
        return StoredRegion(stored.sha256, stored.name, None, found)
    content = write(cut, "ply")
    return StoredRegion(hashlib.sha256(content).hexdigest(), FILE_NAME, content, found)


def _cut(mesh: TriangleMesh, region: Region) -> TriangleMesh:
    if region.is_disc:
        with _at("region.center"):
            require_vertices(mesh, np.array([region.center]))
        with _at("region.radius"):
            return cut_disc(mesh, region.center, region.radius)
    with _at("region.vertices"):
        return cut_vertices(mesh, np.array(region.vertices, dtype=np.int64))


@contextmanager
def _at(place: str) -> Iterator[None]:
    """Put the place in the request before the message of what is refused there."""
    try:
        yield
    except InvalidRequestError as error:
        error.locate(place)
        raise
