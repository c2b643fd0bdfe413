"""What an evaluation compares, fixed when it is asked for; and the job that does it."""

import hashlib
import json
from collections.abc import Set as Members
from dataclasses import astuple, dataclass

from sqlalchemy.orm import Session

from workers.errors import ShapeNotReadyError
from workers.pipeline.part_kinds import describe_parts, evaluate_part
from workers.retrieval.protocol import EvaluatedShape, LeftOut, Protocol, make_protocol
from workers.storage.blobs import BlobStore, frame_key
from workers.storage.collections import get_collection
from workers.storage.descriptors import undescribed_shapes
from workers.storage.evaluations import create_evaluation, group_shapes
from workers.storage.jobs import create_job
from workers.storage.models import Evaluation, Job, Part
from workers.storage.trained_models import load_model

FAILED = "failed"
NOT_DESCRIBED = "not-described"


@dataclass(frozen=True)
class EvaluationRequest:
    """Models to be measured on a collection, with what instead of their own dissimilarities."""

    collection: str
    models: tuple[str, ...]
    dissimilarity: str | None = None


@dataclass(frozen=True)
class Frame:
    """The shapes that are compared, as they were called when the evaluation was asked for.

    Shapes that come later, or get another label, change nothing of it.
    """

    shapes: tuple[EvaluatedShape, ...]
    left_out: tuple[LeftOut, ...]

    @property
    def protocol(self) -> Protocol:
        """Queries and targets; InvalidRequestError without any."""
        return make_protocol(self.shapes)

    def restricted_to(self, ids: Members[str]) -> "Frame":
        """Leave out the shapes that cannot be compared under every model.

        Parameters
        ----------
        ids : set of str
            Of the shapes that stay.

        Returns
        -------
        Frame
            The others are named as left out.
        """
        gone = [s for s in self.shapes if s.id not in ids]
        return Frame(
            tuple(shape for shape in self.shapes if shape.id in ids),
            self.left_out + tuple(LeftOut(s.id, s.name, NOT_DESCRIBED) for s in gone),
        )


def frame_to_evaluate(session: Session, request: EvaluationRequest) -> Frame:
    """Return what is to be compared, once it is certain that it can be.

    Parameters
    ----------
    session : Session
        An open transaction.
    request : EvaluationRequest
        What the client asks for.

    Returns
    -------
    Frame
        All shapes of the collection, with what they are called now.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or a model does not exist, or the model is not trained yet.
    ShapeNotReadyError
        Shapes are still being computed.
    InvalidRequestError
        The dissimilarity is unknown or compares nothing that a model has, or there is no query
        with a target to be found.
    """
    collection = get_collection(session, request.collection)
    for name in request.models:
        model = load_model(session, name)
        if request.dissimilarity:
            model.check_dissimilarity(request.dissimilarity)
    grouped = group_shapes(session, collection)
    if grouped.unfinished or grouped.unpacking:
        raise ShapeNotReadyError(
            f"{grouped.unfinished} shapes of collection {collection.name!r} are still being "
            f"computed and {grouped.unpacking} archives unpacked, expected none; evaluate when "
            "their jobs have ended"
        )
    failed = tuple(LeftOut(shape.id, shape.name, FAILED) for shape in grouped.failed)
    frame = Frame(grouped.ready, failed)
    make_protocol(frame.shapes)
    return frame


def store_frame(blobs: BlobStore, evaluation_id: str, frame: Frame) -> str:
    """Store a frame under its own digest.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    evaluation_id : str
        Id of the evaluation that compares these shapes.
    frame : Frame
        What is compared.

    Returns
    -------
    str
        The digest, 32 hexadecimal digits.
    """
    document = {
        "shapes": [astuple(shape) for shape in frame.shapes],
        "left_out": [astuple(one) for one in frame.left_out],
    }
    data = json.dumps(document).encode()
    digest = hashlib.sha256(data).hexdigest()[:32]
    blobs.put(frame_key(evaluation_id, digest), data)
    return digest


def load_frame(blobs: BlobStore, evaluation_id: str, digest: str) -> Frame:
    """Return a stored frame.

    Parameters
    ----------
    blobs : BlobStore
        All stored bytes.
    evaluation_id : str
        Id of the evaluation that compares these shapes.
    digest : str
        What `store_frame` returned.

    Returns
    -------
    Frame
        What is compared.

    Raises
    ------
    BlobNotFoundError
        No frame is stored under this digest.
    """
    document = json.loads(blobs.get(frame_key(evaluation_id, digest)))
    return Frame(
        tuple(EvaluatedShape(*facts) for facts in document["shapes"]),
        tuple(LeftOut(*facts) for facts in document["left_out"]),
    )


def plan_evaluation(
    session: Session, request: EvaluationRequest, *, evaluation_id: str, frame: str
) -> tuple[Evaluation, Job, list[Part]]:
    """Make the evaluation and the job that describes shapes where need be, then ranks.

    The collection does not follow the models: uploads are not described under them, and it is
    searched as before.

    Parameters
    ----------
    session : Session
        An open transaction.
    request : EvaluationRequest
        What the client asks for.
    evaluation_id : str
        Of its row, which the caller draws.
    frame : str
        Digest of what is to be compared, stored already.

    Returns
    -------
    (Evaluation, Job, list of Part)
        The rows; the parts are to be sent after the commit.

    Raises
    ------
    CollectionNotFoundError, ModelNotFoundError, ModelNotReadyError
        The collection or a model is gone meanwhile.
    """
    collection = get_collection(session, request.collection)
    parts = []
    for name in request.models:
        load_model(session, name)
        undescribed = undescribed_shapes(session, collection, name, with_failed=True)
        parts += describe_parts(undescribed, name, marks_shapes=False)
    job, rows = create_job(
        session,
        kind="evaluate",
        unit="shapes",
        parts=parts,
        collection=collection.name,
        finale=evaluate_part(evaluation_id, collection.id, frame),
    )
    evaluation = create_evaluation(
        session,
        evaluation_id=evaluation_id,
        job_id=job.id,
        collection=collection.name,
        models=request.models,
        dissimilarity=request.dissimilarity,
    )
    return evaluation, job, rows
