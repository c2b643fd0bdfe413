"""API keys, what they allow, and how many requests a client may make.

A token is ``proteus_<id>_<secret>``; the service knows only its sha256, which is enough for a
secret of 256 random bits. Without keys in the settings everything is open.
"""

import hashlib
import hmac
import math
import re
import secrets
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import Depends, Request, Security
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from limits import RateLimitItem, parse
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from service.errors import RefusedError
from workers.settings import Settings, SettingsError

Scope = Literal["read", "write", "admin"]
SCOPES: Mapping[str, frozenset[str]] = {
    "read": frozenset({"read"}),
    "write": frozenset({"read", "write"}),
    "admin": frozenset({"read", "write", "admin"}),
}
"""What each scope allows: to look and search; to upload and change; to delete for good."""

PREFIX = "proteus"
IDENTIFIER = re.compile(r"[a-z0-9-]{1,40}")
DIGEST = re.compile(r"[0-9a-f]{64}")

bearer = HTTPBearer(
    auto_error=False,
    scheme_name="key",
    description="`proteus_<id>_<secret>`; needed where the service has keys",
)


@dataclass(frozen=True)
class ApiKey:
    """A key as the service knows it."""

    identifier: str
    digest: str
    scopes: frozenset[str]


def new_key(identifier: str, scopes: Iterable[str]) -> tuple[str, str]:
    """Draw a new key.

    Returns
    -------
    The token, which its client alone keeps, and the entry for ``PROTEUS_API_KEYS``.

    Raises
    ------
    SettingsError
        The identifier or a scope is none.
    """
    token = f"{PREFIX}_{identifier}_{secrets.token_urlsafe(32)}"
    setting = f"{identifier}:{_digest(token)}:{'+'.join(scopes)}"
    parse_keys(setting)
    return token, setting


def parse_keys(setting: str) -> dict[str, ApiKey]:
    """Read ``PROTEUS_API_KEYS``: ``id:sha256:scope+scope``, comma-separated.

    Raises
    ------
    SettingsError
        An entry is of another form, or an id stands there twice.
    """
    keys: dict[str, ApiKey] = {}
    for number, entry in enumerate(filter(None, map(str.strip, setting.split(","))), start=1):
        identifier, digest, scopes, *rest = [*entry.split(":"), "", ""]
        given = scopes.split("+")
        unknown = [scope for scope in given if scope not in SCOPES]
        if not IDENTIFIER.fullmatch(identifier) or not DIGEST.fullmatch(digest) or any(rest):
            raise SettingsError(
                f"PROTEUS_API_KEYS: entry {number} is not of the form id:sha256:scope+scope, "
                "with an id of small letters, digits and -, and 64 hexadecimal digits"
            )
        if unknown:
            raise SettingsError(
                f"PROTEUS_API_KEYS: entry {number} has the scope {unknown[0]!r}, "
                f"expected {', '.join(SCOPES)}"
            )
        if identifier in keys:
            raise SettingsError(f"PROTEUS_API_KEYS: the id {identifier!r} stands there twice")
        allowed = frozenset().union(*(SCOPES[scope] for scope in given))
        keys[identifier] = ApiKey(identifier, digest, allowed)
    return keys


class Gate:
    """Lets requests in: by key, if there are keys, and as many as a client may make.

    Raises
    ------
    SettingsError
        The keys or the rate limit cannot be read.
    """

    def __init__(self, settings: Settings) -> None:
        self._keys = parse_keys(settings.api_keys)
        self._limit: RateLimitItem | None = None
        if settings.rate_limit:
            try:
                self._limit = parse(settings.rate_limit)
            except ValueError:
                raise SettingsError(
                    f"PROTEUS_RATE_LIMIT is {settings.rate_limit!r}, expected e.g. 600/minute"
                ) from None
            self._limiter = MovingWindowRateLimiter(MemoryStorage())

    def admit(self, token: str | None, scope: Scope, *, address: str) -> None:
        """Let a request in, or refuse it.

        Raises
        ------
        RefusedError
            401 without a valid key, 403 where it does not allow this, 429 when it asks too often.
        """
        key = self._find(token) if self._keys else None
        self._count(f"key {key.identifier}" if key else f"address {address}")
        if key is not None and scope not in key.scopes:
            raise RefusedError(
                "forbidden",
                403,
                f"this needs the scope {scope!r}, the key {key.identifier!r} has "
                f"{', '.join(sorted(key.scopes))}",
            )

    def _find(self, token: str | None) -> ApiKey:
        challenge = {"WWW-Authenticate": "Bearer"}
        if token is None:
            detail = "a key is needed: Authorization: Bearer proteus_<id>_<secret>"
            raise RefusedError("unauthorized", 401, detail, challenge)
        parts = token.split("_", 2)
        key = self._keys.get(parts[1]) if len(parts) == 3 and parts[0] == PREFIX else None
        known = key.digest if key is not None else "0" * 64
        if not hmac.compare_digest(_digest(token), known) or key is None:
            raise RefusedError("unauthorized", 401, "the key is not valid", challenge)
        return key

    def _count(self, client: str) -> None:
        if self._limit is None or self._limiter.hit(self._limit, client):
            return
        until = self._limiter.get_window_stats(self._limit, client).reset_time
        seconds = max(1, math.ceil(until - time.time()))
        raise RefusedError(
            "too-many-requests",
            429,
            f"at most {self._limit} are allowed; try again in {seconds} s",
            {"Retry-After": str(seconds)},
        )


def requires(scope: Scope) -> Any:
    """Dependency that lets a request in only with this scope."""

    async def admit(
        request: Request,
        credentials: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)],
    ) -> None:
        gate: Gate = request.app.state.gate
        address = request.client.host if request.client else "local"
        token = credentials.credentials if credentials else None
        gate.admit(token, scope, address=address)

    dependency: Callable[..., Coroutine[Any, Any, None]] = admit
    return Depends(dependency)


READS = requires("read")
WRITES = requires("write")
ADMINISTERS = requires("admin")


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode(errors="surrogatepass")).hexdigest()
