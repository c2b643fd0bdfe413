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
from service.multipart import FormLimits, ReceivedForm, receive_form
from service.openapi import job_answers, multipart_body, problems
from service.query_rows import find_vector, store_question
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
from workers.pipeline.naming import read_name
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import mesh_key
from workers.storage.collections import get_collection
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Collection
from workers.storage.queries import get_query

WAIT_SECONDS = 30
TEXT_FIELDS = frozenset(MeshQueryForm.model_fields)
FORM = {
    "mesh": {
        "type": "string",
        "format": "binary",
        "description": "OFF, OBJ, PLY, STL, GLB, glTF or 3MF; the content decides",
    },
    **{
        name: {"type": "string", "description": f"as in the query by shape: {name}"}
        for name in sorted(TEXT_FIELDS)
    },
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
                raise type(error)(f"queries.{position}: {error}") from None
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
    responses=job_answers(accepted=QueryAccepted, result=QueryResult)
    | problems(404, 409, 413, 415, 422),
    openapi_extra=multipart_body(FORM, required="mesh"),
)
async def query_by_mesh(
    collection: CollectionPath,
    services: ServicesDep,
    form: Annotated[ReceivedForm, Depends(_receive)],
    wait: Wait = WAIT_SECONDS,
) -> QueryResult | Response:
    """Describe a mesh, then rank the collection's shapes by their distance from it.

    A mesh that was asked with or uploaded before is answered at once. The mesh is not added to the
    collection.
    """
    asked = await run_in_threadpool(_accept_mesh, services, collection, form)
    if isinstance(asked, QueryResult):
        return asked
    return await _answer_when_described(services, asked, wait)


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


def _accept_mesh(services: Services, name: str, form: ReceivedForm) -> QueryResult | str:
    """Check, answer what is known, else blob, rows, commit, dispatch; returns the query's id."""
    options = read_fields(MeshQueryForm, form.fields, as_json=frozenset({"filter"}))
    if not form.files:
        raise InvalidRequestError("the form has no mesh, expected a file named 'mesh'")
    (file,) = form.files
    if not file.size:
        raise InvalidMeshError("the mesh is an empty file")
    with services.database.read() as session:
        collection = get_collection(session, name)
        search = choose_model(session, collection, options)
        known = find_vector(session, file.sha256, search.model.name)
        if known is not None:
            vector = vector_from_bytes(known)
            question = Question(vector, AskedWith(sha256=file.sha256), options, search)
            return answer_question(session, services.indexes, collection, question)
    services.blobs.put_file(mesh_key(file.sha256), file.path)
    with services.database.begin() as session:
        query_id, parts = store_question(
            session,
            get_collection(session, name),
            sha256=file.sha256,
            file_name=read_name(file.name).name,
            model=search.model.name,
            options=options,
        )
    services.dispatcher.send(parts)
    return query_id


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
    response.headers["Location"] = f"/v1/queries/{query_id}"
    return response
