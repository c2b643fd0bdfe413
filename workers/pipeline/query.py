"""A mesh that was asked with becomes a descriptor; the API ranks it."""

from workers.pipeline.solve import describe_mesh, read_mesh
from workers.pipeline.workbench import Workbench
from workers.storage.arrays import vector_to_bytes
from workers.storage.descriptors import store_query_vectors
from workers.storage.parts import Claim, finish_part
from workers.storage.solutions import store_cleaned
from workers.storage.trained_models import load_model


def answer_query(bench: Workbench, claim: Claim) -> None:
    """Describe a query mesh under its model; the cleaned mesh is kept, to be looked at.

    Raises
    ------
    ProteusError
        The mesh cannot be used; the query's job fails with this reason.
    """
    sha256, name = claim.payload["sha256"], claim.payload["model"]
    with bench.database.read() as session:
        model = load_model(session, name)
    read = read_mesh(
        bench.blobs, sha256, filename=claim.payload["filename"], settings=bench.settings
    )
    store_cleaned(bench.blobs, sha256, read.mesh)
    vectors = describe_mesh(bench.blobs, sha256, read.mesh, [model])
    with bench.database.begin() as session:
        store_query_vectors(session, sha256, [(name, vector_to_bytes(vectors[name]))])
        parts = finish_part(session, claim)
    bench.send(parts)
