"""API keys, what they allow, and how many requests a client may make.

A token is ``proteus_<id>_<secret>``; the service knows only its sha256, which is enough for a
secret of 256 random bits. Without keys in the settings everything is open.
"""

import hashlib
import hmac
import ipaddress
import re
import secrets
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import Depends, Request, Security
from fastapi.concurrency import run_in_threadpool
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from service.errors import RefusedError
from service.rates import open_counts, read_rate
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
NEEDS_KEY = "a key is needed: Authorization: Bearer proteus_<id>_<secret>"
IPV6_CLIENT_BITS = 64
"""One client of IPv6 has a whole network of so many leading bits, not one address."""

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

    Every request is counted, whether its key is good or not. Wrong secrets are counted a second
    time, by the client's address and the key that they were tried for. Beyond the limit the
    secret is not looked at any more, so that the answer does not tell which guess was right.

    Raises
    ------
    SettingsError
        The keys or a rate cannot be read.
    """

    def __init__(self, settings: Settings) -> None:
        self._keys = parse_keys(settings.api_keys)
        self._rate = read_rate("PROTEUS_RATE_LIMIT", settings.rate_limit)
        self._attempts = read_rate("PROTEUS_KEY_ATTEMPTS", settings.key_attempts)
        self._counts = open_counts(settings)

    @property
    def has_keys(self) -> bool:
        """Whether requests need a key."""
        return bool(self._keys)

    @property
    def may_wait(self) -> bool:
        """Whether `admit` may wait for Redis."""
        return self._counts.may_wait

    def admit(self, token: str | None, scope: Scope, *, address: str) -> None:
        """Let a request in, or refuse it.

        Raises
        ------
        RefusedError
            401 without a valid key, 403 where it does not allow this, 429 when the client asks
            too often or has tried too many wrong keys.
        """
        client = _network_of(address)
        if not self._keys:
            self._count(f"address {client}")
            return
        key = None if token is None else self._check(token, client)
        self._count(f"key {key.identifier}" if key else f"address {client}")
        if key is None:
            detail = "the key is not valid" if token is not None else NEEDS_KEY
            raise RefusedError("unauthorized", 401, detail, {"WWW-Authenticate": "Bearer"})
        if scope not in key.scopes:
            raise RefusedError(
                "forbidden",
                403,
                f"this needs the scope {scope!r}, the key {key.identifier!r} has "
                f"{', '.join(sorted(key.scopes))}",
            )

    def close(self) -> None:
        """Let go of what the counts need."""
        self._counts.close()

    def _check(self, token: str, client: str) -> ApiKey | None:
        """Return the key of a token, or None and count the attempt."""
        parts = token.split("_", 2)
        named = self._keys.get(parts[1]) if len(parts) == 3 and parts[0] == PREFIX else None
        attempt = f"attempt {client} {named.identifier if named else ''}"
        if self._attempts is not None and (wait := self._counts.look(self._attempts, attempt)):
            detail = f"at most {self._attempts} wrong keys may be tried; try again in {wait} s"
            raise _too_many(detail, wait)
        known = named.digest if named is not None else "0" * 64
        if hmac.compare_digest(_digest(token), known):
            return named
        if self._attempts is not None:
            self._counts.take(self._attempts, attempt)
        return None

    def _count(self, client: str) -> None:
        if self._rate is not None and (wait := self._counts.take(self._rate, client)):
            raise _too_many(f"at most {self._rate} are allowed; try again in {wait} s", wait)


def requires(scope: Scope) -> Any:
    """Dependency that lets a request in only with this scope."""

    async def admit(
        request: Request,
        credentials: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)],
    ) -> None:
        gate: Gate = request.app.state.gate
        address = request.client.host if request.client else "local"
        token = credentials.credentials if credentials else None
        if gate.may_wait:
            await run_in_threadpool(gate.admit, token, scope, address=address)
        else:
            gate.admit(token, scope, address=address)

    dependency: Callable[..., Coroutine[Any, Any, None]] = admit
    return Depends(dependency)


READS = requires("read")
WRITES = requires("write")
ADMINISTERS = requires("admin")


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode(errors="surrogatepass")).hexdigest()


def _network_of(address: str) -> str:
    """Return what stands for a client: its IPv4 address, its IPv6 network, or the text itself."""
    try:
        known = ipaddress.ip_address(address)
    except ValueError:
        return address[:100]
    if isinstance(known, ipaddress.IPv4Address):
        return str(known)
    if known.ipv4_mapped is not None:
        return str(known.ipv4_mapped)
    return str(ipaddress.ip_network((int(known), IPV6_CLIENT_BITS), strict=False))


def _too_many(detail: str, seconds: int) -> RefusedError:
    return RefusedError("too-many-requests", 429, detail, {"Retry-After": str(seconds)})
