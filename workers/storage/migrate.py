"""Brings a database to the newest schema and writes the built-in models.

``python -m workers.storage.migrate`` does it for the settings in the environment; to run it
twice, or from two machines at once, does no harm.
"""

import time
from pathlib import Path

import structlog
from alembic import command
from alembic.config import Config
from sqlalchemy import Connection, text
from sqlalchemy.orm import Session

from workers.logs import configure_logs
from workers.retrieval.builtin import built_in_models
from workers.settings import Settings, load_settings
from workers.storage.change_feed import ensure_counter
from workers.storage.database import Database
from workers.storage.pruning import PRUNED
from workers.storage.references import BLOBS
from workers.storage.shipped_models import shipped_model, shipped_training
from workers.storage.trained_models import ensure_models

ADVISORY_LOCK = 0x50524F54  # one migration at a time on PostgreSQL


def migration_config(connection: Connection) -> Config:
    """Alembic's configuration for one open connection.

    Parameters
    ----------
    connection : Connection
        The migrations run in its transaction.

    Returns
    -------
    The configuration, with the folder of this package's migrations.
    """
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    return config


def migrate_schema(session: Session, revision: str = "head") -> None:
    """Bring the schema to a revision; on PostgreSQL, one process at a time until the commit.

    Parameters
    ----------
    session : Session
        That writes.
    revision : str
        Number of a migration, or ``head`` for the newest.
    """
    connection = session.connection()
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:n)"), {"n": ADVISORY_LOCK})
    command.upgrade(migration_config(connection), revision)


def migrate(settings: Settings) -> None:
    """Bring the settings' database to the newest schema, with the built-in models in it.

    Parameters
    ----------
    settings : Settings
        They say where the database is and how fine its models' working meshes are.
    """
    database = Database(settings.resolved_database_url)
    try:
        with database.begin() as session:
            migrate_schema(session)
            vertices = settings.working_vertices
            models = built_in_models(working_vertices=vertices)
            shipped = shipped_model(working_vertices=vertices)
            ensure_models(session, (*models, shipped), {shipped.name: shipped_training()})
            ensure_counter(session, BLOBS)
            ensure_counter(session, PRUNED, value=int(time.time()))
    finally:
        database.dispose()


def main() -> None:
    """Migrate as the environment says."""
    settings = load_settings()
    configure_logs(level=settings.log_level, form=settings.log_format)
    migrate(settings)
    database = Database(settings.resolved_database_url)
    structlog.get_logger(__name__).info(
        "migrated", database=database.url.render_as_string(hide_password=True)
    )
    database.dispose()


if __name__ == "__main__":
    main()
