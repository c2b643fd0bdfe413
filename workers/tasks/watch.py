"""Watches what a worker's processes are at: tells steps, and stops what is in vain or too long.

One thread in each worker's parent process. A process in LAPACK hears nothing, whatever is sent to
it, so it is killed, and the pool starts another. A part is stopped for one of two reasons: the
claim does not stand any more, since its job was cancelled; or the work on its mesh took longer
than ``PROTEUS_SHAPE_SECONDS``, and the part was failed for that.
"""

import atexit
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import structlog
from celery.signals import worker_init, worker_ready, worker_shutting_down

from workers.pipeline.overtime import fail_overtime
from workers.pipeline.progress import MESH_STEPS
from workers.pipeline.workbench import Workbench
from workers.settings import Settings
from workers.storage.blobs import BlobStore
from workers.storage.database import Database
from workers.storage.watching import claims_standing, is_last_open, release_owned, store_step
from workers.tasks.app import app
from workers.tasks.dispatch import Dispatcher
from workers.tasks.notes import FOLDER_VARIABLE, Note, Notes

PAUSE_SECONDS = 0.25
DYING_SECONDS = 0.1  # from the signal until the kernel has ended the process
WORTH_TELLING_SECONDS = 1.0
"""Steps of uploads are stored from this age on: thousands of small ones cost no transaction."""

log = structlog.get_logger(__name__)


class Watcher(threading.Thread):
    """Looks at the notes of a worker's processes, four times a second.

    Parameters
    ----------
    bench : Workbench
        Rows, settings, and how parts are sent.
    notes : Notes
        Of the processes.
    kill : callable
        Ends a process of the pool by its number, at once.
    """

    def __init__(self, bench: Workbench, notes: Notes, kill: Callable[[int], None]) -> None:
        super().__init__(name="watcher", daemon=True)
        self._bench = bench
        self._notes = notes
        self._kill = kill
        self._stopping = threading.Event()
        self._told: dict[int, Note] = {}

    def run(self) -> None:
        """Go on until ``stop``; an error of the database is logged, and tried again."""
        while not self._stopping.wait(PAUSE_SECONDS):
            try:
                self.look()
            except Exception:  # the thread must outlive any outage
                log.exception("watcher failed, tries again")

    def look(self) -> None:
        """Look once at what every process is at, and do what follows from it."""
        notes = self._notes.read_all()
        self._told = {p: told for p, told in self._told.items() if p in notes}
        if not notes:
            return
        owners = {note.part_id: note.owner for note in notes.values()}
        with self._bench.database.read() as session:
            standing = claims_standing(session, owners)
        for process, note in notes.items():
            if note.part_id not in standing:
                self._stop_process(process, note, reason="cancelled, or taken over")
            elif self._is_overtime(note) and self._fail(note):
                self._stop_process(process, note, reason="it took too long")
            else:
                self._tell(process, note, job_id=standing[note.part_id])

    def stop(self) -> None:
        """End the thread soon."""
        self._stopping.set()

    def _is_overtime(self, note: Note) -> bool:
        seconds = time.monotonic() - note.since
        return note.step in MESH_STEPS and seconds > self._bench.settings.shape_seconds

    def _fail(self, note: Note) -> bool:
        """Fail what took too long; False if it has just ended."""
        return fail_overtime(
            self._bench, note.part_id, note.owner, shape_id=note.shape_id, step=note.step
        )

    def _stop_process(self, process: int, note: Note, *, reason: str) -> None:
        """Kill a process, unless it has just ended that work by itself.

        Whatever else it had claimed goes back to the queue at once.
        """
        now = self._notes.read(process)
        if now is None or (now.part_id, now.owner) != (note.part_id, note.owner):
            return
        self._kill(process)
        self._notes.remove(process)
        with self._bench.database.begin() as session:
            released = release_owned(session, note.owner, now=time.time())
        self._bench.send(released)
        log.info("part stopped", part_id=note.part_id, step=note.step, reason=reason)

    def _tell(self, process: int, note: Note, *, job_id: str) -> None:
        """Store the step in the job, where it is new and is that of the whole job."""
        if self._told.get(process) == note:
            return
        seconds = time.monotonic() - note.since
        if note.kind != "query" and seconds < WORTH_TELLING_SECONDS:
            return
        with self._bench.database.read() as session:
            is_that_of_the_job = is_last_open(session, note.part_id, job_id)
        if is_that_of_the_job:
            with self._bench.database.begin() as session:
                store_step(session, job_id, note.step)
        self._told[process] = note


class WatchedPool:
    """The watcher of this worker, from the start of its parent to the end."""

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._watcher: Watcher | None = None

    def prepare(self) -> None:
        """Make the folder of the notes, before there are processes that write them."""
        self._folder = Path(tempfile.mkdtemp(prefix="proteus-notes-"))
        os.environ[FOLDER_VARIABLE] = str(self._folder)
        atexit.register(shutil.rmtree, self._folder, ignore_errors=True)

    def start(self, pool: Any, hub: Any) -> None:
        """Begin to watch the processes of a pool.

        Parameters
        ----------
        pool : celery.concurrency.prefork.TaskPool
            Of this worker.
        hub : kombu.asynchronous.Hub or None
            The event loop of the parent, in which the pool lives.
        """
        if self._folder is None:
            return
        settings: Settings = app.settings
        bench = Workbench(
            database=Database(settings.resolved_database_url),
            blobs=BlobStore(settings.resolved_blob_url),
            settings=settings,
            send=Dispatcher(settings, app).send,
        )

        def kill(process: int) -> None:
            pool.terminate_job(process, signal.SIGKILL)  # Celery counts it as no crash
            if hub is not None:  # start another at once; the pool itself looks every 5 s
                time.sleep(DYING_SECONDS)
                hub.call_soon(pool.maintain_pool)

        self._watcher = Watcher(bench, Notes(self._folder), kill)
        self._watcher.start()

    def stop(self) -> None:
        """End the watching soon."""
        if self._watcher is not None:
            self._watcher.stop()


_watched = WatchedPool()


@worker_init.connect
def _prepare(**_: Any) -> None:
    _watched.prepare()


@worker_ready.connect
def _start(sender: Any, **_: Any) -> None:
    _watched.start(sender.pool, sender.hub)


@worker_shutting_down.connect
def _stop(**_: Any) -> None:
    _watched.stop()
