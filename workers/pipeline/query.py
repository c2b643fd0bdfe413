"""The mesh of a query becomes a descriptor; the API ranks it."""

from functools import partial

from sqlalchemy.orm import Session

from workers.geometry.solution import Solver
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import READING
from workers.pipeline.solve import describe_mesh, read_mesh
from workers.pipeline.windows import signature_of_query
from workers.pipeline.workbench import Workbench
from workers.storage.arrays import vector_to_bytes
from workers.storage.descriptors import store_query_vectors
from workers.storage.models import Job
from workers.storage.parts import Claim
from workers.storage.solutions import store_cleaned
from workers.storage.trained_models import load_model


def answer_query(bench: Workbench, claim: Claim) -> Outcome:
    """Describe a query mesh under its model, and keep the cleaned mesh for the viewer.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the mesh, its file and the model.

    Returns
    -------
    Outcome
        Stores the descriptor under the content of the mesh.

    Raises
    ------
    ProteusError
        The mesh cannot be used; the query's job fails with this reason.
    """
    sha256, name = claim.payload["sha256"], claim.payload["model"]
    with bench.database.read() as session:
        model = load_model(session, name)
    bench.progress.enter(READING)
    read = read_mesh(
        bench.blobs, sha256, filename=claim.payload["filename"], settings=bench.settings
    )
    store_cleaned(bench.blobs, sha256, read.mesh)
    solver = Solver(read.mesh, bench.progress.enter)
    described = describe_mesh(
        bench.blobs, sha256, read.mesh, [model], enter=bench.progress.enter, solver=solver
    )
    if model.windows is not None:
        signature_of_query(bench.blobs, sha256, model.windows, mesh=read.mesh, solver=solver)
    vector = described.vectors[name]
    return Outcome(store=partial(_store, sha256, name, vector_to_bytes(vector)))


def _store(sha256: str, model: str, vector: bytes, session: Session, _job: Job) -> None:
    store_query_vectors(session, sha256, [(model, vector)])
