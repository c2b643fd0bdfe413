"""The Python client of the REST interface: errors as exceptions, repeated tries, paging."""

import time
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    import httpx  # where it runs, it comes with the first client: it brings rich and click along

Document = dict[str, Any]
"""A JSON object, as the service answers it."""

DEFAULT_URL = "http://127.0.0.1:8000"
RETRIED_STATUS = frozenset({429, 502, 503, 504})
"""Answers after which the same request may succeed: too many requests, or a service that is
just starting, perhaps behind a proxy."""
FIRST_PAUSE_SECONDS = 0.2
LONGEST_PAUSE_SECONDS = 3.0
PAGE_SIZE = 200


class ServiceError(Exception):
    """The service refused a request.

    Attributes
    ----------
    status : int
        HTTP status.
    problem : dict
        The RFC 9457 document; made from the status line where the answer held none.
    """

    def __init__(self, status: int, problem: Document) -> None:
        self.status = status
        self.problem = problem
        detail = problem.get("detail") or problem.get("title") or f"HTTP status {status}"
        super().__init__(str(detail))


class UnreachableError(Exception):
    """No service answers at the URL."""


class Client:
    """Talks to one service. Use it as a context manager, or close it.

    Parameters
    ----------
    url : str
        Where the service is, e.g. ``http://127.0.0.1:8000``.
    key : str
        API key, where the service asks for keys.
    patience_seconds : float
        How long to try again while the service cannot be reached or is just starting. Every
        request of the interface may be repeated: uploads are recognised by their content.
    transport : httpx.BaseTransport, optional
        Used in place of the network.

    Examples
    --------
    >>> with Client() as client:  # doctest: +SKIP
    ...     for shape in client.pages("/v1/collections/animals/shapes", label="cat"):
    ...         print(shape["name"])
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        key: str = "",
        *,
        patience_seconds: float = 0.0,
        transport: "httpx.BaseTransport | None" = None,
    ) -> None:
        import httpx

        self.url = url.rstrip("/")
        self.patience_seconds = patience_seconds
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        try:
            self._http = httpx.Client(
                base_url=self.url,
                headers={"User-Agent": "proteus", **headers},
                timeout=httpx.Timeout(90.0, connect=5.0),
                transport=transport,
                trust_env=not _is_this_machine(self.url),
            )
        except (httpx.InvalidURL, ValueError) as error:
            raise UnreachableError(f"{url!r} is no URL: {error}") from None

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def request(
        self,
        method: str,
        path: str,
        *,
        params: Mapping[str, Any] | None = None,
        json: object = None,
        data: Mapping[str, Any] | None = None,
        files: Any = None,
        headers: Mapping[str, str] | None = None,
    ) -> "httpx.Response":
        """Send a request and return its answer, whose status is below 400 (304 included).

        Parameters
        ----------
        method, path : str
            ``"GET"``, ``"/v1/collections"``.
        params : mapping, optional
            Of the URL; those that are None or empty are left out.
        json, data, files : optional
            The body, as httpx takes it.
        headers : mapping, optional

        Raises
        ------
        ServiceError
            The service refused it.
        UnreachableError
            No service answered within ``patience_seconds``.
        """
        import httpx

        until = time.monotonic() + self.patience_seconds
        pause = FIRST_PAUSE_SECONDS
        given = {k: v for k, v in (params or {}).items() if v is not None and v != ""}
        query = given or None  # httpx would replace the query of the path by an empty one
        while True:
            failure: Exception
            try:
                answer = self._http.request(
                    method, path, params=query, json=json, data=data, files=files, headers=headers
                )
                if answer.status_code < 400:
                    return answer
                failure = ServiceError(answer.status_code, _problem(answer))
                if answer.status_code not in RETRIED_STATUS:
                    raise failure
                pause = max(pause, retry_after(answer, default=0.0))
            except httpx.UnsupportedProtocol as error:
                raise UnreachableError(f"{self.url!r} is no http or https URL: {error}") from None
            except httpx.TransportError as error:
                reason = str(error) or type(error).__name__
                failure = UnreachableError(f"no Proteus service answers at {self.url} ({reason})")
            if time.monotonic() + pause > until:
                raise failure
            time.sleep(pause)
            pause = min(pause * 1.7, LONGEST_PAUSE_SECONDS)

    def get(self, path: str, /, **params: Any) -> Document:
        """Return the JSON object at a path."""
        return json_object(self.request("GET", path, params=params))

    def post(self, path: str, body: Mapping[str, Any] | None = None) -> Document:
        """Send a JSON object to a path, and return the JSON object that answers it."""
        return json_object(self.request("POST", path, json=body))

    def pages(self, path: str, /, *, limit: int | None = None, **params: Any) -> Iterator[Document]:
        """Iterate over the items of a paged list, at most ``limit`` of them."""
        left = limit
        cursor: str | None = None
        while left is None or left > 0:
            size = PAGE_SIZE if left is None else min(PAGE_SIZE, left)
            page = self.get(path, limit=size, cursor=cursor, **params)
            items = page["items"][:left]
            yield from items
            left = None if left is None else left - len(items)
            cursor = page.get("next_cursor")
            if not cursor:
                return


def json_object(answer: "httpx.Response") -> Document:
    """Return the JSON object of an answer.

    Raises
    ------
    ServiceError
        It is something else: another program may listen at the URL.
    """
    try:
        document = answer.json()
    except ValueError:
        document = None
    if not isinstance(document, dict):
        raise ServiceError(
            answer.status_code,
            {"title": "Not a Proteus service", "detail": f"{answer.url} answered no JSON object"},
        )
    return document


def retry_after(answer: "httpx.Response", *, default: float) -> float:
    """Return the seconds of ``Retry-After``; the default where it is absent or a date."""
    try:
        return float(answer.headers.get("Retry-After", default))
    except ValueError:
        return default


def _is_this_machine(url: str) -> bool:
    """Whether the URL is of this machine, where no proxy stands between."""
    host = urlsplit(url).hostname or ""
    return host in {"localhost", "::1", "0.0.0.0"} or host.startswith("127.")


def _problem(answer: "httpx.Response") -> Document:
    """Return the problem document of a refusal, or one made from its status line."""
    try:
        problem = answer.json()
    except ValueError:
        problem = None
    if isinstance(problem, dict) and ("detail" in problem or "title" in problem):
        return problem
    title = answer.reason_phrase or "refused"
    return {
        "type": "about:blank",
        "title": title,
        "status": answer.status_code,
        "detail": f"{answer.request.method} {answer.url}: {answer.status_code} {title}",
    }
