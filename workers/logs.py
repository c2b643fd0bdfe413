"""Structured logs: the event first, fields after it; ids come from context."""

import logging
import sys

import structlog


def configure_logs(*, level: str = "info", form: str = "auto") -> None:
    """Send structlog and the standard library's loggers to standard error.

    Parameters
    ----------
    level : {"debug", "info", "warning", "error"}
        The least severe level that is written.
    form : {"auto", "console", "json"}
        ``auto`` writes for people on a terminal and JSON lines elsewhere.
    """
    people = form == "console" or (form == "auto" and sys.stderr.isatty())
    shared: list[structlog.typing.Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    structlog.configure(
        processors=[*shared, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=False,
    )
    renderer: structlog.typing.Processor = (
        structlog.dev.ConsoleRenderer(
            colors=sys.stderr.isatty(),
            exception_formatter=structlog.dev.plain_traceback,  # others print locals: tokens
        )
        if people
        else structlog.processors.JSONRenderer()
    )
    last = [structlog.stdlib.ProcessorFormatter.remove_processors_meta, renderer]
    if not people:
        last.insert(0, structlog.processors.format_exc_info)
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(foreign_pre_chain=shared, processors=last)
    )
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level.upper())
    for noisy in (  # the pipeline writes a line a part itself
        "alembic",
        "httpx",
        "fsspec",
        "kombu",
        "amqp",
        "PIL",
        "celery.app.trace",
        "celery.worker.strategy",
    ):
        logging.getLogger(noisy).setLevel(logging.WARNING)
