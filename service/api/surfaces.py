"""What can be seen of a shape or a query: the mesh, its spectrum, k(x,x), φ, a picture."""

import hashlib
from pathlib import PurePosixPath
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request, Response

from service.api.answers import file_response, is_known, not_modified
from service.dependencies import FilterText, QueryPath, Services, ServicesDep, ShapePath
from service.openapi import Responses, content, problems
from service.schemas.shapes import SpectrumAnswer
from service.search.kernels import OF_MODEL, ChosenKernel, choose_kernel, first_kernel
from service.security import READS
from workers.errors import BlobNotFoundError
from workers.geometry.formats import write
from workers.geometry.formats.containers import is_wrapped
from workers.geometry.formats.naming import inner_name
from workers.geometry.views import View
from workers.pipeline.fields import vertex_eigenfunction, vertex_signature
from workers.storage.blobs import mesh_key, thumbnail_key
from workers.storage.solutions import load_cleaned, load_solution
from workers.storage.stored_meshes import StoredMesh, mesh_of_query, mesh_of_shape
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
of_both = APIRouter()
of_shapes = APIRouter()


def find_shape(shape_id: ShapePath, services: ServicesDep, request: Request) -> None:
    """Note the mesh of the shape that a path names; 404 if there is none."""
    with services.database.read() as session:
        request.state.mesh = mesh_of_shape(session, shape_id)


def find_query(query_id: QueryPath, services: ServicesDep, request: Request) -> None:
    """Note the mesh of the query that a path names; 404 if there is none."""
    with services.database.read() as session:
        request.state.mesh = mesh_of_query(session, query_id)


async def _found(request: Request) -> StoredMesh:
    stored: StoredMesh = request.state.mesh
    return stored


MeshDep = Annotated[StoredMesh, Depends(_found)]


