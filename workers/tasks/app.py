"""The entrance of a worker: ``celery -A workers.tasks.app worker``."""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")  # before numpy: two threads a process cost 8 to 16 times
os.environ.setdefault("REMAP_SIGTERM", "SIGQUIT")  # a running task goes back to the queue at once

from celery.signals import setup_logging  # noqa: E402

from workers.logs import configure_logs  # noqa: E402
from workers.settings import load_settings  # noqa: E402
from workers.tasks.configuration import make_celery  # noqa: E402


@setup_logging.connect
def _configure_worker_logs(**_: object) -> None:
    settings = load_settings()
    configure_logs(level=settings.log_level, form=settings.log_format)


app = make_celery(load_settings())
