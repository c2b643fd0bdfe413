"""What endpoints receive."""

import re
import tempfile
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from fastapi import Depends, Query, Request
from fastapi import Path as PathParameter
from pydantic import Field

from service.readiness import BrokerWatch
from service.schemas.collections import NAME_PATTERN
from service.schemas.text import Text
from service.search.indexes import SearchIndexes
from workers.errors import (
    CollectionNotFoundError,
    EvaluationNotFoundError,
    JobNotFoundError,
    ModelNotFoundError,
    QueryNotFoundError,
    ShapeNotFoundError,
)
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.paging import CURSOR_PATTERN, MOST_CURSOR
from workers.tasks.dispatch import Dispatcher

ID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
MAX_WAIT_SECONDS = 60
Cursor = Annotated[
    str,
    Field(pattern=CURSOR_PATTERN, max_length=MOST_CURSOR),
]
"""The key of a page's last row: opaque to clients, which send back what they were given."""


@dataclass(frozen=True)
class Services:
    """What the application opened when it started."""

    settings: Settings
    database: Database
    blobs: BlobStore
    dispatcher: Dispatcher
    indexes: SearchIndexes
    broker: BrokerWatch


@dataclass(frozen=True)
class PageRequest:
    """Which page of a list is asked for."""

    limit: int
    cursor: str | None


async def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


async def _page(
    limit: Annotated[int, Query(ge=1, le=1000, description="most items of the page")] = 50,
    cursor: Annotated[Cursor | None, Query(description="`next_cursor` of the page before")] = None,
) -> PageRequest:
    return PageRequest(limit, cursor or None)


async def _collection(collection: Annotated[str, PathParameter(examples=["zoo"])]) -> str:
    if not re.fullmatch(NAME_PATTERN, collection):
        raise CollectionNotFoundError(f"there is no collection named {collection[:100]!r}")
    return collection


async def _shape_id(shape_id: Annotated[str, PathParameter(description="id of a shape")]) -> str:
    if not ID.fullmatch(shape_id):
        raise ShapeNotFoundError(f"there is no shape {shape_id[:100]!r}")
    return shape_id


async def _job_id(job_id: Annotated[str, PathParameter(description="id of a job")]) -> str:
    if not ID.fullmatch(job_id):
        raise JobNotFoundError(f"there is no job {job_id[:100]!r}")
    return job_id


async def _query_id(query_id: Annotated[str, PathParameter(description="id of a query")]) -> str:
    if not ID.fullmatch(query_id):
        raise QueryNotFoundError(f"there is no query {query_id[:100]!r}")
    return query_id


async def _evaluation_id(
    evaluation_id: Annotated[str, PathParameter(description="id of an evaluation")],
) -> str:
    if not ID.fullmatch(evaluation_id):
        raise EvaluationNotFoundError(f"there is no evaluation {evaluation_id[:100]!r}")
    return evaluation_id


async def _model(name: Annotated[str, PathParameter(examples=["heat"])]) -> str:
    if not name.isprintable() or not 0 < len(name) <= 63:
        raise ModelNotFoundError(f"there is no model named {name[:100]!r}")
    return name


async def _upload_folder(request: Request) -> AsyncIterator[Path]:
    """Folder on the disk of the data directory that is gone when the endpoint has ended."""
    services = await _services(request)
    parent = uploads_path(services.settings)
    parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=parent, ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def uploads_path(settings: Settings) -> Path:
    """Return where uploads lie until they are complete."""
    return settings.data_path / "uploads"


ServicesDep = Annotated[Services, Depends(_services)]
PageDep = Annotated[PageRequest, Depends(_page)]
CollectionPath = Annotated[str, Depends(_collection)]
ShapePath = Annotated[str, Depends(_shape_id)]
JobPath = Annotated[str, Depends(_job_id)]
QueryPath = Annotated[str, Depends(_query_id)]
EvaluationPath = Annotated[str, Depends(_evaluation_id)]
ModelPath = Annotated[str, Depends(_model)]
UploadFolder = Annotated[Path, Depends(_upload_folder, scope="function")]
Wait = Annotated[
    float,
    Query(
        ge=0,
        le=MAX_WAIT_SECONDS,
        allow_inf_nan=False,
        description="seconds to hold on for the job, 0 to 60; 202 if it has not ended by then",
    ),
]
FilterText = Annotated[Text | None, Query(max_length=255)]
