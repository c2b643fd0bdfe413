"""What a job is at, and how long it will still take."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0005"
down_revision: str | None = "0004"
branch_labels: Sequence[str] | None = None
depends_on: Sequence[str] | None = None


def upgrade() -> None:
    """Go forward."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("step", sa.String(20), nullable=True))
        jobs.add_column(sa.Column("seconds_left", sa.Double(), nullable=True))
        jobs.add_column(sa.Column("done_before", sa.Integer(), nullable=True))
    op.execute(sa.text("UPDATE jobs SET done_before = 0"))
    with op.batch_alter_table("jobs") as jobs:
        jobs.alter_column("done_before", existing_type=sa.Integer(), nullable=False)


def downgrade() -> None:
    """Go back."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("done_before")
        jobs.drop_column("seconds_left")
        jobs.drop_column("step")
