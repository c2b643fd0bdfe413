"""Figures for Prometheus."""

from collections.abc import Iterator

import structlog
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError

from service.search.indexes import SearchIndexes
from workers.storage.database import Database
from workers.storage.models import Job, Part, Shape

log = structlog.get_logger(__name__)

SECONDS = (0.002, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class Metrics:
    """Figures of one application, in a registry of its own."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        labels = ["method", "route", "status"]
        self._requests = Counter(
            "proteus_http_requests", "Requests answered", labels, registry=self.registry
        )
        self._seconds = Histogram(
            "proteus_http_request_seconds",
            "Time to answer",
            ["method", "route"],
            registry=self.registry,
            buckets=SECONDS,
        )

    def watch(self, database: Database, indexes: SearchIndexes) -> None:
        """Report on these too, from now on."""
        self.registry.register(_Stock(database, indexes))

    def count_request(self, method: str, route: str, status: int, seconds: float) -> None:
        """Note one answered request."""
        method = method if method in METHODS else "other"
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)

    def render(self) -> bytes:
        """Return everything in Prometheus' text format."""
        return generate_latest(self.registry)


class _Stock(Collector):
    """Counts rows and indexes when it is asked, never before."""

    def __init__(self, database: Database, indexes: SearchIndexes) -> None:
        self._database = database
        self._indexes = indexes

    def describe(self) -> list[Metric]:
        return []

    def collect(self) -> Iterator[Metric]:
        try:
            yield from self._rows()
        except SQLAlchemyError as error:
            log.warning("figures without the database", error=str(error)[:200])
        yield from self._memory()

    def _rows(self) -> Iterator[Metric]:
        jobs = GaugeMetricFamily("proteus_jobs", "Jobs", labels=["kind", "state"])
        parts = GaugeMetricFamily("proteus_parts", "Parts of jobs", labels=["queue", "state"])
        with self._database.read() as session:
            by_kind = select(Job.kind, Job.state, func.count()).group_by(Job.kind, Job.state)
            for *labels, count in session.execute(by_kind):
                jobs.add_metric(labels, count)
            open_parts = Part.state.in_(("queued", "running"))
            by_queue = select(Part.queue, Part.state, func.count()).where(open_parts)
            for *labels, count in session.execute(by_queue.group_by(Part.queue, Part.state)):
                parts.add_metric(labels, count)
            shapes = session.scalar(select(func.count()).select_from(Shape)) or 0
        yield jobs
        yield parts
        yield GaugeMetricFamily("proteus_shapes", "Shapes stored", value=shapes)

    def _memory(self) -> Iterator[Metric]:
        labels = ["collection_id", "model"]
        rows = GaugeMetricFamily("proteus_index_rows", "Shapes in an open index", labels=labels)
        size = GaugeMetricFamily("proteus_index_bytes", "Bytes of an open index", labels=labels)
        for key, (n_rows, n_bytes) in self._indexes.sizes().items():
            rows.add_metric(key, n_rows)
            size.add_metric(key, n_bytes)
        yield rows
        yield size
