"""Two stored meshes become a correspondence: a point of the second for each vertex of the first."""

from workers.correspondence import carry, correspond
from workers.errors import BlobNotFoundError, ConflictError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution, Solver
from workers.geometry.topology import is_closed
from workers.geometry.views import mapping_view
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import MATCHING
from workers.pipeline.solve import solve_view
from workers.pipeline.workbench import Workbench
from workers.storage.correspondences import key_of, store_correspondence
from workers.storage.parts import Claim
from workers.storage.shipped_models import shipped_whitening
from workers.storage.solutions import load_cleaned


def match_meshes(bench: Workbench, claim: Claim) -> Outcome:
    """Find the correspondence of two meshes and store it, unless another worker did already.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names both meshes.

    Returns
    -------
    Outcome
        Nothing else: the blob is all there is.

    Raises
    ------
    ProteusError
        A mesh cannot be solved, or is gone; the job fails with this reason.
    """
    hashes = claim.payload["sha256"], claim.payload["other"]["sha256"]
    key = key_of(*hashes, working_vertices=bench.settings.working_vertices)
    if not bench.blobs.exists(key):
        first, second = (_cleaned(bench, sha256) for sha256 in hashes)
        solved = [
            _solved(bench, sha256, mesh)
            for sha256, mesh in zip(hashes, (first, second), strict=True)
        ]
        bench.progress.enter(MATCHING)
        found = correspond(solved[0], solved[1], shipped_whitening())
        carried = carry(found, (solved[0].mesh, solved[1].mesh), (first, second))
        store_correspondence(bench.blobs, key, carried)
    return Outcome()


def _cleaned(bench: Workbench, sha256: str) -> TriangleMesh:
    """The cleaned mesh, which was there when the job was made."""
    try:
        return load_cleaned(bench.blobs, sha256)
    except BlobNotFoundError:
        raise ConflictError(
            f"mesh {sha256[:8]} was deleted before its points were matched"
        ) from None


def _solved(bench: Workbench, sha256: str, mesh: TriangleMesh) -> Solution:
    """Solution of a mesh under the view for maps; stored, as others are."""
    view = mapping_view(working_vertices=bench.settings.working_vertices, is_closed=is_closed(mesh))
    solver = Solver(mesh, bench.progress.enter)
    return solve_view(bench.blobs, sha256, mesh, view, solver)
