"""Health and figures."""

from fastapi import APIRouter, Request
from fastapi.responses import Response
from sqlalchemy.exc import SQLAlchemyError

from service.dependencies import Services, ServicesDep
from service.metrics import Metrics
from service.openapi import problems
from service.schemas.health import Alive, Readiness
from service.search.index import latest_change
from service.security import READS

METRICS_TYPE = "text/plain; version=0.0.4; charset=utf-8"
router = APIRouter(tags=["service"])


@router.get("/healthz", summary="Whether the process answers")
async def health() -> Alive:
    """Answer as long as the process lives; needs no key."""
    return Alive()


@router.get(
    "/readyz",
    summary="Whether requests can be served",
    responses={503: {"model": Readiness, "description": "the database cannot be used"}},
)
def readiness(services: ServicesDep, response: Response) -> Readiness:
    """Ask database, index and broker; a broker that is away is `degraded`, with 200."""
    database_works = _database_works(services)
    broker_works = services.broker.alive()
    if not database_works:
        response.status_code = 503
    status = "down" if not database_works else "ok" if broker_works else "degraded"
    return Readiness.model_validate(
        {
            "status": status,
            "database": "ok" if database_works else "down",
            "index": "ok" if database_works else "down",
            "broker": "ok" if broker_works else "down",
        }
    )


@router.get(
    "/metrics",
    summary="Figures for Prometheus",
    dependencies=[READS],
    response_class=Response,
    responses={
        200: {"description": "Prometheus' text format", "content": {METRICS_TYPE: {}}},
        **problems(),
    },
)
def metrics(request: Request) -> Response:
    """Requests, jobs, shapes and search indexes as figures."""
    figures: Metrics = request.app.state.metrics
    return Response(figures.render(), media_type=METRICS_TYPE)


def _database_works(services: Services) -> bool:
    """Whether the change feed can be read: the database is there and migrated."""
    try:
        with services.database.read() as session:
            latest_change(session)
    except SQLAlchemyError:
        return False
    return True
