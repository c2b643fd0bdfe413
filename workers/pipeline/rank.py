"""The queries of an evaluation are ranked under one model."""

import json

import numpy as np
from sqlalchemy.orm import Session

from workers.geometry.arrays import Float32Array, FloatArray
from workers.pipeline.evaluation_plan import load_frame
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import SEARCHING
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.retrieval.protocol import Protocol
from workers.retrieval.ranking import rank_queries
from workers.retrieval.scan import distances, rerank
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import ranking_key
from workers.storage.change_feed import changes_after
from workers.storage.parts import Claim
from workers.storage.trained_models import load_model


def rank(bench: Workbench, claim: Claim) -> Outcome:
    """Rank the targets for some queries of a frame under one model, and store the ranking.

    If a shape was deleted meanwhile, nothing is stored: the evaluation then makes a smaller frame.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the evaluation, the frame, the model and the range of queries.

    Returns
    -------
    Outcome
        Nothing more to store: the ranking is a blob under a key of the frame.

    Raises
    ------
    ProteusError
        The model was deleted, or the frame cannot be read.
    """
    payload = claim.payload
    bench.progress.enter(SEARCHING)
    protocol = load_frame(bench.blobs, payload["evaluation_id"], payload["frame"]).protocol
    with bench.database.read() as session:
        model = load_model(session, payload["model"])
        matrix = _descriptors(session, protocol, model, payload["collection_id"])
    if matrix is None:
        return Outcome()
    targets = matrix[protocol.targets]  # (m, d)

    def distances_from(place: int) -> FloatArray:
        query = matrix[protocol.queries[place]]
        chosen = payload["dissimilarity"]
        near = distances(query, targets, model, dissimilarity=chosen)
        return rerank(query, lambda rows: targets[rows], near, model, dissimilarity=chosen)

    start, stop = payload["start"], payload["stop"]
    ranking = rank_queries(protocol, distances_from, places=range(start, stop))
    key = ranking_key(payload["evaluation_id"], payload["frame"], payload["number"], start)
    bench.blobs.put(key, json.dumps(ranking.to_json()).encode())
    return Outcome()


def _descriptors(
    session: Session, protocol: Protocol, model: Model, collection_id: str
) -> Float32Array | None:
    """Descriptors (n, d) of the protocol's shapes; None if one of them was deleted."""
    place = {shape.id: i for i, shape in enumerate(protocol.shapes)}
    matrix = np.empty((len(place), model.dimension), dtype=np.float32)
    missing = set(place)
    changes = changes_after(session, collection_id=collection_id, model=model.name, number=0)
    for change in changes:
        if change.vector is not None and change.shape_id in place:
            matrix[place[change.shape_id]] = vector_from_bytes(change.vector)
            missing.discard(change.shape_id)
    return None if missing else matrix
