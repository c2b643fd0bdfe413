"""The API's process: uvicorn on its own address or on a socket inherited from the supervisor."""

import socket
import sys

import uvicorn

from workers.settings import Settings, load_settings

GRACE_SECONDS = 5


def run_api(settings: Settings, *, listener: socket.socket | None = None) -> None:
    """Serve the API until a signal ends it.

    Parameters
    ----------
    settings : Settings
        Give the address where no listener is handed over, and the log level.
    listener : socket, optional
        A bound, listening socket. The supervisor keeps it open, so that clients wait, and are
        not refused, while a dead API starts again.
    """
    server = uvicorn.Server(api_config(settings))
    server.run(sockets=None if listener is None else [listener])


def api_config(settings: Settings) -> uvicorn.Config:
    """Return how uvicorn serves the API; it believes forwarded addresses of named proxies only."""
    return uvicorn.Config(
        "service.app:create_app",
        factory=True,
        host=settings.host,
        port=settings.port,
        log_config=None,
        log_level=settings.log_level,
        access_log=False,
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=settings.trusted_proxies,
        timeout_graceful_shutdown=GRACE_SECONDS,
    )


def main() -> None:
    """Serve with settings from the environment; the first argument may name a descriptor."""
    listener = socket.socket(fileno=int(sys.argv[1])) if len(sys.argv) > 1 else None
    run_api(load_settings(), listener=listener)


if __name__ == "__main__":
    main()
