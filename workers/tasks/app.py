"""The entrance of a worker: ``celery -A workers.tasks.app worker``."""

import os

os.environ.setdefault("REMAP_SIGTERM", "SIGQUIT")  # a running task goes back to the queue at once

from celery.signals import setup_logging

from workers.logs import configure_logs
from workers.settings import load_settings
from workers.tasks.configuration import make_celery


@setup_logging.connect
def _configure_worker_logs(**_: object) -> None:
    settings = load_settings()
    configure_logs(level=settings.log_level, form=settings.log_format)


app = make_celery(load_settings())
