"""What pruning has to know: when shapes were deleted, and which deletions are gone."""

import time
from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0003"
down_revision: str | None = "0002"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None

THERE = sa.text("deleted_at IS NOT NULL")


def upgrade() -> None:
    """Go forward; deletions that are there count as made now."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("result", sa.JSON(none_as_null=True), nullable=True))
    with op.batch_alter_table("descriptors") as descriptors:
        descriptors.add_column(sa.Column("deleted_at", sa.Double(), nullable=True))
    table = sa.table(
        "descriptors", sa.column("vector", sa.LargeBinary), sa.column("deleted_at", sa.Double)
    )
    deletions = sa.update(table).where(table.c.vector.is_(None))
    op.execute(deletions.values(deleted_at=time.time()))
    op.create_index(
        "ix_descriptors_deleted_at",
        "descriptors",
        ["deleted_at"],
        sqlite_where=THERE,
        postgresql_where=THERE,
    )
    op.create_table(
        "pruned_changes",
        sa.Column("collection_id", sa.String(length=36), nullable=False),
        sa.Column("model", sa.String(length=63), nullable=False),
        sa.Column("change", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(
            ["collection_id"],
            ["collections.id"],
            name=op.f("fk_pruned_changes_collection_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["model"], ["models.name"], name=op.f("fk_pruned_changes_model"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("collection_id", "model", name=op.f("pk_pruned_changes")),
    )


def downgrade() -> None:
    """Go back; deletions that were pruned stay so."""
    op.drop_table("pruned_changes")
    op.drop_index("ix_descriptors_deleted_at", "descriptors")
    with op.batch_alter_table("descriptors") as descriptors:
        descriptors.drop_column("deleted_at")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("result")
