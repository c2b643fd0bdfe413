"""Which point of a stored shape, or of a query, is which point of another stored shape."""

from dataclasses import dataclass
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse

from service.api.answers import describe_job, file_response, is_known, not_modified
from service.api.surfaces import BYTES, KNOWN, MeshDep, find_query, find_shape
from service.dependencies import ID, Services, ServicesDep, Wait
from service.openapi import ETAG, job_answers, problems
from service.schemas.correspondences import CorrespondenceAnswer, correspondence_json
from service.schemas.jobs import JobAccepted, answer_job
from service.schemas.text import Text
from service.security import READS
from service.waiting import hold_on
from workers.errors import BlobNotFoundError, FailedWorkError, ShapeNotFoundError
from workers.pipeline.correspondence_plan import find_job, store_job
from workers.storage.blobs import cleaned_key
from workers.storage.correspondences import key_of, load_correspondence
from workers.storage.models import Job
from workers.storage.stored_meshes import StoredMesh, mesh_of_shape

CorrespondenceFormat = Literal["json", "npz"]
Other = Annotated[
    Text, Query(max_length=64, description="id of the second shape, of any collection")
]
RESPONSES = job_answers(accepted=JobAccepted, result=CorrespondenceAnswer) | {
    **KNOWN,
    **problems(404, 409, 415, 422),
}
RESPONSES[200] |= {
    "content": {BYTES: {"schema": {"type": "string", "format": "binary"}}},
    "headers": {"ETag": ETAG},
    "description": "the correspondence",
}
of_both = APIRouter()


@dataclass(frozen=True)
class _Pair:
    """Two meshes, and where their correspondence is, or will be."""

    first: StoredMesh
    second: StoredMesh
    key: str

    @property
    def tag(self) -> str:
        """Says what the key says: meshes and versions."""
        return f'"{self.key.rpartition("/")[2].removesuffix(".npz")}"'


@of_both.get(
    "/correspondence",
    summary="Match points with another shape",
    response_class=Response,
    responses=RESPONSES,
)
async def correspondence(
    stored: MeshDep,
    shape: Other,
    services: ServicesDep,
    request: Request,
    form: Annotated[CorrespondenceFormat, Query(alias="format")] = "json",
    wait: Wait = 0,
) -> Response:
    """Find a point of the second shape for each vertex of the first, with stretch and bending.

    Vertices and faces are those of `/mesh?format=glb`. The result is kept; the first request makes
    a job and answers 202, unless the job ends within `wait`. With `format=npz` there are the arrays
    `faces`, `barycentric`, `confidence`, `stretch`, `bending`, `scale`, `coverage`, `mirrored` (-1
    for null), and `covered`: for each vertex of the second shape whether it has a counterpart.
    """
    pair = await run_in_threadpool(_pair, services, stored, shape)
    job = await run_in_threadpool(_begin, services, pair)
    if job is not None:
        job = await hold_on(services.database, job.id, wait)
    return await run_in_threadpool(_answer, services, request, pair, job, form)


def _pair(services: Services, first: StoredMesh, other: str) -> _Pair:
    """Find both meshes; 404 and 409 are said before any work begins."""
    if not ID.fullmatch(other):
        raise ShapeNotFoundError(f"there is no shape {other!r}")
    with services.database.read() as session:
        second = mesh_of_shape(session, other)
    working = services.settings.working_vertices
    return _Pair(first, second, key_of(first.sha256, second.sha256, working_vertices=working))


def _begin(services: Services, pair: _Pair) -> Job | None:
    """Return the job to wait for; None if the result is there."""
    if services.blobs.exists(pair.key):
        return None
    for stored in (pair.first, pair.second):
        if not services.blobs.exists(cleaned_key(stored.sha256)):
            raise stored.absence
    hashes = pair.first.sha256, pair.second.sha256
    with services.database.read() as session:
        job = find_job(session, *hashes)
    if job is not None:
        return job
    with services.database.begin() as session:
        job, parts = store_job(session, *hashes)
    services.dispatcher.send(parts)
    return job


def _answer(
    services: Services, request: Request, pair: _Pair, job: Job | None, form: CorrespondenceFormat
) -> Response:
    """Answer the result, the job that it waits for, or the problem that it has."""
    if job is not None and job.state in {"failed", "cancelled"}:
        raise FailedWorkError.of(job.errors)
    if job is not None and job.state != "succeeded":
        accepted = JobAccepted(job=answer_job(job))
        response = JSONResponse(accepted.model_dump(mode="json"), 202)
        describe_job(response, job)
        return response
    if is_known(request, pair.tag):
        return not_modified(pair.tag)
    try:
        found, data = load_correspondence(services.blobs, pair.key)
    except BlobNotFoundError:
        raise pair.first.absence from None
    if form == "npz":
        return file_response(data, media_type=BYTES, tag=pair.tag, name="correspondence.npz")
    return file_response(correspondence_json(found), media_type="application/json", tag=pair.tag)


router = APIRouter()
router.include_router(
    of_both,
    prefix="/v1/shapes/{shape_id}",
    tags=["shapes"],
    dependencies=[READS, Depends(find_shape)],
)
router.include_router(
    of_both,
    prefix="/v1/queries/{query_id}",
    tags=["search"],
    dependencies=[READS, Depends(find_query)],
)
