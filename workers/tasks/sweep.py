"""Keeps leases alive and finds what was lost: one thread in each worker's parent process.

The parent knows which messages its children work on, and is never held up by LAPACK, which
keeps the interpreter's lock throughout. So it renews their leases; a child that died is no
longer among them, and its lease runs out.
"""

import threading
import time
from typing import Any

import structlog
from celery.signals import worker_ready, worker_shutting_down
from celery.worker import state as worker_state
from sqlalchemy import func, select

from workers.pipeline.prune import plan_pruning_if_due
from workers.settings import QUEUES, Settings
from workers.storage.database import Database
from workers.storage.models import Part
from workers.storage.parts import fail_exhausted, mark_sent, parts_to_send, renew_leases
from workers.tasks.app import app
from workers.tasks.dispatch import Dispatcher

log = structlog.get_logger(__name__)


class Keeper(threading.Thread):
    """Renews this worker's leases every third of a lease, and sweeps at its own interval."""

    def __init__(self, settings: Settings, database: Database, dispatcher: Dispatcher) -> None:
        super().__init__(name="keeper", daemon=True)
        self._settings = settings
        self._database = database
        self._dispatcher = dispatcher
        self._stopping = threading.Event()

    def run(self) -> None:
        """Go on until ``stop``; an error of the database or broker is logged, and tried again."""
        next_renewal = next_sweep = time.monotonic()
        while not self._stopping.wait(0.5):
            now = time.monotonic()
            try:
                if now >= next_renewal:
                    next_renewal = now + self._settings.lease_seconds / 3
                    self.renew()
                if now >= next_sweep:
                    next_sweep = now + self._settings.sweep_seconds
                    sweep(self._settings, self._database, self._dispatcher)
                    self.prune()
            except Exception:  # the thread must outlive any outage
                log.exception("keeper failed, tries again")

    def renew(self) -> None:
        """Renew the leases of what the children work on."""
        messages = [str(request.id) for request in tuple(worker_state.active_requests)]
        if messages:
            with self._database.begin() as session:
                renew_leases(session, messages, until=time.time() + self._settings.lease_seconds)

    def prune(self) -> None:
        """Have freed what is no longer needed, as often as the settings say."""
        parts = plan_pruning_if_due(self._database, self._settings, now=time.time())
        self._dispatcher.send(parts)

    def stop(self) -> None:
        """End the thread soon."""
        self._stopping.set()


def sweep(settings: Settings, database: Database, dispatcher: Dispatcher) -> int:
    """Send again the parts that nobody seems to work on, and fail those tried too often.

    A queue that holds as many messages as there are queued parts has lost none: a long backlog
    is not sent twice.

    Parameters
    ----------
    settings : Settings
        They say how long a message may take, and how often a part is tried.
    database : Database
        All rows.
    dispatcher : Dispatcher
        Sends the messages.

    Returns
    -------
    int
        How many messages were sent.
    """
    now = time.time()
    with database.read() as session:
        lost = parts_to_send(session, now=now, resend_seconds=settings.resend_seconds)
        backlog = dict(
            session.execute(
                select(Part.queue, func.count()).where(Part.state == "queued").group_by(Part.queue)
            ).all()
        )
    if not lost:
        return 0
    room = {queue: backlog.get(queue, 0) - (dispatcher.waiting(queue) or 0) for queue in QUEUES}
    sent: list[Part] = []
    for part in lost:
        if part.state == "running" and part.attempts >= settings.max_attempts:
            with database.begin() as session:
                sent += fail_exhausted(
                    session, part.id, now=now, max_attempts=settings.max_attempts
                )
        elif part.state == "running" or room.get(part.queue, 1) > 0:
            room[part.queue] = room.get(part.queue, 1) - (part.state == "queued")
            sent.append(part)
    if sent:
        with database.begin() as session:
            mark_sent(session, [part.id for part in sent], now=now)
        dispatcher.send(sent)
        log.info("sent again", parts=len(sent))
    return len(sent)


_keepers: list[Keeper] = []


@worker_ready.connect
def _start_keeper(**_: Any) -> None:
    settings: Settings = app.settings
    keeper = Keeper(settings, Database(settings.resolved_database_url), Dispatcher(settings, app))
    keeper.start()
    _keepers.append(keeper)


@worker_shutting_down.connect
def _stop_keeper(**_: Any) -> None:
    for keeper in _keepers:
        keeper.stop()
