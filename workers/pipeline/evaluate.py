"""Models are measured on a collection: ranking, some queries a part, then the tables.

The same frame and the same models have the same result, in any order of the parts, and however
often they are done: a ranking has a key of the frame that it belongs to.
"""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from workers.errors import BlobNotFoundError, CollectionNotFoundError, ConflictError
from workers.pipeline.evaluation_plan import Frame, load_frame, store_frame
from workers.pipeline.outcome import Outcome
from workers.pipeline.part_kinds import QUERIES_A_PART, evaluate_part, query_ranges, rank_parts
from workers.pipeline.progress import MEASURING
from workers.pipeline.workbench import Workbench
from workers.retrieval.evaluation import summarise
from workers.retrieval.protocol import LeftOut
from workers.retrieval.ranking import Ranking, join_rankings
from workers.storage.blobs import frame_key, ranking_key
from workers.storage.descriptors import described_shapes
from workers.storage.evaluations import finish_evaluation, get_evaluation
from workers.storage.jobs import OPEN
from workers.storage.models import Collection, Evaluation, Job, Json, Part
from workers.storage.parts import Claim
from workers.storage.trained_models import load_model

NAMED = 100
"""At most so many shapes that were left out for one reason are named; all are counted."""


def evaluate(bench: Workbench, claim: Claim, *, queries_a_part: int = QUERIES_A_PART) -> Outcome:
    """Have the frame ranked under every model, or put the rankings into tables if all are there.

    Parameters
    ----------
    bench : Workbench
        Rows, blobs and settings.
    claim : Claim
        Its payload names the evaluation, the collection and the frame.
    queries_a_part : int
        At most so many queries are ranked in one part.

    Returns
    -------
    Outcome
        Stores the result; or queues what ranks, and this again as the finale.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or a model is gone meanwhile.
    ConflictError
        Something could not be described or ranked; a retry does what is missing.
    InvalidRequestError
        So many shapes are gone that no query is left.
    """
    evaluation_id, digest = claim.payload["evaluation_id"], claim.payload["frame"]
    bench.progress.enter(MEASURING)
    with bench.database.read() as session:
        evaluation = get_evaluation(session, evaluation_id).row
        others = select(Part.state).where(Part.job_id == claim.job_id, Part.id != claim.part_id)
        states = set(session.scalars(others))
    if states.intersection(OPEN):  # a retry queued them and this at once
        return Outcome(finale=evaluate_part(**claim.payload))
    if "failed" in states:
        raise ConflictError(
            "some of its work failed, see the job's other errors, so that not all models could be "
            "measured on the same shapes; retry the job"
        )
    frame = load_frame(bench.blobs, evaluation_id, digest)
    keys = _ranking_keys(evaluation, digest, len(frame.protocol.queries), queries_a_part)
    rankings = _read_rankings(bench, keys)
    stored = [frame_key(evaluation_id, digest), *(key for some in keys.values() for key in some)]
    if rankings is None:
        return _have_ranked(bench, claim, evaluation, frame, stored, queries_a_part)
    result, ranks = _tables(frame, rankings)
    return Outcome(store=partial(_store, evaluation_id, result, ranks), obsolete=stored)


def _store(
    evaluation_id: str, result: Json, ranks: list[Json], session: Session, _job: Job
) -> None:
    finish_evaluation(session, evaluation_id, result=result, ranks=ranks)


def _ranking_keys(
    evaluation: Evaluation, digest: str, queries: int, queries_a_part: int
) -> dict[str, list[str]]:
    """Keys of a frame's rankings by model, in the order of the queries."""
    starts = [start for start, _ in query_ranges(queries, queries_a_part)]
    return {
        model: [ranking_key(evaluation.id, digest, number, start) for start in starts]
        for number, model in enumerate(evaluation.models)
    }


def _read_rankings(
    bench: Workbench, keys: Mapping[str, Sequence[str]]
) -> dict[str, Ranking] | None:
    """Rankings of a frame by model, None if not all are there."""
    rankings = {}
    for model, its_keys in keys.items():
        try:
            parts = [Ranking.from_json(json.loads(bench.blobs.get(key))) for key in its_keys]
        except BlobNotFoundError:
            return None
        rankings[model] = join_rankings(parts)
    return rankings


def _have_ranked(
    bench: Workbench,
    claim: Claim,
    evaluation: Evaluation,
    frame: Frame,
    stored: Sequence[str],
    queries_a_part: int,
) -> Outcome:
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
        queries_a_part=queries_a_part,
    )
    unchanged = digest == claim.payload["frame"]
    return Outcome(follow_up=ranks, finale=again, obsolete=() if unchanged else stored)


def _tables(frame: Frame, rankings: Mapping[str, Ranking]) -> tuple[Json, list[Json]]:
    """Put rankings into tables, and list the rank of each query under each model."""
    protocol = frame.protocol
    result = {
        "n_queries": len(protocol.queries),
        "n_targets": len(protocol.targets),
        "leave_one_out": protocol.leave_one_out,
        **summarise(protocol, rankings).to_json(),
        "skipped": _grouped([*frame.left_out, *protocol.left_out]),
    }
    ranks = [
        {"query": protocol.shapes[query].id, "model": model, "rank": one.rank, "top": list(one.top)}
        for place, query in enumerate(protocol.queries.tolist())
        for model, one in ((m, ranking.outcomes[place]) for m, ranking in rankings.items())
    ]
    return result, ranks


def _grouped(left_out: Sequence[LeftOut]) -> list[dict[str, Any]]:
    """Shapes that were no queries, by reason."""
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
