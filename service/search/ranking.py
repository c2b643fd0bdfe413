"""From a query to the nearest shapes of a collection."""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from service.search.closely import closely
from service.search.filters import matching_shapes
from service.search.index import Snapshot
from service.search.indexes import SearchIndexes, SearchModel, load_search_model
from service.search.queries import Match, Ranking, SearchOptions, SearchQuery
from workers.errors import ModelNotReadyError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.retrieval.model import Model
from workers.retrieval.scan import distances, nearest, rerank, similarity, with_points
from workers.storage.collections import models_of
from workers.storage.models import Collection
from workers.storage.shapes import ShapeView, get_shapes

GATHER_ROWS = 16_384
"""So many rows are copied together at a time where few rows of an index are compared."""


def choose_model(session: Session, collection: Collection, options: SearchOptions) -> SearchModel:
    """Return the model to search under, once it is known that it fits the options.

    Parameters
    ----------
    session : Session
        That reads.
    collection : Collection
        That is searched.
    options : SearchOptions
        May name a model and a dissimilarity.

    Returns
    -------
    SearchModel
        The model named, or the collection's own.

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


def rank_shapes(
    session: Session, indexes: SearchIndexes, collection: Collection, query: SearchQuery
) -> Ranking:
    """Rank the shapes of a collection as it is now.

    Parameters
    ----------
    session : Session
        That reads; it decides the filter and gives the shapes found.
    indexes : SearchIndexes
        Of this process.
    collection : Collection
        That is searched.
    query : SearchQuery
        What is searched for.

    Returns
    -------
    Ranking
        The nearest shapes, by the model's distance Σ weight · (D / scale)^power.
    """
    started = time.perf_counter()
    options, model = query.options, query.search.model
    snapshot = indexes.snapshot(collection.id, query.search)
    rows = _candidates(session, snapshot, collection, query)  # (m,)
    scanned = _distances(snapshot, rows, query)  # (m,)

    def fetch(places: IntArray) -> Float32Array:
        return snapshot.matrix[rows[places]]

    found = rerank(query.vector, fetch, scanned, model, dissimilarity=options.dissimilarity)
    n_closely, quantiles = 0, model.impostor_quantiles
    if model.windows is not None and query.signature is not None and not options.dissimilarity:
        found, n_closely = closely(
            query.signature,
            model.windows,
            found,
            _PickedIds(snapshot.ids, rows),
            indexes.signatures(collection.id, query.search),
            options.match,
            partial(with_points, query.vector, fetch, scanned, model),
        )
        quantiles = model.windows.impostor_quantiles or quantiles
    order, shapes = _nearest(session, snapshot, rows, found, options)
    similarities = similarity(
        found[order],
        replace(model, impostor_quantiles=quantiles),
        dissimilarity=options.dissimilarity,
    )
    return Ranking(
        collection=collection.name,
        model=model.name,
        dissimilarity=options.dissimilarity or own_dissimilarity(model),
        matches=tuple(
            Match(float(found[place]), float(alike), shape)
            for place, alike, shape in zip(order, similarities, shapes, strict=True)
        ),
        searched=len(rows),
        searched_closely=n_closely,
        seconds=time.perf_counter() - started,
    )


def own_dissimilarity(model: Model) -> str:
    """Name the dissimilarities of a model's channels.

    Parameters
    ----------
    model : Model
        The model.

    Returns
    -------
    str
        Each name once, with commas between.
    """
    return ", ".join(dict.fromkeys(channel.dissimilarity for channel in model.channels))


def _candidates(
    session: Session, snapshot: Snapshot, collection: Collection, query: SearchQuery
) -> IntArray:
    """Rows that pass the filter, without the query itself or the shape that it is cut from."""
    options = query.options
    rows = snapshot.rows
    if options.filter is not None:
        rows = snapshot.rows_of(matching_shapes(session, collection.id, options.filter))
    own = query.shape_id or query.cut_from
    if own is not None and not options.include_self:
        for row in snapshot.rows_of([own]):
            rows = rows[rows != row]
    return rows


def _distances(snapshot: Snapshot, rows: IntArray, query: SearchQuery) -> FloatArray:
    """Distances of the candidates; a row's is the same whichever others are looked at."""
    model, chosen = query.search.model, query.options.dissimilarity
    if 2 * len(rows) > len(snapshot.matrix):
        all_rows = distances(query.vector, snapshot.matrix, model, dissimilarity=chosen)
        return all_rows[rows]
    parts = [
        distances(
            query.vector,
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
    found: FloatArray,
    options: SearchOptions,
) -> tuple[Sequence[int], Sequence[ShapeView]]:
    """Order of the nearest candidates and their shapes, without shapes deleted meanwhile.

    Returns
    -------
    Places in ``rows``, the nearest first, and their shapes.
    """
    ids = _PickedIds(snapshot.ids, rows)
    gone = 0
    while True:
        order = nearest(found, ids, options.limit + gone).tolist()
        if options.max_distance is not None:
            order = [place for place in order if found[place] <= options.max_distance]
        shapes = get_shapes(session, [ids[place] for place in order])
        there = [place for place in order if ids[place] in shapes]
        missing = len(order) - len(there)
        if missing <= gone or len(order) < options.limit + gone:
            there = there[: options.limit]
            return there, [shapes[ids[place]] for place in there]
        gone = missing  # look again for so many more


class _PickedIds(Sequence[str]):
    """Ids of some rows, without a list of them."""

    def __init__(self, ids: Sequence[str], rows: IntArray) -> None:
        self._ids = ids
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: Any) -> Any:
        return self._ids[self._rows[place]]
