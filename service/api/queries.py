"""Queries: by a stored shape, by a mesh, in batches."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse
from sqlalchemy.orm import Session

from service.api.answers import describe_job
from service.dependencies import (
    CollectionPath,
    QueryPath,
    Services,
    ServicesDep,
    UploadFolder,
    Wait,
)
from service.forms import read_fields
from service.multipart import FormLimits, ReceivedForm, receive_form
from service.openapi import LOCATION, form_fields, job_answers, multipart_body, problems
from service.received_blobs import Contents, keep_received, store_received
from service.regions import cut_stored
from service.schemas.jobs import answer_job
from service.schemas.queries import (
    AskedWith,
    BatchQuery,
    BatchResult,
    MeshQueryForm,
    QueryAccepted,
    QueryOptions,
    QueryResult,
    Region,
    RegionQuery,
    ShapeQuery,
    StoredQuery,
    answer_ranking,
)
from service.search.indexes import SearchModel, load_search_model
from service.search.queries import SearchQuery
from service.search.ranking import choose_model, rank_shapes
from service.security import READS
from service.waiting import hold_on
from workers.errors import (
    FailedWorkError,
    InvalidMeshError,
    InvalidRequestError,
    ModelNotReadyError,
    ProteusError,
)
from workers.geometry.formats.naming import read_name
from workers.pipeline.query_plan import (
    MeshQuery,
    find_same_query,
    store_described_query,
    store_query,
)
from workers.pipeline.windows import signature_of_query
from workers.retrieval.windows.signature import Signature
from workers.storage.arrays import vector_from_bytes
from workers.storage.blobs import mesh_key
from workers.storage.collections import get_collection
from workers.storage.jobs import ENDED, get_job
from workers.storage.models import Collection, Json
from workers.storage.queries import get_query, keep_query, needs_keeping
from workers.storage.shapes import get_shape
from workers.storage.stored_meshes import mesh_of_shape
from workers.storage.vectors import find_vector, shape_vector

WAIT_SECONDS = 30
TEXT_FIELDS = frozenset(MeshQueryForm.model_fields)
FORM = {
    "mesh": {
        "type": "string",
        "format": "binary",
        "description": "in any format that is read, or an archive of one mesh; the content decides",
    },
    **form_fields(MeshQueryForm),
}
router = APIRouter(prefix="/v1", tags=["search"])


@router.post(
    "/collections/{collection}/query",
    summary="Query by a stored shape",
    dependencies=[READS],
    response_model=QueryResult,
    responses=job_answers(
        accepted=QueryAccepted, result=QueryResult, headers={"Location": LOCATION}
    )
    | problems(404, 409, 413, 415, 422),
)
async def query_by_shape(
    collection: CollectionPath,
    body: RegionQuery,
    services: ServicesDep,
    response: Response,
    wait: Wait = WAIT_SECONDS,
) -> QueryResult | Response:
    """Rank the collection's shapes by their distance from a stored shape, or a region of it.

    A stored shape is answered at once. A region is cut out and becomes a query by mesh: if it is
    not described yet, a job does that. Such a query is kept, and `Location` is where it is answered
    anew.
    """
    if body.region is None:
        return await run_in_threadpool(_answer_shape, services, collection, body)
    accepted = await run_in_threadpool(_accept_region, services, collection, body, body.region)
    query_id, answer = accepted
    response.headers["Location"] = _place(query_id)
    return answer or await _answer_when_described(services, query_id, wait)


@router.post(
    "/collections/{collection}/query/batch",
    summary="Run up to a hundred queries",
    dependencies=[READS],
    responses=problems(404, 409, 413, 415, 422),
)
def query_batch(collection: CollectionPath, body: BatchQuery, services: ServicesDep) -> BatchResult:
    """Answer several queries; if one of them cannot be answered, none is."""
    results = []
    with services.database.read() as session:
        row = get_collection(session, collection)
        for position, query in enumerate(body.queries):
            try:
                results.append(_rank(session, services, row, query))
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
    summary="Query by a mesh",
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

    A mesh that was queried or uploaded before is answered at once. The mesh is not added to the
    collection. The query is kept: `Location` is where it is answered anew.
    """
    query_id, answer = await run_in_threadpool(_accept_mesh, services, collection, form)
    response.headers["Location"] = _place(query_id)
    return answer or await _answer_when_described(services, query_id, wait)


