"""The application: ``create_app`` is the entrance of the API's process."""

import shutil
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from functools import partial
from importlib.metadata import PackageNotFoundError, version

import structlog
from fastapi import FastAPI
from fastapi.concurrency import run_in_threadpool
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from service import page
from service.api import (
    collections,
    correspondences,
    descriptors,
    evaluations,
    health,
    jobs,
    maintenance,
    models,
    queries,
    shapes,
    surfaces,
    uploads,
)
from service.body_limit import BodyLimit
from service.compression import Compression
from service.dependencies import Services, uploads_path
from service.documentation import add_documentation
from service.errors import add_error_handlers
from service.metrics import Metrics
from service.openapi import DESCRIPTION, TAGS, install_openapi
from service.readiness import BrokerWatch
from service.request_context import RequestContext
from service.search.indexes import SearchIndexes
from service.security import Gate
from workers.logs import configure_logs
from workers.settings import MEBIBYTE, Settings, load_settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.models import Collection, TrainedModel
from workers.tasks.dispatch import Dispatcher

log = structlog.get_logger(__name__)

MAX_JSON_BYTES = 4 * MEBIBYTE
STALE_SECONDS = 24 * 3600
ROUTERS = (
    *(health, collections, uploads, shapes, surfaces, descriptors, correspondences),
    *(queries, models, evaluations, jobs, maintenance),
)
Lifespan = Callable[[FastAPI], AbstractAsyncContextManager[None]]


def create_app(settings: Settings | None = None) -> FastAPI:
    """Make the application.

    Parameters
    ----------
    settings : Settings, optional
        Without them they are read from the environment, and logs are set up.

    Raises
    ------
    SettingsError
        A setting, among them keys and rate limit, cannot be read.
    """
    if settings is None:
        settings = load_settings()
        configure_logs(level=settings.log_level, form=settings.log_format)
    app = FastAPI(
        title="Proteus",
        summary="Search engine for deformable 3D shapes",
        description=DESCRIPTION,
        version=_version(),
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        openapi_tags=TAGS,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=_lifespan(settings),
    )
    app.state.gate = Gate(settings)
    app.state.metrics = Metrics()
    app.add_middleware(Compression)
    app.add_middleware(BodyLimit, limit=partial(_body_limit, settings))
    app.add_middleware(RequestContext, metrics=app.state.metrics)
    add_error_handlers(app)
    for module in ROUTERS:
        app.include_router(module.router)
    install_openapi(app, has_keys=app.state.gate.has_keys)
    add_documentation(app)
    page.add_page(app, page.FOLDER)
    return app


def _lifespan(settings: Settings) -> Lifespan:
    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        services = _open(settings)
        app.state.services = services
        app.state.metrics.watch(services.database, services.indexes)
        await run_in_threadpool(_tidy, services)
        yield
        await run_in_threadpool(_close, services)
        app.state.gate.close()

    return lifespan


def _open(settings: Settings) -> Services:
    database = Database(settings.resolved_database_url)
    dispatcher = Dispatcher(settings)
    return Services(
        settings=settings,
        database=database,
        blobs=BlobStore(settings.resolved_blob_url),
        dispatcher=dispatcher,
        indexes=SearchIndexes(database, settings.data_path / "cache"),
        broker=BrokerWatch(dispatcher.broker_alive),
    )


def _close(services: Services) -> None:
    services.broker.close()
    services.indexes.close()
    services.dispatcher.close()
    services.database.dispose()


def _tidy(services: Services) -> None:
    """Remove what a crash left behind: old parts of uploads, caches of what was deleted."""
    for folder in uploads_path(services.settings).glob("*"):
        if time.time() - folder.lstat().st_mtime > STALE_SECONDS:
            shutil.rmtree(folder, ignore_errors=True)
    try:
        with services.database.read() as session:
            services.indexes.keep_only(
                set(session.scalars(select(Collection.id))),
                set(session.scalars(select(TrainedModel.name))),
            )
    except SQLAlchemyError as error:
        log.warning("the database cannot be read yet", error=str(error)[:300])


def _body_limit(settings: Settings, path: str, content_type: str) -> int:
    """Return the most bytes of a body: uploads are forms, all else is small."""
    if content_type.lower().startswith("multipart/"):
        return settings.max_request_bytes
    return MAX_JSON_BYTES


def _version() -> str:
    try:
        return version("proteus-shapes")
    except PackageNotFoundError:
        return "0"
