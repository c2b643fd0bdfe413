"""Queries of an evaluation are asked under one model."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from workers.errors import ProteusError
from workers.geometry.arrays import Float32Array, FloatArray
from workers.pipeline.evaluation_plan import load_frame
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.retrieval.protocol import Protocol
from workers.retrieval.ranking import rank_queries
from workers.retrieval.scan import distances, rerank
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import ranking_key
from workers.storage.change_feed import changes_after
from workers.storage.parts import Claim, Failure, finish_part
from workers.storage.trained_models import load_model


def rank(bench: Workbench, claim: Claim) -> None:
    """Ask some queries of a frame under one model, and keep what they found."""
    failure = None
    try:
        _rank(bench, claim.payload)
    except ProteusError as error:
        failure = Failure(claim.payload["model"], error.kind, str(error))
    with bench.database.begin() as session:
        parts = finish_part(session, claim, failure=failure)
    bench.send(parts)


def _rank(bench: Workbench, payload: Mapping[str, Any]) -> None:
    """Store the ranking, unless a shape is gone: then the frame changes first."""
    protocol = load_frame(bench.blobs, payload["evaluation_id"], payload["frame"]).protocol
    with bench.database.read() as session:
        model = load_model(session, payload["model"])
        matrix = _descriptors(session, protocol, model, payload["collection_id"])
    if matrix is None:
        return
    targets = matrix[protocol.targets]  # (m, d)

    def far(place: int) -> FloatArray:
        query = matrix[protocol.queries[place]]
        chosen = payload["dissimilarity"]
        near = distances(query, targets, model, dissimilarity=chosen)
        return rerank(query, lambda rows: targets[rows], near, model, dissimilarity=chosen)

    start, stop = payload["start"], payload["stop"]
    ranking = rank_queries(protocol, far, places=range(start, stop))
    key = ranking_key(payload["evaluation_id"], payload["frame"], payload["number"], start)
    bench.blobs.put(key, json.dumps(ranking.to_json()).encode())


def _descriptors(
    session: Session, protocol: Protocol, model: Model, collection_id: str
) -> Float32Array | None:
    """Descriptors (n, d) of the protocol's shapes; None if one of them has none any more."""
    place = {shape.id: i for i, shape in enumerate(protocol.shapes)}
    matrix = np.empty((len(place), model.dimension), dtype=np.float32)
    missing = set(place)
    changes = changes_after(session, collection_id=collection_id, model=model.name, number=0)
    for change in changes:
        if change.vector is not None and change.shape_id in place:
            matrix[place[change.shape_id]] = vector_from_bytes(change.vector)
            missing.discard(change.shape_id)
    return None if missing else matrix