@router.get(
    "/queries/{query_id}",
    summary="Fetch the answer of a query",
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


def _answer_shape(services: Services, name: str, query: ShapeQuery) -> QueryResult:
    with services.database.read() as session:
        return _rank(session, services, get_collection(session, name), query)


def _rank(
    session: Session, services: Services, collection: Collection, query: ShapeQuery
) -> QueryResult:
    options = query.to_value()
    search = choose_model(session, collection, options)
    vector = shape_vector(session, query.shape_id, search.model.name)
    sha256 = get_shape(session, query.shape_id).row.sha256
    signature = _signature(services, search, sha256)
    wanted = SearchQuery(vector, search, options, query.shape_id, signature)
    ranking = rank_shapes(session, services.indexes, collection, wanted)
    return answer_ranking(ranking, AskedWith(shape_id=query.shape_id))


def _signature(services: Services, search: SearchModel, sha256: str) -> Signature | None:
    """Windows of a query, where the model compares them; computed at the first question."""
    windows = search.model.windows
    return None if windows is None else signature_of_query(services.blobs, sha256, windows)


def _rank_stored(
    session: Session,
    services: Services,
    collection: Collection,
    query: MeshQuery,
    known: tuple[bytes, SearchModel],
) -> QueryResult:
    """Rank for a mesh whose descriptor is known, by the parameters that are stored of its query."""
    stored = StoredQuery.model_validate(query.parameters)
    vector, search = vector_from_bytes(known[0]), known[1]
    signature = _signature(services, search, query.sha256)
    wanted = SearchQuery(
        vector, search, stored.to_value(), signature=signature, cut_from=stored.shape_id
    )
    ranking = rank_shapes(session, services.indexes, collection, wanted)
    asked = AskedWith(shape_id=stored.shape_id, sha256=query.sha256, region=stored.region)
    return answer_ranking(ranking, asked)


@dataclass(frozen=True)
class _SentMesh:
    """A mesh to query with: its hash, its file's name, and what is to be stored of it."""

    sha256: str
    name: str
    files: Contents


def _accept_region(
    services: Services, name: str, query: RegionQuery, region: Region
) -> tuple[str, QueryResult | None]:
    """Cut the region out, then go on as with a mesh that was sent."""
    with services.database.read() as session:
        choose_model(session, get_collection(session, name), query.to_value())  # before the work
        stored = mesh_of_shape(session, query.shape_id)
    cut = cut_stored(services.blobs, stored, region)
    files = {} if cut.content is None else {mesh_key(cut.sha256): cut.content}
    mesh = _SentMesh(cut.sha256, cut.name, files)
    return _accept(services, name, query, query.to_parameters(cut.found), mesh)


def _accept_mesh(
    services: Services, name: str, form: ReceivedForm
) -> tuple[str, QueryResult | None]:
    """Check the form, then accept its mesh."""
    fields = read_fields(MeshQueryForm, form.fields, as_json=frozenset({"filter"}))
    if not form.files:
        raise InvalidRequestError("the form has no mesh, expected a file named 'mesh'")
    (file,) = form.files
    if not file.size:
        raise InvalidMeshError("the mesh is an empty file")
    mesh = _SentMesh(file.sha256, read_name(file.name).name, {mesh_key(file.sha256): file.path})
    return _accept(services, name, fields, fields.to_parameters(), mesh)


def _accept(
    services: Services, name: str, options: QueryOptions, parameters: Json, mesh: _SentMesh
) -> tuple[str, QueryResult | None]:
    """Answer what is known, else blob, rows, commit, dispatch.

    Returns
    -------
    The query's id, and its answer if the mesh is described already.
    """
    with services.database.read() as session:
        collection = get_collection(session, name)
        search = choose_model(session, collection, options.to_value())
        query = MeshQuery(mesh.sha256, search.model.name, parameters)
        known = find_vector(session, query.sha256, query.model)
        if known is not None:
            query_id = find_same_query(session, collection.id, query)
            answer = _rank_stored(session, services, collection, query, (known, search))
    if known is not None:
        return _keep(services, query_id) or _remember(services, name, query, mesh, known), answer
    store_received(services.blobs, mesh.files)
    with services.database.begin() as session:
        query_id, parts = store_query(
            session, get_collection(session, name), query, file_name=mesh.name
        )
        keep_received(session, services.blobs, mesh.files)
    services.dispatcher.send(parts)
    return query_id, None


def _remember(
    services: Services, name: str, query: MeshQuery, mesh: _SentMesh, known: bytes
) -> str:
    """Store a query that was answered at once, so that its answer can be linked to."""
    if not services.blobs.exists(mesh_key(query.sha256)):
        store_received(services.blobs, mesh.files)
    with services.database.begin() as session:
        query_id = store_described_query(session, get_collection(session, name), query, known)
        keep_received(session, services.blobs, mesh.files)
    return query_id


def _keep(services: Services, query_id: str | None) -> str | None:
    """Return the id of a query that was stored before, if it is still there; it is kept anew."""
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
    """Answer a stored query: the ranking, the job it waits for, or the problem it has."""
    with services.database.read() as session:
        query = get_query(session, query_id)
        job = None if query.job_id is None else get_job(session, query.job_id)
        known = find_vector(session, query.sha256, query.model)
        if known is not None:
            collection = session.get_one(Collection, query.collection_id)
            search = load_search_model(session, query.model)
            same = MeshQuery(query.sha256, query.model, query.parameters)
            return _rank_stored(session, services, collection, same, (known, search))
    if job is None or job.state == "succeeded":
        raise ModelNotReadyError(f"the mesh is not described under {query.model!r} any more")
    if job.state in ENDED:
        raise FailedWorkError.of(job.errors)
    accepted = QueryAccepted(job=answer_job(job), query_id=query_id)
    response = JSONResponse(accepted.model_dump(mode="json"), 202)
    describe_job(response, job)
    response.headers["Location"] = _place(query_id)
    return response


def _place(query_id: str) -> str:
    return f"/v1/queries/{query_id}"
