"""The meshes of uploaded shapes that models are learned from."""

from workers.errors import BlobNotFoundError
from workers.geometry.mesh import TriangleMesh
from workers.pipeline.solve import parse_upload, read_mesh
from workers.pipeline.workbench import Workbench
from workers.storage.solutions import load_cleaned
from workers.training.sources import StoredSource


def load_cleaned_mesh(bench: Workbench, source: StoredSource) -> TriangleMesh:
    """Return the cleaned mesh of an uploaded file; parse and clean it if it is not stored.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    source : StoredSource
        The file.

    Returns
    -------
    TriangleMesh
        In the unit of the file.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        The file holds no mesh that can be used.
    """
    try:
        return load_cleaned(bench.blobs, source.sha256)
    except BlobNotFoundError:
        return read_mesh(
            bench.blobs, source.sha256, filename=source.name, settings=bench.settings
        ).mesh


def load_mesh_in_file_order(bench: Workbench, source: StoredSource) -> TriangleMesh:
    """Return the mesh of an uploaded file as it was written: its vertices keep their numbers.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    source : StoredSource
        The file.

    Returns
    -------
    TriangleMesh
        Not cleaned.

    Raises
    ------
    InvalidMeshError, UnsupportedFormatError, UploadTooLargeError
        The file holds no mesh.
    """
    return parse_upload(
        bench.blobs, source.sha256, filename=source.name, settings=bench.settings
    ).mesh
