"""The one task: do the part whose id the message carries."""

from functools import cache
from typing import Any

from celery import Task

from workers.pipeline.work import run_part
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.tasks.app import app
from workers.tasks.dispatch import Dispatcher
from workers.tasks.notes import progress_of_this_process


@cache
def workbench() -> Workbench:
    """What this process works with, opened at its first task.

    Returns
    -------
    Workbench
        The same for every task.
    """
    settings: Settings = app.settings
    return Workbench(
        database=Database(settings.resolved_database_url),
        blobs=BlobStore(settings.resolved_blob_url),
        settings=settings,
        send=Dispatcher(settings, app).send,
        progress=progress_of_this_process(),
    )


@app.task(bind=True, name="workers.tasks.run.run_part_task")
def run_part_task(self: Task[Any, Any], part_id: str) -> None:
    """Do one part of a job.

    Parameters
    ----------
    part_id : str
        Id of the part's row.
    """
    run_part(workbench(), part_id, message=str(self.request.id))
