"""Wakes workers for parts that were committed; a message that is lost is sent again later."""

from collections.abc import Sequence

import structlog
from celery import Celery

from workers.settings import LIGHT, QUEUES, Settings
from workers.storage.models import Part
from workers.tasks.configuration import make_celery

TASK = "workers.tasks.run.run_part_task"
log = structlog.get_logger(__name__)


class Dispatcher:
    """Sends one message a part. A message that is lost is sent again by the sweeper.

    Parameters
    ----------
    settings : Settings
        They say where the broker is.
    celery : Celery, optional
        The application to send with; a new one by default.
    """

    def __init__(self, settings: Settings, celery: Celery | None = None) -> None:
        self._settings = settings
        self._celery = make_celery(settings) if celery is None else celery

    def send(self, parts: Sequence[Part]) -> None:
        """Send a message for each part; it never raises, since the rows are committed.

        Parameters
        ----------
        parts : sequence of Part
            Their rows.
        """
        if not parts:
            return
        try:
            with self._celery.producer_pool.acquire(block=True, timeout=2) as producer:
                for part in parts:
                    self._celery.send_task(
                        TASK,
                        args=[part.id],
                        queue=self._settings.queue_name(part.queue),
                        producer=producer,
                        retry=False,
                    )
        except Exception as error:  # whatever the broker's client raises: the sweeper sends again
            log.warning("broker unreachable, the sweeper will send", error=str(error)[:200])

    def waiting(self, queue: str) -> int | None:
        """Count the messages that wait in a queue.

        Parameters
        ----------
        queue : str
            One of `workers.settings.QUEUES`.

        Returns
        -------
        int or None
            None if the broker does not answer.
        """
        try:
            with self._celery.connection_for_read() as connection:
                name = self._settings.queue_name(queue)
                return int(connection.default_channel.client.llen(name))
        except Exception as error:  # any failure of the broker's client means "does not answer"
            log.debug("broker does not answer", error=str(error)[:200])
            return None

    def drop_messages(self) -> None:
        """Drop all messages that wait; the sweeper sends their parts again."""
        with self._celery.connection_for_write() as connection:
            for queue in QUEUES:
                connection.default_channel.client.delete(self._settings.queue_name(queue))

    def broker_alive(self) -> bool:
        """Whether the broker answers.

        Returns
        -------
        bool
            True if it answers.
        """
        return self.waiting(LIGHT) is not None

    def close(self) -> None:
        """Close the connections."""
        self._celery.close()
