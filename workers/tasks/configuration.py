"""How Celery is configured, and why."""

from typing import Any

from celery import Celery
from kombu.entity import Queue

from workers.settings import QUEUES, Settings


def make_celery(settings: Settings) -> Celery:
    """Make the Celery application for these settings.

    There is no result backend: results are rows. Messages are acknowledged late, and each process
    prefetches one. A message that is lost, doubled or late does no harm, since the row's lease
    decides. The queues are served in the order given, so that a query overtakes uploads.

    Parameters
    ----------
    settings : Settings
        They name the broker, its queues, and the limits of a task.

    Returns
    -------
    Celery
        It carries the settings as its attribute ``settings``.
    """
    celery = Celery(
        "proteus",
        broker=settings.resolved_broker_url,
        include=[f"workers.tasks.{name}" for name in ("run", "sweep", "watch", "orphans")],
    )
    queues: list[Any] = [Queue(settings.queue_name(queue)) for queue in QUEUES]  # type: ignore[no-untyped-call]
    celery.conf.update(
        task_queues=queues,
        task_default_queue=queues[0].name,
        task_create_missing_queues=False,
        task_serializer="json",
        accept_content=["json"],
        task_ignore_result=True,
        task_acks_late=True,
        task_reject_on_worker_lost=True,
        task_time_limit=settings.task_seconds,
        worker_prefetch_multiplier=1,
        worker_concurrency=settings.worker_processes,
        worker_max_tasks_per_child=500,
        worker_max_memory_per_child=4_000_000,  # kB
        worker_pool_start_method="spawn",  # a fork would copy the locks of the keeper's thread
        worker_proc_alive_timeout=60.0,  # a busy machine takes its time to import everything
        worker_hijack_root_logger=False,
        worker_redirect_stdouts=False,
        worker_soft_shutdown_timeout=2.0,
        worker_enable_soft_shutdown_on_idle=False,
        worker_cancel_long_running_tasks_on_connection_loss=False,  # the row takes their results
        broker_connection_retry_on_startup=True,
        broker_connection_max_retries=None,
        broker_transport_options={
            "queue_order_strategy": "priority",
            "visibility_timeout": settings.task_seconds + 600,
            "unacked_restore_interval": 10,
            "unacked_restore_throttle": 1,
            "socket_timeout": 30,
            "socket_connect_timeout": 2,
            "socket_keepalive": True,
            "retry_on_timeout": True,
            "max_retries": 1,  # a request does not wait for a broker that is down
            "interval_start": 0,
            "interval_step": 0.05,
            "interval_max": 0.1,
        },
        task_publish_retry=False,
    )
    celery.settings = settings
    return celery
