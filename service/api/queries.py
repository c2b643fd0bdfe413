"""Questions: by a stored shape, by a mesh, in batches."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse
from sqlalchemy.orm import Session

from service.api.answers import tell_of_job
from service.dependencies import (
    CollectionPath,
    QueryPath,
    Services,
    ServicesDep,
    UploadFolder,
    Wait,
)
from service.errors import failed_work
from service.forms import read_fields
from service.multipart import FormLimits, ReceivedFile, ReceivedForm, receive_form
from service.openapi import LOCATION, form_fields, job_answers, multipart_body, problems
from service.query_rows import (
    MeshQuestion,
    find_question,
    find_vector,
    store_answered,
    store_question,
)
from service.received_blobs import keep_received, store_received
from service.schemas.jobs import answer_job
from service.schemas.queries import (
    AskedWith,
    BatchQuery,
    BatchResult,
    MeshQueryForm,
    QueryAccepted,
    QueryResult,
    ShapeQuery,
)
from service.search.indexes import load_search_model
from service.search.ranking import Question, answer_question, choose_model, shape_vector
from service.security import READS
from service.waiting import hold_on
from workers.errors import InvalidMeshError, InvalidRequestError, ModelNotReadyError, ProteusError
from workers.geometry.formats.naming import read_name
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import mesh_key
from workers.storage.collections import get_collection
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Collection
from workers.storage.queries import get_query, keep_query, needs_keeping

WAIT_SECONDS = 30
TEXT_FIELDS = frozenset(MeshQueryForm.model_fields)
FORM = {
    "mesh": {
        "type": "string",
        "format": "binary",
        "description": "OFF, OBJ, PLY, STL, GLB, glTF or 3MF; the content decides",
    },
    **form_fields(MeshQueryForm),
}
router = APIRouter(prefix="/v1", tags=["search"])


@router.post(
    "/collections/{collection}/query",
    summary="Ask with a stored shape",
    dependencies=[READS],
    responses=problems(404, 409, 413, 415, 422),
)
def query_by_shape(
    collection: CollectionPath, body: ShapeQuery, services: ServicesDep
) -> QueryResult:
    """Rank the collection's shapes by their distance from a stored shape."""
    with services.database.read() as session:
        return _ask(session, services, get_collection(session, collection), body)


@router.post(
    "/collections/{collection}/query/batch",
    summary="Ask up to a hundred questions",
    dependencies=[READS],
    responses=problems(404, 409, 413, 415, 422),
)
def query_batch(collection: CollectionPath, body: BatchQuery, services: ServicesDep) -> BatchResult:
    """Answer several questions; if one of them cannot be answered, none is."""
    results = []
    with services.database.read() as session:
        row = get_collection(session, collection)
        for position, query in enumerate(body.queries):
            try:
                results.append(_ask(session, services, row, query))
            except ProteusError as error:
                error.locate(f"queries.{position}")
                raise
    return BatchResult(results=results)


async def _receive(
    collection: CollectionPath, services: ServicesDep, folder: UploadFolder, request: Request
) -> ReceivedForm:
    limits = FormLimits(
        file_fields=frozenset({"mesh"}),
        text_fields=TEXT_FIELDS,
        max_files=1,
        max_file_bytes=services.settings.max_upload_bytes,
    )
    return await receive_form(request, folder, limits)


@router.post(
    "/collections/{collection}/query/mesh",
    summary="Ask with a mesh",
    dependencies=[READS],
    response_model=QueryResult,
    responses=job_answers(
        accepted=QueryAccepted, result=QueryResult, headers={"Location": LOCATION}
    )
    | problems(404, 409, 413, 415, 422),
    openapi_extra=multipart_body(FORM, required="mesh"),
)
async def query_by_mesh(
    collection: CollectionPath,
    services: ServicesDep,
    form: Annotated[ReceivedForm, Depends(_receive)],
    response: Response,
    wait: Wait = WAIT_SECONDS,
) -> QueryResult | Response:
    """Describe a mesh, then rank the collection's shapes by their distance from it.

    A mesh that was asked with or uploaded before is answered at once. The mesh is not added to the
    collection. The question is kept: `Location` is where it is answered anew.
    """
    query_id, answer = await run_in_threadpool(_accept_mesh, services, collection, form)
    response.headers["Location"] = _place(query_id)
    return answer or await _answer_when_described(services, query_id, wait)


