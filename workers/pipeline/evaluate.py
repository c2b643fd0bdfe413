"""Models are measured on a collection: ranking, some queries a part, then the tables.

The same frame and the same models have the same result, in whatever order parts are done and
however often: rankings stand under keys of the frame they belong to.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import select

from workers.errors import BlobNotFoundError, CollectionNotFoundError, ConflictError
from workers.pipeline.evaluation_plan import Frame, load_frame, store_frame
from workers.pipeline.plans import evaluate_part, query_ranges, rank_parts
from workers.pipeline.workbench import Workbench
from workers.retrieval.evaluation import summarise
from workers.retrieval.protocol import LeftOut, Protocol
from workers.retrieval.ranking import Ranking, join_rankings
from workers.storage.blobs import frame_key, ranking_key
from workers.storage.descriptors import described_shapes
from workers.storage.evaluations import finish_evaluation, get_evaluation
from workers.storage.jobs import OPEN, NewPart, part_to_json
from workers.storage.models import Collection, Evaluation, Part
from workers.storage.parts import Claim, finish_part, hold_lease
from workers.storage.trained_models import load_model

NAMED = 100
"""At most so many shapes that were left out for one reason are named; all are counted."""


def evaluate(bench: Workbench, claim: Claim) -> None:
    """Have the frame ranked under every model, or put the rankings into tables if all are there.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or a model is gone meanwhile.
    ConflictError
        Something could not be described or ranked; a retry does what is missing.
    InvalidRequestError
        So many shapes are gone that nothing is left to ask.
    """
    evaluation_id, digest = claim.payload["evaluation_id"], claim.payload["frame"]
    with bench.database.read() as session:
        evaluation = get_evaluation(session, evaluation_id).row
        others = select(Part.state).where(Part.job_id == claim.job_id, Part.id != claim.part_id)
        states = set(session.scalars(others))
    if states.intersection(OPEN):  # a retry began them and this at once
        _go_on(bench, claim, evaluate_part(**claim.payload), [])
        return
    if "failed" in states:
        raise ConflictError(
            "some of its work failed, see the job's other errors, so that not all models could be "
            "measured on the same shapes; retry the job"
        )
    frame = load_frame(bench.blobs, evaluation_id, digest)
    protocol = frame.protocol
    rankings = _read_rankings(bench, evaluation, digest, len(protocol.queries))
    if rankings is None:
        _have_ranked(bench, claim, evaluation, frame)
    else:
        _store_result(bench, claim, protocol, frame.left_out, rankings)
        _forget(bench, evaluation, digest, len(protocol.queries))


def _read_rankings(
    bench: Workbench, evaluation: Evaluation, digest: str, queries: int
) -> dict[str, Ranking] | None:
    """Rankings of a frame by model, None if not all are there."""
    rankings = {}
    for number, model in enumerate(evaluation.models):
        keys = [ranking_key(evaluation.id, digest, number, i) for i, _ in query_ranges(queries)]
        try:
            parts = [Ranking.from_json(json.loads(bench.blobs.get(key))) for key in keys]
        except BlobNotFoundError:
            return None
        rankings[model] = join_rankings(parts)
    return rankings


def _have_ranked(bench: Workbench, claim: Claim, evaluation: Evaluation, frame: Frame) -> None:
    """Queue what ranks the shapes that are described under all models."""
    collection_id = claim.payload["collection_id"]
    with bench.database.read() as session:
        if session.get(Collection, collection_id) is None:
            raise CollectionNotFoundError(
                f"the collection {evaluation.collection!r} was deleted before it was evaluated"
            )
        for name in evaluation.models:
            load_model(session, name)
        described = [described_shapes(session, collection_id, m) for m in evaluation.models]
    smaller = frame.restricted_to(set.intersection(*described))
    digest = store_frame(bench.blobs, evaluation.id, smaller)
    again = evaluate_part(evaluation.id, collection_id, digest)
    ranks = rank_parts(
        again,
        evaluation.models,
        dissimilarity=evaluation.dissimilarity,
        queries=len(smaller.protocol.queries),
    )
    _go_on(bench, claim, again, ranks)
    if digest != claim.payload["frame"]:
        _forget(bench, evaluation, claim.payload["frame"], len(frame.protocol.queries))


def _go_on(bench: Workbench, claim: Claim, finale: NewPart, parts: Sequence[NewPart]) -> None:
    """End this part, and have the finale run once all others have ended."""
    with bench.database.begin() as session:
        hold_lease(session, claim).finale = part_to_json(finale)
        queued = finish_part(session, claim, follow_up=parts)
    bench.send(queued)


def _store_result(
    bench: Workbench,
    claim: Claim,
    protocol: Protocol,
    left_out: Sequence[LeftOut],
    rankings: Mapping[str, Ranking],
) -> None:
    """Put the rankings into tables and end the job."""
    result = {
        "n_queries": len(protocol.queries),
        "n_targets": len(protocol.targets),
        "leave_one_out": protocol.leave_one_out,
        **summarise(protocol, rankings).to_json(),
        "skipped": _grouped([*left_out, *protocol.left_out]),
    }
    ranks = [
        {"query": protocol.shapes[query].id, "model": model, "rank": one.rank, "top": list(one.top)}
        for place, query in enumerate(protocol.queries.tolist())
        for model, one in ((m, ranking.outcomes[place]) for m, ranking in rankings.items())
    ]
    with bench.database.begin() as session:
        hold_lease(session, claim)
        finish_evaluation(session, claim.payload["evaluation_id"], result=result, ranks=ranks)
        parts = finish_part(session, claim)
    bench.send(parts)


def _grouped(left_out: Sequence[LeftOut]) -> list[dict[str, Any]]:
    """Shapes that were not asked with, by reason."""
    by_reason: dict[str, list[LeftOut]] = {}
    for one in left_out:
        by_reason.setdefault(one.reason, []).append(one)
    return [
        {
            "reason": reason,
            "count": len(group),
            "shapes": [{"id": one.id, "name": one.name} for one in group[:NAMED]],
        }
        for reason, group in sorted(by_reason.items())
    ]


def _forget(bench: Workbench, evaluation: Evaluation, digest: str, queries: int) -> None:
    """Delete what was stored of a frame; after a crash it stays, and harms nothing."""
    for number in range(len(evaluation.models)):
        for start, _ in query_ranges(queries):
            bench.blobs.delete(ranking_key(evaluation.id, digest, number, start))
    bench.blobs.delete(frame_key(evaluation.id, digest))
