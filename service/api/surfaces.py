"""What there is to see of a shape: mesh, picture, spectrum, k(x,x), distributions."""

import hashlib
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from service.api.answers import file_response, is_known, not_modified
from service.dependencies import FilterText, Services, ServicesDep, ShapePath
from service.openapi import Responses, content, problems
from service.schemas.shapes import DistributionAnswer, DistributionAxis, SpectrumAnswer
from service.search.kernels import OF_MODEL, ChosenKernel, choose_kernel, first_kernel
from service.search.ranking import require_ready, shape_vector
from service.security import READS
from workers.errors import BlobNotFoundError, InvalidRequestError, ShapeNotReadyError
from workers.geometry.formats import write
from workers.geometry.preparation import View
from workers.pipeline.fields import vertex_signature
from workers.retrieval.channels import Channel
from workers.retrieval.model import Model
from workers.storage.blobs import mesh_key, thumbnail_key
from workers.storage.collections import get_collection
from workers.storage.models import Shape
from workers.storage.shapes import ShapeView, get_shape
from workers.storage.solutions import load_cleaned, load_solution
from workers.storage.trained_models import load_model

MeshFormat = Literal["original", "off", "ply", "obj", "stl", "glb"]
BYTES = "application/octet-stream"
MEDIA_TYPES = {
    "off": "model/vnd.off",
    "ply": "model/ply",
    "obj": "model/obj",
    "stl": "model/stl",
    "glb": "model/gltf-binary",
    "gltf": "model/gltf+json",
    "3mf": "model/3mf",
}
UNIT = "u is the file's unit of length: area in u², eigenvalues in 1/u²"
KNOWN: Responses = {304: {"description": "If-None-Match names the present content"}}
router = APIRouter(prefix="/v1/shapes/{shape_id}", tags=["shapes"])


@dataclass(frozen=True)
class Computed:
    """A shape and the model of its collection."""

    view: ShapeView
    model: Model

    @property
    def row(self) -> Shape:
        """The shape's row."""
        return self.view.row


