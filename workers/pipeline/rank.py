"""The queries of an evaluation are ranked under one model."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.geometry.arrays import BoolArray, Float32Array, FloatArray, IntArray
from workers.pipeline.evaluation_plan import load_frame
from workers.pipeline.outcome import Outcome
from workers.pipeline.progress import SEARCHING
from workers.pipeline.windows import signature_of_query
from workers.pipeline.workbench import Workbench
from workers.retrieval.model import Model
from workers.retrieval.protocol import Protocol
from workers.retrieval.ranking import rank_queries
from workers.retrieval.scan import distances, rerank, with_points
from workers.retrieval.windows.closely import compare_closely
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.rows import ROW_BYTES
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import BlobStore, ranking_key
from workers.storage.change_feed import changes_after
from workers.storage.models import Shape, Signature
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

    start, stop = payload["start"], payload["stop"]
    chosen = payload["dissimilarity"]
    windows = None
    if model.windows is not None and chosen is None:
        windows = _Windows.load(bench, protocol, model, payload["collection_id"], start, stop)

    def distances_from(place: int) -> FloatArray:
        query = matrix[protocol.queries[place]]
        near = distances(query, targets, model, dissimilarity=chosen)
        fetch = targets.__getitem__
        found = rerank(query, fetch, near, model, dissimilarity=chosen)
        if windows is None:
            return found
        return windows.closely(place, found, partial(with_points, query, fetch, near, model))

    ranking = rank_queries(protocol, distances_from, places=range(start, stop))
    key = ranking_key(payload["evaluation_id"], payload["frame"], payload["number"], start)
    bench.blobs.put(key, json.dumps(ranking.to_json()).encode())
    return Outcome()


@dataclass(frozen=True, eq=False)
class _Windows:
    """Windows of an evaluation's queries and targets.

    Attributes
    ----------
    blobs : BlobStore
        Where signatures of queries are.
    contents : Mapping
        Hashes of the queries' meshes by their places.
    matching : WindowMatching
        Of the model.
    rows : (m, bytes) uint8
        Signatures of the targets.
    known : (m,) bool
        Which targets have one.
    protocol : Protocol
        Which shapes are queries and targets.
    """

    blobs: BlobStore
    contents: Mapping[int, str]
    matching: WindowMatching
    rows: NDArray[np.uint8]
    known: BoolArray
    protocol: Protocol

    @classmethod
    def load(
        cls,
        bench: Workbench,
        protocol: Protocol,
        model: Model,
        collection_id: str,
        start: int,
        stop: int,
    ) -> "_Windows | None":
        """Read the signatures of all targets, and which meshes the queries are."""
        if model.windows is None:
            return None
        targets = protocol.targets.tolist()
        place = {protocol.shapes[number].id: i for i, number in enumerate(targets)}
        rows = np.zeros((len(targets), ROW_BYTES), dtype=np.uint8)
        known = np.zeros(len(targets), dtype=np.bool_)
        ids = {n: protocol.shapes[int(protocol.queries[n])].id for n in range(start, stop)}
        with bench.database.read() as session:
            for change in changes_after(
                session, collection_id=collection_id, model=model.name, number=0, feed=Signature
            ):
                row = place.get(change.shape_id)
                if row is not None and change.vector and len(change.vector) == ROW_BYTES:
                    rows[row] = np.frombuffer(change.vector, dtype=np.uint8)
                    known[row] = True
            wanted = select(Shape.id, Shape.sha256).where(Shape.id.in_(ids.values()))
            contents = {row.id: row.sha256 for row in session.execute(wanted)}
        by_place = {n: contents[shape_id] for n, shape_id in ids.items() if shape_id in contents}
        return cls(bench.blobs, by_place, model.windows, rows, known, protocol)

    def closely(
        self, place: int, found: FloatArray, nearer: Callable[[IntArray], FloatArray]
    ) -> FloatArray:
        """Distances (m,) of a query from all evidence.

        A query that is a target itself is none of its own candidates, as in a search: it would take
        the place of another one. It is infinitely far.
        """
        content = self.contents.get(place)
        query = None if content is None else signature_of_query(self.blobs, content, self.matching)
        if query is None:
            return found
        others = np.flatnonzero(self.protocol.targets != self.protocol.queries[place])
        distances: FloatArray = np.full(len(found), np.inf)
        distances[others], _ = compare_closely(
            query,
            self.matching,
            found[others],
            lambda places: np.where(self.known[others[places]], others[places], -1),
            lambda rows, n_bytes: self.rows[rows, : n_bytes or None],
            nearer=lambda places: nearer(others[places]),
        )
        return distances


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