@router.get(
    "/queries/{query_id}",
    summary="Fetch the answer of a question",
    dependencies=[READS],
    response_model=QueryResult,
    responses=job_answers(accepted=QueryAccepted, result=QueryResult)
    | problems(404, 409, 413, 415, 422),
)
async def show(
    query_id: QueryPath, services: ServicesDep, wait: Wait = 0
) -> QueryResult | Response:
    """Rank anew, against the collection as it is now; 202 while the mesh is being described.

    If the mesh could not be described, the answer is the problem that it has.
    """
    return await _answer_when_described(services, query_id, wait)


def _ask(
    session: Session, services: Services, collection: Collection, query: ShapeQuery
) -> QueryResult:
    search = choose_model(session, collection, query)
    vector = shape_vector(session, query.shape_id, search.model.name)
    question = Question(vector, AskedWith(shape_id=query.shape_id), query, search)
    return answer_question(session, services.indexes, collection, question)


def _accept_mesh(
    services: Services, name: str, form: ReceivedForm
) -> tuple[str, QueryResult | None]:
    """Check, answer what is known, else blob, rows, commit, dispatch.

    Returns
    -------
    The question's id, and its answer if the mesh is described already.
    """
    options = read_fields(MeshQueryForm, form.fields, as_json=frozenset({"filter"}))
    if not form.files:
        raise InvalidRequestError("the form has no mesh, expected a file named 'mesh'")
    (file,) = form.files
    if not file.size:
        raise InvalidMeshError("the mesh is an empty file")
    with services.database.read() as session:
        collection = get_collection(session, name)
        search = choose_model(session, collection, options)
        asked = MeshQuestion(file.sha256, search.model.name, options)
        known = find_vector(session, asked.sha256, asked.model)
        if known is not None:
            query_id = find_question(session, collection.id, asked)
            question = Question(
                vector_from_bytes(known), AskedWith(sha256=asked.sha256), options, search
            )
            answer = answer_question(session, services.indexes, collection, question)
    if known is not None:
        return _keep(services, query_id) or _remember(services, name, asked, file, known), answer
    files = {mesh_key(asked.sha256): file.path}
    store_received(services.blobs, files)
    with services.database.begin() as session:
        query_id, parts = store_question(
            session,
            get_collection(session, name),
            asked,
            file_name=read_name(file.name).name,
        )
        keep_received(session, services.blobs, files)
    services.dispatcher.send(parts)
    return query_id, None


def _remember(
    services: Services, name: str, asked: MeshQuestion, file: ReceivedFile, known: bytes
) -> str:
    """Store a question that was answered at once, so that its answer can be linked to."""
    files = {mesh_key(asked.sha256): file.path}
    if not services.blobs.exists(mesh_key(asked.sha256)):
        store_received(services.blobs, files)
    with services.database.begin() as session:
        query_id = store_answered(session, get_collection(session, name), asked, known)
        keep_received(session, services.blobs, files)
    return query_id


def _keep(services: Services, query_id: str | None) -> str | None:
    """Return the id of a question that is asked again, if it is still there; it is kept anew."""
    if query_id is None:
        return None
    with services.database.read() as session:
        if not needs_keeping(session, query_id):
            return query_id
    with services.database.begin() as session:
        return query_id if keep_query(session, query_id) else None


async def _answer_when_described(
    services: Services, query_id: str, wait: float
) -> QueryResult | Response:
    job_id = await run_in_threadpool(_job_of_query, services, query_id)
    if job_id is not None:
        await hold_on(services.database, job_id, wait)
    return await run_in_threadpool(_answer_query, services, query_id)


def _job_of_query(services: Services, query_id: str) -> str | None:
    with services.database.read() as session:
        return get_query(session, query_id).job_id


def _answer_query(services: Services, query_id: str) -> QueryResult | Response:
    """Answer a stored question: the ranking, the job it waits for, or the problem it has."""
    with services.database.read() as session:
        query = get_query(session, query_id)
        job = None if query.job_id is None else get_job(session, query.job_id)
        known = find_vector(session, query.sha256, query.model)
        if known is not None:
            collection = session.get_one(Collection, query.collection_id)
            question = Question(
                vector_from_bytes(known),
                AskedWith(sha256=query.sha256),
                MeshQueryForm.model_validate(query.parameters),
                load_search_model(session, query.model),
            )
            return answer_question(session, services.indexes, collection, question)
    if job is None or job.state == "succeeded":
        raise ModelNotReadyError(f"the mesh is not described under {query.model!r} any more")
    if job.state in ENDED:
        raise failed_work(job.errors)
    accepted = QueryAccepted(job=answer_job(job), query_id=query_id)
    response = JSONResponse(accepted.model_dump(mode="json"), 202)
    tell_of_job(response, job)
    response.headers["Location"] = _place(query_id)
    return response


def _place(query_id: str) -> str:
    return f"/v1/queries/{query_id}"
