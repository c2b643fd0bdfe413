"""Uploads: files become shapes and a job."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from fastapi.concurrency import run_in_threadpool

from service.api.answers import describe_job
from service.dependencies import CollectionPath, Services, ServicesDep, UploadFolder, Wait
from service.forms import read_fields
from service.multipart import FormLimits, ReceivedForm, receive_form
from service.openapi import job_answers, multipart_body, problems
from service.received_blobs import keep_received, store_received
from service.schemas.jobs import answer_job
from service.schemas.shapes import UploadAnswer, UploadFields, answer_shape
from service.security import WRITES
from service.waiting import hold_on
from workers.errors import InvalidRequestError
from workers.geometry.formats.naming import read_name
from workers.pipeline.received import Received, sort_received
from workers.pipeline.upload_plan import Upload, shapes_of_job, store_upload
from workers.storage.blobs import archive_key, mesh_key
from workers.storage.collections import get_collection
from workers.storage.shapes import NewShape, ShapeView, get_shapes

FORM = {
    "files": {
        "type": "array",
        "minItems": 1,
        "items": {"type": "string", "format": "binary"},
        "description": "meshes of any format that is read, compressed (gz, bz2, xz) or not, "
        "archives of them (zip, tar, tar.gz, tar.bz2, tar.xz), and the files that a glTF file "
        "refers to; a file's name may have folders",
    },
    "label": {"type": "string", "maxLength": 255, "description": "of all of them"},
    "metadata": {"type": "object", "description": "as JSON, at most 16 KiB, of all"},
    "labels_from_folders": {
        "type": "boolean",
        "default": True,
        "description": "whether the folder of a file is its label, where its name gives none",
    },
}
router = APIRouter(prefix="/v1/collections", tags=["shapes"])


@dataclass(frozen=True)
class Accepted:
    """What was stored of an upload."""

    collection_id: str
    job_id: str
    shape_ids: list[str]
    has_archives: bool
    anything_new: bool


async def _receive(
    collection: CollectionPath, services: ServicesDep, folder: UploadFolder, request: Request
) -> ReceivedForm:
    """Receive the form, once it is known that its collection exists."""
    await run_in_threadpool(_require_collection, services, collection)
    limits = FormLimits(
        file_fields=frozenset({"files"}),
        text_fields=frozenset(UploadFields.model_fields),
        max_files=services.settings.max_files,
        max_file_bytes=services.settings.max_upload_bytes,
    )
    return await receive_form(request, folder, limits)


@router.post(
    "/{collection}/shapes",
    status_code=202,
    summary="Upload meshes",
    dependencies=[WRITES],
    response_model=UploadAnswer,
    responses=job_answers(ended=(200, 201), accepted=UploadAnswer, result=UploadAnswer)
    | problems(404, 413, 415, 422),
    openapi_extra=multipart_body(FORM, required="files"),
)
async def upload(
    collection: CollectionPath,
    services: ServicesDep,
    form: Annotated[ReceivedForm, Depends(_receive)],
    response: Response,
    wait: Wait = 0,
) -> UploadAnswer:
    """Store meshes and compute them. A mesh that cannot be read fails; the others go on.

    A file named `<label>.<transformation>.<strength>.<ending>` says these three; otherwise the last
    folder of its name, or of its place in an archive, is the label; the field `label` wins. All
    folders are kept as the shape's `path`. Pictures, texts and other files beside meshes are
    skipped and named in the job. A glTF file and the files that it refers to are one shape. The
    shapes of an archive appear while the job goes on. The same bytes again are the same shape, and
    nothing is computed twice; work that was cancelled or lost is queued again.
    """
    accepted = await run_in_threadpool(_accept, services, collection, form)
    job = await hold_on(services.database, accepted.job_id, wait)
    describe_job(response, job, ended=201 if accepted.anything_new else 200)
    shapes = await run_in_threadpool(_read_shapes, services, accepted)
    return UploadAnswer(job=answer_job(job), shapes=[answer_shape(view) for view in shapes])


def _accept(services: Services, collection: str, form: ReceivedForm) -> Accepted:
    """Check, blobs, rows, commit, dispatch."""
    fields = read_fields(UploadFields, form.fields, as_json=frozenset({"metadata"}))
    if not form.files:
        raise InvalidRequestError("the form has no files, expected at least one named 'files'")
    received = [Received(file.name, file.path, file.sha256, file.size) for file in form.files]
    found = sort_received(received, services.settings)
    files = {archive_key(file.sha256): file.path for file in found.archives}
    files |= {mesh_key(file.sha256): file.path for file in found.meshes}
    store_received(services.blobs, files)
    upload = Upload(
        shapes=tuple(_new_shape(file, fields) for file in found.meshes),
        archives={file.sha256: read_name(file.name).name for file in found.archives},
        label=fields.label,
        attributes=fields.metadata or {},
        folder_is_label=fields.labels_from_folders,
        skipped=found.skipped,
    )
    with services.database.begin() as session:
        row = get_collection(session, collection)
        stored = store_upload(session, row, upload)
        keep_received(session, services.blobs, files)
    services.dispatcher.send(stored.parts)
    return Accepted(
        collection_id=row.id,
        job_id=stored.job.id,
        shape_ids=stored.shape_ids,
        has_archives=bool(found.archives),
        anything_new=bool(stored.parts),
    )


def _new_shape(file: Received, fields: UploadFields) -> NewShape:
    named = read_name(file.name, folder_is_label=fields.labels_from_folders)
    return NewShape(
        sha256=file.sha256,
        n_bytes=file.size,
        name=named.name,
        label=named.label if fields.label is None else fields.label,
        transformation=named.transformation,
        strength=named.strength,
        path=named.path,
        attributes=fields.metadata or {},
    )


def _require_collection(services: Services, collection: str) -> None:
    with services.database.read() as session:
        get_collection(session, collection)


def _read_shapes(services: Services, accepted: Accepted) -> list[ShapeView]:
    """Shapes of the files, and those that came out of archives so far."""
    with services.database.read() as session:
        shape_ids = dict.fromkeys(accepted.shape_ids)
        if accepted.has_archives:
            unpacked = shapes_of_job(session, accepted.collection_id, accepted.job_id)
            shape_ids |= dict.fromkeys(unpacked)
        views = get_shapes(session, list(shape_ids))
    return [views[shape_id] for shape_id in shape_ids if shape_id in views]