@of_both.get(
    "/mesh",
    summary="Fetch the mesh",
    response_class=Response,
    responses={
        200: content(BYTES, *MEDIA_TYPES.values(), description="the mesh"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def mesh(
    stored: MeshDep,
    services: ServicesDep,
    request: Request,
    form: Annotated[MeshFormat, Query(alias="format")] = "original",
) -> Response:
    """Fetch the file as it was uploaded, or the cleaned mesh in one of five formats."""
    original = form == "original"
    tag = f'"{stored.sha256}"'  # each format is a resource of its own, so it says enough
    if is_known(request, tag):
        return not_modified(tag)
    try:
        if original:
            data = services.blobs.get(mesh_key(stored.sha256))
        else:
            data = write(load_cleaned(services.blobs, stored.sha256), form)
    except BlobNotFoundError:
        raise stored.absence from None
    kind = form if not original else _kind_of(data, stored.format)
    name = _original_name(stored, data) if original else f"{_stem(stored.name)}.{form}"
    return file_response(data, media_type=MEDIA_TYPES.get(kind, BYTES), tag=tag, name=name)


def _kind_of(data: bytes, format: str | None) -> str:
    """Return what the bytes are: a mesh of its format, or a compressed file that holds one."""
    return "" if format is None or is_wrapped(data) else format


def _original_name(stored: StoredMesh, data: bytes) -> str:
    """Return the name of the stored file; a .gltf that was joined with its files is a GLB."""
    joined = stored.name.lower().endswith(".gltf") and data.startswith(b"glTF")
    return f"{_stem(stored.name)}.glb" if joined else stored.name


def _stem(name: str) -> str:
    return PurePosixPath(inner_name(name)).stem


@of_both.get("/spectrum", summary="Show the spectrum", responses=problems(404, 409, 422))
def spectrum(stored: MeshDep, services: ServicesDep) -> SpectrumAnswer:
    """Show the eigenvalues under the first view of the collection's or the query's model."""
    view = _first_view(services, stored)
    try:
        solved = load_solution(services.blobs, stored.sha256, view).spectrum
    except BlobNotFoundError:
        raise stored.absence from None
    return SpectrumAnswer(
        eigenvalues=solved.eigenvalues.tolist(), area=float(solved.area), unit=UNIT
    )


@of_both.get(
    "/signature",
    summary="Fetch k(x,x) at every vertex",
    response_class=Response,
    responses={
        200: content(BYTES, description="little-endian float32, one a vertex of `format=glb`"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def signature(
    stored: MeshDep,
    services: ServicesDep,
    request: Request,
    kernel: Annotated[
        FilterText,
        Query(
            description="`heat`, `heat:TIME` (TIME in units of 1/λ₁), `commute-time`, "
            "`biharmonic`, or `model:NAME`, such as a learned one; that of the collection's or "
            "the query's model if left out",
            examples=["heat:0.15"],
        ),
    ] = None,
) -> Response:
    """Fetch k(x,x) of a kernel, in 1/area of the file's unit."""
    view, chosen = _kernel(services, stored.model, kernel)
    tag = _tag(stored, view, chosen.key)
    if is_known(request, tag):
        return not_modified(tag)
    try:
        solved = load_solution(services.blobs, stored.sha256, view).spectrum
        values = vertex_signature(services.blobs, stored.sha256, view, chosen.in_file_units(solved))
    except BlobNotFoundError:
        raise stored.absence from None
    return file_response(values.astype("<f4").tobytes(), media_type=BYTES, tag=tag)


@of_both.get(
    "/eigenfunction",
    summary="Fetch an eigenfunction at every vertex",
    response_class=Response,
    responses={
        200: content(BYTES, description="little-endian float32, one a vertex of `format=glb`"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def eigenfunction(
    stored: MeshDep,
    services: ServicesDep,
    request: Request,
    number: Annotated[
        int,
        Query(description="1 for the first nonzero eigenvalue of `spectrum`", examples=[1]),
    ],
) -> Response:
    """Fetch φ under the first view of the collection's or the query's model, in 1/u.

    ∫φ² over the surface is 1; the sign follows from the mesh.
    """
    view = _first_view(services, stored)
    tag = _tag(stored, view, f"eigenfunction {number}")
    if is_known(request, tag):
        return not_modified(tag)
    try:
        values = vertex_eigenfunction(services.blobs, stored.sha256, view, number)
    except BlobNotFoundError:
        raise stored.absence from None
    return file_response(values.astype("<f4").tobytes(), media_type=BYTES, tag=tag)


@of_shapes.get(
    "/thumbnail.png",
    summary="Fetch the picture",
    response_class=Response,
    responses={
        200: content("image/png", description="256 by 256 pixels"),
        **KNOWN,
        **problems(404, 409, 422),
    },
)
def thumbnail(stored: MeshDep, services: ServicesDep, request: Request) -> Response:
    """Fetch a shaded picture of the shape; shapes that stand alike are seen from the same side."""
    tag = f'"{stored.sha256}.png"'
    if is_known(request, tag):
        return not_modified(tag)
    try:
        data = services.blobs.get(thumbnail_key(stored.sha256))
    except BlobNotFoundError:
        raise stored.absence from None
    return file_response(data, media_type="image/png", tag=tag)


def _first_view(services: Services, stored: StoredMesh) -> View:
    with services.database.read() as session:
        return load_model(session, stored.model).views[0]


def _kernel(services: Services, model: str, name: str | None) -> tuple[View, ChosenKernel]:
    """Return the kernel that a request names, of another model perhaps."""
    with services.database.read() as session:
        if name is None or not name.startswith(OF_MODEL):
            return choose_kernel(load_model(session, model), name)
        return first_kernel(load_model(session, name.removeprefix(OF_MODEL)))


def _tag(stored: StoredMesh, view: View, what: str) -> str:
    """ETag of values at the vertices."""
    named = hashlib.sha256(f"{view.key} {what}".encode()).hexdigest()[:16]
    return f'"{stored.sha256}.{named}"'


router = APIRouter()
for part in (of_both, of_shapes):
    router.include_router(
        part,
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
