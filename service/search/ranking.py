"""A question to a ranked answer."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from service.schemas.queries import AskedWith, Match, QueryOptions, QueryResult
from service.schemas.shapes import answer_shape
from service.search.filters import matching_shapes
from service.search.index import Snapshot
from service.search.indexes import SearchIndexes, SearchModel, load_search_model
from workers.errors import ModelNotReadyError, ShapeNotReadyError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, nearest, rerank, similarity
from workers.storage.arrays import vector_from_bytes
from workers.storage.collections import models_of
from workers.storage.descriptors import get_vector
from workers.storage.models import Collection
from workers.storage.shapes import ShapeView, get_shape, get_shapes

GATHER_ROWS = 16_384


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked, and how.

    Attributes
    ----------
    vector : (d,) float32
        Descriptor of what is asked with.
    asked_with : AskedWith
        A stored shape, or the hash of a mesh.
    options : QueryOptions
    search : SearchModel
        Under which the descriptor was made.
    """

    vector: Float32Array
    asked_with: AskedWith
    options: QueryOptions
    search: SearchModel


def choose_model(session: Session, collection: Collection, options: QueryOptions) -> SearchModel:
    """Return the model to search under, checked against the dissimilarity that is asked for.

    Raises
    ------
    ModelNotFoundError, ModelNotReadyError
        There is none of this name; the collection is not described under it.
    InvalidRequestError
        The dissimilarity is unknown or compares nothing that the model has.
    """
    name = options.model or collection.model
    search = load_search_model(session, name)
    if name not in models_of(session, collection.id):
        raise ModelNotReadyError(
            f"collection {collection.name!r} is not described under {name!r}; "
            f"PUT /v1/collections/{collection.name}/model does that first"
        )
    if options.dissimilarity is not None:
        search.model.check_dissimilarity(options.dissimilarity)
    return search


def shape_vector(session: Session, shape_id: str, model: str) -> Float32Array:
    """Return the descriptor of a stored shape.

    Raises
    ------
    ShapeNotFoundError, ShapeNotReadyError, ModelNotReadyError
        There is no such shape; it is not computed; it is not described under this model.
    """
    view = get_shape(session, shape_id)
    vector = get_vector(session, shape_id, model)
    if vector is None:
        require_ready(view)
        raise ModelNotReadyError(
            f"shape {shape_id} of collection {view.collection!r} is not described under {model!r}"
        )
    return vector_from_bytes(vector)


def require_ready(view: ShapeView) -> None:
    """Refuse a shape that is still being computed, or whose computation failed.

    Raises
    ------
    ShapeNotReadyError
        With its state, or the reason of its failure.
    """
    if view.state == "failed" and view.row.error is not None:
        raise ShapeNotReadyError(
            f"the computation of shape {view.row.id} failed: {view.row.error['detail']}"
        )
    if view.state != "ready":
        raise ShapeNotReadyError(f"shape {view.row.id} is {view.state}, expected ready")


def answer_question(
    session: Session, indexes: SearchIndexes, collection: Collection, question: Question
) -> QueryResult:
    """Rank the collection's shapes as it is now."""
    started = time.perf_counter()
    options, model = question.options, question.search.model
    snapshot = indexes.snapshot(collection.id, question.search)
    rows = _candidates(session, snapshot, collection, question)  # (m,)
    far = rerank(
        question.vector,
        lambda places: snapshot.matrix[rows[places]],
        _distances(snapshot, rows, question),
        model,
        dissimilarity=options.dissimilarity,
    )  # (m,)
    order, views = _nearest(session, snapshot, rows, far, options)
    near = similarity(far[order], model, dissimilarity=options.dissimilarity)
    matches = [
        Match(
            rank=place,
            distance=float(far[i]),
            similarity=float(alike),
            shape=answer_shape(view),
        )
        for place, (i, alike, view) in enumerate(zip(order, near, views, strict=True), start=1)
    ]
    return QueryResult(
        collection=collection.name,
        model=model.name,
        dissimilarity=options.dissimilarity or own_dissimilarity(model),
        query=question.asked_with,
        matches=matches,
        searched=len(rows),
        took_ms=round(1000 * (time.perf_counter() - started), 3),
    )


def own_dissimilarity(model: Model) -> str:
    """Names of what the model's channels are compared by, each once."""
    return ", ".join(dict.fromkeys(channel.dissimilarity for channel in model.channels))


def _candidates(
    session: Session, snapshot: Snapshot, collection: Collection, question: Question
) -> IntArray:
    """Rows that pass the filter, without the shape that is asked with."""
    options = question.options
    rows = snapshot.rows
    if options.filter is not None:
        rows = snapshot.rows_of(matching_shapes(session, collection.id, options.filter))
    own = question.asked_with.shape_id
    if own is not None and not options.include_self:
        for row in snapshot.rows_of([own]):
            rows = rows[rows != row]
    return rows


def _distances(snapshot: Snapshot, rows: IntArray, question: Question) -> FloatArray:
    """Distances of the candidates; a row's is the same whichever others are looked at."""
    model, chosen = question.search.model, question.options.dissimilarity
    if 2 * len(rows) > len(snapshot.matrix):
        all_rows = distances(question.vector, snapshot.matrix, model, dissimilarity=chosen)
        return all_rows[rows]
    parts = [
        distances(
            question.vector,
            snapshot.matrix[rows[start : start + GATHER_ROWS]],
            model,
            dissimilarity=chosen,
        )
        for start in range(0, len(rows), GATHER_ROWS)
    ]
    return np.concatenate([np.empty(0), *parts])


def _nearest(
    session: Session,
    snapshot: Snapshot,
    rows: IntArray,
    far: FloatArray,
    options: QueryOptions,
) -> tuple[Sequence[int], Sequence[ShapeView]]:
    """Order of the nearest candidates and their shapes; shapes deleted meanwhile are passed over.

    Returns
    -------
    Places in ``rows``, the nearest first, and their shapes.
    """
    ids = _PickedIds(snapshot.ids, rows)
    gone = 0
    while True:
        order = nearest(far, ids, options.limit + gone).tolist()
        if options.max_distance is not None:
            order = [i for i in order if far[i] <= options.max_distance]
        views = get_shapes(session, [ids[i] for i in order])
        there = [i for i in order if ids[i] in views]
        missing = len(order) - len(there)
        if missing <= gone or len(order) < options.limit + gone:
            there = there[: options.limit]
            return there, [views[ids[i]] for i in there]
        gone = missing


class _PickedIds(Sequence[str]):
    """Ids of some rows, without a list of them."""

    def __init__(self, ids: Sequence[str], rows: IntArray) -> None:
        self._ids = ids
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: Any) -> Any:
        return self._ids[self._rows[place]]
