"""Where a shape lay, what else its file holds, and which files of an upload were skipped."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0004"
down_revision: str | None = "0003"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go forward; a shape that is there lay where its name says."""
    with op.batch_alter_table("shapes") as shapes:
        shapes.add_column(sa.Column("path", sa.Text(), nullable=True))
        shapes.add_column(sa.Column("found", sa.JSON(), nullable=True))
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("skipped", sa.JSON(), nullable=True))
        jobs.add_column(sa.Column("skipped_count", sa.Integer(), nullable=True))
    shape = sa.table("shapes", sa.column("path"), sa.column("name"), sa.column("found", sa.JSON))
    op.execute(sa.update(shape).values(path=shape.c.name, found=[]))
    job = sa.table("jobs", sa.column("skipped", sa.JSON), sa.column("skipped_count"))
    op.execute(sa.update(job).values(skipped=[], skipped_count=0))
    with op.batch_alter_table("shapes") as shapes:
        shapes.alter_column("path", existing_type=sa.Text(), nullable=False)
        shapes.alter_column("found", existing_type=sa.JSON(), nullable=False)
        shapes.alter_column("format", existing_type=sa.String(10), type_=sa.String(20))
    with op.batch_alter_table("jobs") as jobs:
        jobs.alter_column("skipped", existing_type=sa.JSON(), nullable=False)
        jobs.alter_column("skipped_count", existing_type=sa.Integer(), nullable=False)


def downgrade() -> None:
    """Go back."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("skipped_count")
        jobs.drop_column("skipped")
    with op.batch_alter_table("shapes") as shapes:
        shapes.alter_column("format", existing_type=sa.String(20), type_=sa.String(10))
        shapes.drop_column("found")
        shapes.drop_column("path")
