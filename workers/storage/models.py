"""The tables. Times are seconds since 1970 (UTC), ids are time-ordered UUIDs."""

from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

Json = dict[str, Any]


class Base(DeclarativeBase):
    """Names constraints alike on every database, so that migrations can speak of them."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


class Counter(Base):
    """A number that is raised inside the transaction that uses it."""

    __tablename__ = "counters"
    name: Mapped[str] = mapped_column(String(40), primary_key=True)
    value: Mapped[int] = mapped_column(BigInteger)


class TrainedModel(Base):
    """How shapes are described and compared; immutable once it is ready.

    ``state`` is "ready" or "training"; the job of a model in training says whether it failed.
    """

    __tablename__ = "models"
    name: Mapped[str] = mapped_column(String(63), primary_key=True)
    method: Mapped[str] = mapped_column(String(40))
    state: Mapped[str] = mapped_column(String(20))
    built_in: Mapped[bool] = mapped_column(Boolean)
    definition: Mapped[Json] = mapped_column(JSON)
    job_id: Mapped[str | None] = mapped_column(String(36))
    created_at: Mapped[float] = mapped_column(Double)


class Collection(Base):
    """A named set of shapes that is searched under one model."""

    __tablename__ = "collections"
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    name: Mapped[str] = mapped_column(String(63), unique=True)
    description: Mapped[str] = mapped_column(Text)
    model: Mapped[str] = mapped_column(ForeignKey("models.name"))
    created_at: Mapped[float] = mapped_column(Double)


class CollectionModel(Base):
    """A model under which every shape of the collection is to be described."""

    __tablename__ = "collection_models"
    collection_id: Mapped[str] = mapped_column(
        ForeignKey("collections.id", ondelete="CASCADE"), primary_key=True
    )
    model: Mapped[str] = mapped_column(ForeignKey("models.name"), primary_key=True)


class Job(Base):
    """Long work as its client sees it; the parts below it are what workers claim.

    ``skipped`` has the first of ``skipped_count`` files of an upload that are no meshes.
    ``result`` is what the work found out, where that is stored nowhere else. ``step`` is what is
    done now, where it is known of the whole job. ``seconds_left`` was estimated when something
    was done last; ``done_before`` was done when the job was made or retried.
    """

    __tablename__ = "jobs"
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    kind: Mapped[str] = mapped_column(String(20))
    state: Mapped[str] = mapped_column(String(20))
    done: Mapped[int] = mapped_column(Integer)
    total: Mapped[int] = mapped_column(Integer)
    unit: Mapped[str] = mapped_column(String(20))
    errors: Mapped[list[Json]] = mapped_column(JSON)
    failed: Mapped[int] = mapped_column(Integer)
    skipped: Mapped[list[Json]] = mapped_column(JSON)
    skipped_count: Mapped[int] = mapped_column(Integer)
    attempts: Mapped[int] = mapped_column(Integer)
    collection: Mapped[str | None] = mapped_column(String(63))
    model: Mapped[str | None] = mapped_column(String(63))
    step: Mapped[str | None] = mapped_column(String(20))
    seconds_left: Mapped[float | None] = mapped_column(Double)
    done_before: Mapped[int] = mapped_column(Integer)
    finale: Mapped[Json | None] = mapped_column(JSON(none_as_null=True))
    result: Mapped[Json | None] = mapped_column(JSON(none_as_null=True))
    revision: Mapped[int] = mapped_column(Integer)
    created_at: Mapped[float] = mapped_column(Double)
    started_at: Mapped[float | None] = mapped_column(Double)
    finished_at: Mapped[float | None] = mapped_column(Double)


class Shape(Base):
    """A mesh in a collection, and what was found out about it."""

    __tablename__ = "shapes"
    __table_args__ = (UniqueConstraint("collection_id", "sha256"),)
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    collection_id: Mapped[str] = mapped_column(
        ForeignKey("collections.id", ondelete="CASCADE"), index=True
    )
    job_id: Mapped[str | None] = mapped_column(String(36))
    name: Mapped[str] = mapped_column(Text)
    path: Mapped[str] = mapped_column(Text)
    label: Mapped[str | None] = mapped_column(Text)
    transformation: Mapped[str | None] = mapped_column(Text)
    strength: Mapped[int | None] = mapped_column(Integer)
    attributes: Mapped[Json] = mapped_column("metadata", JSON)
    sha256: Mapped[str] = mapped_column(String(64), index=True)
    n_bytes: Mapped[int] = mapped_column(BigInteger)
    format: Mapped[str | None] = mapped_column(String(20))
    n_vertices: Mapped[int | None] = mapped_column(Integer)
    n_faces: Mapped[int | None] = mapped_column(Integer)
    area: Mapped[float | None] = mapped_column(Double)
    n_components: Mapped[int | None] = mapped_column(Integer)
    n_boundary_loops: Mapped[int | None] = mapped_column(Integer)
    repairs: Mapped[list[str]] = mapped_column(JSON)
    found: Mapped[list[str]] = mapped_column(JSON)
    error: Mapped[Json | None] = mapped_column(JSON(none_as_null=True))
    created_at: Mapped[float] = mapped_column(Double)


class Part(Base):
    """The unit of work: claimed by one worker under a lease, finished once.

    ``owner`` is drawn anew at every claim and fences the finish; ``message`` is the id of the
    Celery message whose process works on it, by which the worker's parent renews the lease.
    """

    __tablename__ = "parts"
    __table_args__ = (
        Index("ix_parts_state_lease_until", "state", "lease_until"),
        Index("ix_parts_job_id_state", "job_id", "state"),
    )
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id", ondelete="CASCADE"))
    kind: Mapped[str] = mapped_column(String(20))
    queue: Mapped[str] = mapped_column(String(20))
    payload: Mapped[Json] = mapped_column(JSON)
    shape_id: Mapped[str | None] = mapped_column(String(36), index=True)
    weight: Mapped[int] = mapped_column(Integer)
    state: Mapped[str] = mapped_column(String(20))
    attempts: Mapped[int] = mapped_column(Integer)
    owner: Mapped[str | None] = mapped_column(String(36))
    message: Mapped[str | None] = mapped_column(String(80), index=True)
    lease_until: Mapped[float | None] = mapped_column(Double)
    sent_at: Mapped[float] = mapped_column(Double)


class Descriptor(Base):
    """A shape under a model: little-endian float32; no vector where the shape was deleted.

    It has no foreign key to the shape: a deletion stays as a row of the change feed until it is
    pruned, counted from ``deleted_at``.
    """

    __tablename__ = "descriptors"
    __table_args__ = (
        Index("ix_descriptors_feed", "collection_id", "model", "change"),
        Index(
            "ix_descriptors_deleted_at",
            "deleted_at",
            sqlite_where=text("deleted_at IS NOT NULL"),
            postgresql_where=text("deleted_at IS NOT NULL"),
        ),
    )
    shape_id: Mapped[str] = mapped_column(String(36), primary_key=True)
    model: Mapped[str] = mapped_column(ForeignKey("models.name"), primary_key=True)
    collection_id: Mapped[str] = mapped_column(String(36))
    change: Mapped[int] = mapped_column(BigInteger)
    vector: Mapped[bytes | None] = mapped_column(LargeBinary)
    deleted_at: Mapped[float | None] = mapped_column(Double)


class Signature(Base):
    """Windows of a shape under a model, see `workers.retrieval.windows.rows`: a change feed too.

    They are many bytes, which the scan does not read: so they have a table of their own.
    """

    __tablename__ = "signatures"
    __table_args__ = (
        Index("ix_signatures_feed", "collection_id", "model", "change"),
        Index(
            "ix_signatures_deleted_at",
            "deleted_at",
            sqlite_where=text("deleted_at IS NOT NULL"),
            postgresql_where=text("deleted_at IS NOT NULL"),
        ),
    )
    shape_id: Mapped[str] = mapped_column(String(36), primary_key=True)
    model: Mapped[str] = mapped_column(ForeignKey("models.name"), primary_key=True)
    collection_id: Mapped[str] = mapped_column(String(36))
    change: Mapped[int] = mapped_column(BigInteger)
    vector: Mapped[bytes | None] = mapped_column(LargeBinary)
    deleted_at: Mapped[float | None] = mapped_column(Double)


FEEDS: tuple[type[Descriptor | Signature], ...] = (Descriptor, Signature)
"""Tables whose rows are changes."""


class PrunedChange(Base):
    """The newest deletion that was removed from the change feed of a (collection, model).

    Whoever has seen less than ``change`` may have missed a deletion and reads the feed anew.
    """

    __tablename__ = "pruned_changes"
    collection_id: Mapped[str] = mapped_column(
        ForeignKey("collections.id", ondelete="CASCADE"), primary_key=True
    )
    model: Mapped[str] = mapped_column(
        ForeignKey("models.name", ondelete="CASCADE"), primary_key=True
    )
    change: Mapped[int] = mapped_column(BigInteger)


class QueryDescriptor(Base):
    """The descriptor of a query's mesh, by its content."""

    __tablename__ = "query_descriptors"
    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    model: Mapped[str] = mapped_column(ForeignKey("models.name"), primary_key=True)
    vector: Mapped[bytes] = mapped_column(LargeBinary)
    created_at: Mapped[float] = mapped_column(Double)


class Query(Base):
    """A query by mesh; it is ranked again each time it is read."""

    __tablename__ = "queries"
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    collection_id: Mapped[str] = mapped_column(ForeignKey("collections.id", ondelete="CASCADE"))
    job_id: Mapped[str | None] = mapped_column(String(36))
    sha256: Mapped[str] = mapped_column(String(64), index=True)
    model: Mapped[str] = mapped_column(String(63))
    parameters: Mapped[Json] = mapped_column(JSON)
    created_at: Mapped[float] = mapped_column(Double)


class Evaluation(Base):
    """Models measured on a collection; without a result, its job says how far it is.

    ``ranks``, one entry a query and model, is long and read only when one is shown.
    """

    __tablename__ = "evaluations"
    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    job_id: Mapped[str] = mapped_column(String(36))
    collection: Mapped[str] = mapped_column(String(63))
    models: Mapped[list[str]] = mapped_column(JSON)
    dissimilarity: Mapped[str | None] = mapped_column(String(40))
    result: Mapped[Json | None] = mapped_column(JSON(none_as_null=True))
    ranks: Mapped[list[Json] | None] = mapped_column(JSON(none_as_null=True), deferred=True)
    created_at: Mapped[float] = mapped_column(Double)
