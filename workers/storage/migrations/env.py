"""Runs the migrations on the connection that ``workers.storage.migrate`` opened."""

from alembic import context

from workers.storage.models import Base

connection = context.config.attributes["connection"]
context.configure(
    connection=connection, target_metadata=Base.metadata, render_as_batch=True, compare_type=True
)
with context.begin_transaction():
    context.run_migrations()
