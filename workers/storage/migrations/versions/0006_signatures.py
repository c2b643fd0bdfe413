"""Windows of shapes, by which parts are found."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0006"
down_revision: str | None = "0005"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None

DELETED = sa.text("deleted_at IS NOT NULL")


def upgrade() -> None:
    """Go forward."""
    op.create_table(
        "signatures",
        sa.Column("shape_id", sa.String(length=36), nullable=False),
        sa.Column("model", sa.String(length=63), nullable=False),
        sa.Column("collection_id", sa.String(length=36), nullable=False),
        sa.Column("change", sa.BigInteger(), nullable=False),
        sa.Column("vector", sa.LargeBinary(), nullable=True),
        sa.Column("deleted_at", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["model"], ["models.name"], name=op.f("fk_signatures_model")),
        sa.PrimaryKeyConstraint("shape_id", "model", name=op.f("pk_signatures")),
    )
    op.create_index("ix_signatures_feed", "signatures", ["collection_id", "model", "change"])
    op.create_index(
        "ix_signatures_deleted_at",
        "signatures",
        ["deleted_at"],
        sqlite_where=DELETED,
        postgresql_where=DELETED,
    )


def downgrade() -> None:
    """Go back."""
    op.drop_table("signatures")
