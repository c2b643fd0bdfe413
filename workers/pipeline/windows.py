"""Windows of meshes: a signature for shapes that are stored, another for queries."""

import structlog

from workers.errors import BlobNotFoundError, InvalidMeshError, SpectrumError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.rows import write_row
from workers.retrieval.windows.signature import (
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.storage.arrays import pack, unpack
from workers.storage.blobs import BlobStore, spectrum_key
from workers.storage.solutions import load_cleaned

log = structlog.get_logger(__name__)


def take_signature(solver: Solver, mesh: TriangleMesh, matching: WindowMatching) -> bytes | None:
    """Signature of a shape that is searched for.

    Parameters
    ----------
    solver : Solver
        Of the mesh.
    mesh : TriangleMesh
        The cleaned mesh.
    matching : WindowMatching
        Of the model.

    Returns
    -------
    bytes or None
        As `write_row` writes them; None of a mesh that the view leaves nothing of. Such a shape is
        searched for by its descriptor alone.
    """
    try:
        working = solver.prepared(matching.view)
    except (InvalidMeshError, SpectrumError) as error:
        log.info("no windows were taken", reason=str(error))
        return None
    surface = window_surface(working, n_vertices=mesh.n_vertices, for_query=False)
    return write_row(stored_signature(surface))


def signature_of_query(
    blobs: BlobStore,
    sha256: str,
    matching: WindowMatching,
    *,
    mesh: TriangleMesh | None = None,
    solver: Solver | None = None,
) -> Signature | None:
    """Signature of a mesh that is searched with, computed only if none is stored.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    sha256 : str
        Of the mesh as it was uploaded.
    matching : WindowMatching
        Of the model.
    mesh : TriangleMesh, optional
        The cleaned mesh, where it is at hand.
    solver : Solver, optional
        Of this mesh, where it is solved under other views, too.

    Returns
    -------
    Signature or None
        As it is stored, so that it does not matter who computed it first. None of a mesh that the
        view leaves nothing of, or that is not stored any more.
    """
    key = spectrum_key(sha256, f"{matching.view.key}-query-{matching.version}")
    try:
        return Signature.from_arrays(unpack(blobs.get(key)))
    except BlobNotFoundError:
        pass
    try:
        mesh = mesh or load_cleaned(blobs, sha256)
        working = (solver or Solver(mesh)).prepared(matching.view)
    except (BlobNotFoundError, InvalidMeshError, SpectrumError) as error:
        log.info("no windows were taken", reason=str(error))
        return None
    surface = window_surface(working, n_vertices=mesh.n_vertices, for_query=True)
    arrays = query_signature(surface).to_arrays()
    blobs.put(key, pack(arrays))
    return Signature.from_arrays(arrays)
