"""Everything that can be set from outside, read once at each entrance.

Variables carry the prefix ``PROTEUS_``. A variable of that prefix which is unknown, or
whose value makes no sense, refuses to start and is named.
"""

import hashlib
import os
import tempfile
from collections.abc import Mapping
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

PREFIX = "PROTEUS_"
CLIENT_VARIABLES = frozenset({"PROTEUS_URL", "PROTEUS_KEY"})
"""Variables of the prefix that the command line reads as a client; no settings of the service."""
FOREIGN = CLIENT_VARIABLES | frozenset(
    {
        "PROTEUS_REAL_MESHES",
        "PROTEUS_TEST_POSTGRES",
        "PROTEUS_TEST_REDIS",
    }
)
"""Variables of the prefix that belong to clients, the test suite and the benchmarks."""

MEBIBYTE = 1 << 20
LIGHT, INGEST = "light", "ingest"
QUEUES = (LIGHT, INGEST)
"""What workers take work from, in the order in which they look: a query overtakes uploads."""


class SettingsError(ValueError):
    """A setting is unknown or has no sensible value; the message names the variable."""


def available_processors() -> int:
    """Processors that this process may use.

    Returns
    -------
    At least 1.
    """
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:
        return max(1, os.cpu_count() or 1)


class Settings(BaseSettings):
    """All settings, frozen; each has a type, a default and a line that says what it does."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, frozen=True, extra="forbid")

    data_dir: Path = Field(Path("proteus-data"), description="where the embedded service keeps all")
    host: str = Field("127.0.0.1", description="address the API listens on")
    port: int = Field(8000, ge=0, le=65535, description="port the API listens on")
    database_url: str = Field("", description="SQLAlchemy URL; empty: SQLite in the data directory")
    broker_url: str = Field("", description="Redis URL; empty: the bundled Valkey's socket")
    blob_url: str = Field("", description="fsspec URL of meshes and spectra; empty: data directory")
    queue_prefix: str = Field("proteus", description="prefix of the queues' names in the broker")
    worker_processes: int = Field(
        default_factory=available_processors, ge=1, le=256, description="processes of one worker"
    )
    default_model: str = Field("proteus", description="model of collections that name none")
    working_vertices: int = Field(
        5000, ge=500, le=100_000, description="vertices of the simplified mesh that is solved"
    )

    max_upload_bytes: int = Field(256 * MEBIBYTE, ge=1024, description="bytes of one file")
    max_request_bytes: int = Field(2048 * MEBIBYTE, ge=1024, description="bytes of one request")
    max_files: int = Field(1000, ge=1, description="files in one request")
    max_vertices: int = Field(2_000_000, ge=100, description="vertices of one mesh")
    max_faces: int = Field(4_000_000, ge=100, description="faces of one mesh")
    max_zip_entries: int = Field(20_000, ge=1, description="entries of one archive")
    max_zip_bytes: int = Field(
        8192 * MEBIBYTE, ge=1024, description="unpacked bytes of one archive"
    )
    max_zip_ratio: int = Field(
        200, ge=2, description="unpacked by packed bytes of an archive, and of an entry"
    )

    lease_seconds: float = Field(30.0, gt=0, description="how long a claimed part stays claimed")
    sweep_seconds: float = Field(5.0, gt=0, description="pause between two rounds of the sweeper")
    resend_seconds: float = Field(10.0, gt=0, description="age at which an unheard part is re-sent")
    task_seconds: int = Field(900, ge=1, description="hard limit of one task; it is then killed")
    shape_seconds: float = Field(
        120.0,
        gt=0,
        validate_default=True,
        description="seconds that the work on one mesh may take; it then fails for that",
    )
    max_attempts: int = Field(3, ge=1, description="claims of one part before it counts as failed")

    prune_hours: float = Field(
        24.0, ge=0, description="hours between two prunings; 0: only when asked for"
    )
    keep_unused_days: float = Field(
        7.0, ge=0.05, description="days for files that nothing refers to, such as deleted meshes"
    )
    keep_training_days: float = Field(
        30.0, ge=0.05, description="days for what a training computed of pairs and copies"
    )
    keep_jobs_days: float = Field(30.0, ge=0.05, description="days for jobs after their end")
    keep_queries_days: float = Field(
        90.0, ge=0.05, description="days for queries by mesh after they were last asked"
    )
    keep_deletions_days: float = Field(
        30.0, ge=0.05, description="days after which an index that slept is read anew"
    )

    api_keys: str = Field("", description="id:sha256:scope+scope, comma-separated; empty: open")
    rate_limit: str = Field("", description="requests a client may make, e.g. 600/minute")
    key_attempts: str = Field(
        "100/minute", description="wrong secrets an address may try for one key; empty: any number"
    )
    trusted_proxies: str = Field(
        "", description="proxies whose X-Forwarded-For is believed: addresses or networks, or *"
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field("info", description="verbosity")
    log_format: Literal["auto", "console", "json"] = Field("auto", description="form of log lines")

    @field_validator("shape_seconds")
    @classmethod
    def _before_the_task(cls, seconds: float, info: ValidationInfo) -> float:
        if seconds >= info.data.get("task_seconds", inf):
            raise ValueError("expected less than PROTEUS_TASK_SECONDS")
        return seconds

    @field_validator("database_url")
    @classmethod
    def _known_database(cls, url: str) -> str:
        if url and not url.startswith(("sqlite", "postgresql")):
            raise ValueError("expected a sqlite or postgresql URL")
        if url.startswith("postgresql:"):
            return url.replace("postgresql:", "postgresql+psycopg:", 1)
        return url

    @field_validator("broker_url")
    @classmethod
    def _known_broker(cls, url: str) -> str:
        if url and not url.startswith(("redis://", "rediss://", "redis+socket://")):
            raise ValueError("expected a redis://, rediss:// or redis+socket:// URL")
        return url

    def queue_name(self, queue: str) -> str:
        """Name of a queue in the broker.

        Parameters
        ----------
        queue : str
            One of ``QUEUES``.

        Returns
        -------
        The name with the prefix of the settings.
        """
        return f"{self.queue_prefix}.{queue}"

    @cached_property
    def data_path(self) -> Path:
        """The data directory, absolute."""
        return self.data_dir.expanduser().absolute()

    @cached_property
    def runtime_path(self) -> Path:
        """A short private directory for the broker's socket: such paths end at 107 bytes."""
        name = hashlib.sha256(str(self.data_path).encode()).hexdigest()[:16]
        return Path(tempfile.gettempdir()) / f"proteus-{os.getuid()}" / name

    @cached_property
    def resolved_database_url(self) -> str:
        """The database's URL, SQLite in the data directory unless another is set."""
        return self.database_url or f"sqlite:///{self.data_path / 'proteus.sqlite3'}"

    @cached_property
    def resolved_broker_url(self) -> str:
        """The broker's URL, the bundled server's socket unless another is set."""
        return self.broker_url or self._embedded_broker_url

    @cached_property
    def has_embedded_broker(self) -> bool:
        """Whether the broker is the bundled server, which one API process has for itself."""
        return self.resolved_broker_url == self._embedded_broker_url

    @property
    def _embedded_broker_url(self) -> str:
        return f"redis+socket://{self.runtime_path / 'broker.sock'}"

    @cached_property
    def resolved_blob_url(self) -> str:
        """Where meshes and spectra lie, in the data directory unless set."""
        return self.blob_url or f"file://{self.data_path / 'blobs'}"


def load_settings(environment: Mapping[str, str] | None = None, **overrides: object) -> Settings:
    """Read the settings from the environment, refusing what is unknown.

    Parameters
    ----------
    environment : mapping, optional
        Where unknown ``PROTEUS_`` variables are looked for; ``os.environ`` by default.
    **overrides : object
        Values that win over the environment, for example from the command line.

    Returns
    -------
    The settings.

    Raises
    ------
    SettingsError
        A variable is unknown or its value is refused; the message names it.
    """
    environment = os.environ if environment is None else environment
    known = {f"{PREFIX}{name}".upper() for name in Settings.model_fields} | FOREIGN
    unknown = sorted(n for n in environment if n.startswith(PREFIX) and n not in known)
    if unknown:
        raise SettingsError(f"unknown setting {unknown[0]}; known are {', '.join(sorted(known))}")
    try:
        return Settings(**{k: v for k, v in overrides.items() if v is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        first = error.errors()[0]
        name = PREFIX + "_".join(str(part) for part in first["loc"]).upper()
        raise SettingsError(f"{name}: {first['msg']}, got {first.get('input')!r}") from None