@router.get(
    "/mesh",
    summary="Fetch the mesh",
    dependencies=[READS],
    response_class=Response,
    responses={
        200: content(BYTES, *MEDIA_TYPES.values(), description="the mesh"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def mesh(
    shape_id: ShapePath,
    services: ServicesDep,
    request: Request,
    form: Annotated[MeshFormat, Query(alias="format")] = "original",
) -> Response:
    """Fetch the file as it was uploaded, or the cleaned mesh in one of five formats."""
    with services.database.read() as session:
        view = get_shape(session, shape_id)
    row = view.row
    original = form == "original"
    tag = f'"{row.sha256}"'  # each format is a resource of its own, so it says enough
    if is_known(request, tag):
        return not_modified(tag)
    try:
        if original:
            data = services.blobs.get(mesh_key(row.sha256))
        else:
            data = write(load_cleaned(services.blobs, row.sha256), form)
    except BlobNotFoundError:
        raise _not_there(view) from None
    kind = row.format or "" if original else form
    name = row.name if original else f"{PurePosixPath(row.name).stem}.{form}"
    return file_response(data, media_type=MEDIA_TYPES.get(kind, BYTES), tag=tag, name=name)


@router.get(
    "/thumbnail.png",
    summary="Fetch the picture",
    dependencies=[READS],
    response_class=Response,
    responses={
        200: content("image/png", description="256 by 256 pixels"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def thumbnail(shape_id: ShapePath, services: ServicesDep, request: Request) -> Response:
    """Fetch a shaded picture of the shape; shapes that stand alike are seen from the same side."""
    with services.database.read() as session:
        view = get_shape(session, shape_id)
    tag = f'"{view.row.sha256}.png"'
    if is_known(request, tag):
        return not_modified(tag)
    try:
        data = services.blobs.get(thumbnail_key(view.row.sha256))
    except BlobNotFoundError:
        raise _not_there(view) from None
    return file_response(data, media_type="image/png", tag=tag)


@router.get(
    "/spectrum",
    summary="Show the spectrum",
    dependencies=[READS],
    responses=problems(404, 409, 422),
)
def spectrum(shape_id: ShapePath, services: ServicesDep) -> SpectrumAnswer:
    """Show the eigenvalues under the first view of the collection's model."""
    found = _computed(services, shape_id)
    try:
        view = found.model.views[0]
        solved = load_solution(services.blobs, found.row.sha256, view).spectrum
    except BlobNotFoundError:
        raise _not_there(found.view) from None
    return SpectrumAnswer(
        eigenvalues=solved.eigenvalues.tolist(), area=float(solved.area), unit=UNIT
    )


@router.get(
    "/signature",
    summary="Fetch k(x,x) at every vertex",
    dependencies=[READS],
    response_class=Response,
    responses={
        200: content(BYTES, description="little-endian float32, one a vertex of `format=glb`"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def signature(
    shape_id: ShapePath,
    services: ServicesDep,
    request: Request,
    kernel: Annotated[
        FilterText,
        Query(
            description="`heat`, `heat:TIME` (TIME in units of 1/λ₁), `commute-time`, "
            "`biharmonic`, or `model:NAME`, such as a learned one; that of the collection's model "
            "if left out",
            examples=["heat:0.15"],
        ),
    ] = None,
) -> Response:
    """Fetch k(x,x) of a kernel, in 1/area of the file's unit."""
    found = _computed(services, shape_id)
    view, chosen = _kernel(services, found.model, kernel)
    named = hashlib.sha256(f"{view.key} {chosen.key}".encode()).hexdigest()[:16]
    tag = f'"{found.row.sha256}.{named}"'
    if is_known(request, tag):
        return not_modified(tag)
    try:
        solved = load_solution(services.blobs, found.row.sha256, view).spectrum
        values = vertex_signature(
            services.blobs, found.row.sha256, view, chosen.in_file_units(solved)
        )
    except BlobNotFoundError:
        raise _not_there(found.view) from None
    return file_response(values.astype("<f4").tobytes(), media_type=BYTES, tag=tag)


@router.get(
    "/distribution",
    summary="Show one channel of the descriptor",
    dependencies=[READS],
    responses=problems(404, 409, 422),
)
def distribution(
    shape_id: ShapePath,
    services: ServicesDep,
    model: FilterText = None,
    channel: FilterText = None,
) -> DistributionAnswer:
    """Show what the search compares: by default the first channel of the collection's model."""
    found = _computed(services, shape_id)
    with services.database.read() as session:
        chosen = found.model if model is None else load_model(session, model)
        vector = shape_vector(session, shape_id, chosen.name)
    described = _channel(chosen, channel)
    return DistributionAnswer(
        shape_id=shape_id,
        model=chosen.name,
        channel=described.name,
        feature=described.feature,
        normalisation=described.normalisation,
        axis=_axis(described),
        values=vector[chosen.slices[described.name]].tolist(),
    )


def _computed(services: Services, shape_id: str) -> Computed:
    """Find a shape and its collection's model."""
    with services.database.read() as session:
        view = get_shape(session, shape_id)
        model = load_model(session, get_collection(session, view.collection).model)
    return Computed(view, model)


def _kernel(services: Services, model: Model, name: str | None) -> tuple[View, ChosenKernel]:
    """Return the kernel that a request names, of another model perhaps."""
    if name is None or not name.startswith(OF_MODEL):
        return choose_kernel(model, name)
    with services.database.read() as session:
        return first_kernel(load_model(session, name.removeprefix(OF_MODEL)))


def _not_there(view: ShapeView) -> ShapeNotReadyError:
    """Why something that is computed of a shape is not there."""
    try:
        require_ready(view)
    except ShapeNotReadyError as error:
        return error
    return ShapeNotReadyError(f"this was not computed of shape {view.row.id} yet")


def _channel(model: Model, name: str | None) -> Channel:
    for channel in model.channels:
        if name in {None, channel.name}:
            return channel
    known = ", ".join(channel.name for channel in model.channels)
    raise InvalidRequestError(f"model {model.name!r} has no channel {name!r}; it has {known}")


def _axis(channel: Channel) -> DistributionAxis:
    if channel.edges is not None:
        return DistributionAxis(kind="edges", values=list(channel.edges))
    if channel.is_of_points:
        time = float(channel.kernel.parameters["time"]) if channel.kernel else 1.0
        return DistributionAxis(
            kind="times", values=[time * level for level in channel.levels or ()]
        )
    kind: Literal["levels", "index"] = "index" if channel.kernel is None else "levels"
    return DistributionAxis(kind=kind, values=list(channel.levels or ()))
