"""What a job is at."""

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


def downgrade() -> None:
    """Go back."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("step")
