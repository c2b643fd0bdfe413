"""A thin client of the REST interface: errors as exceptions, patience with restarts, paging."""

import time
from collections.abc import Iterator, Mapping
from typing import Any

import httpx

Document = dict[str, Any]
"""A JSON object as the service answers it."""

DEFAULT_URL = "http://127.0.0.1:8000"
PASSING_STATUS = frozenset({502, 503, 504})
"""Answers of a service, or a proxy before it, that is just starting again."""
FIRST_PAUSE_SECONDS = 0.2
LONGEST_PAUSE_SECONDS = 3.0


class ServiceError(Exception):
    """The service refused a request.

    Attributes
    ----------
    status : int
        HTTP status.
    problem : dict
        The RFC 9457 document, made up from the status line where the answer was none.
    """

    def __init__(self, status: int, problem: Document) -> None:
        self.status = status
        self.problem = problem
        detail = problem.get("detail") or problem.get("title") or f"HTTP status {status}"
        super().__init__(str(detail))


class UnreachableError(Exception):
    """No service answers at the URL."""


class Client:
    """Talks to one service; use it as a context manager or close it.

    Parameters
    ----------
    url : str
        Where the service is, e.g. ``http://127.0.0.1:8000``.
    key : str
        API key, where the service asks for keys.
    patience_seconds : float
        How long to go on trying when the service cannot be reached or is just starting. All
        requests of the contract may be repeated: uploads are idempotent by content.
    transport : httpx.BaseTransport, optional
        Replaces the network.
    """

    def __init__(
        self,
        url: str = DEFAULT_URL,
        key: str = "",
        *,
        patience_seconds: float = 0.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self.url = url.rstrip("/")
        self.patience_seconds = patience_seconds
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        try:
            self._http = httpx.Client(
                base_url=self.url,
                headers={"User-Agent": "proteus-cli", **headers},
                timeout=httpx.Timeout(90.0, connect=5.0),
                transport=transport,
                trust_env=not _is_this_machine(self.url),
            )
        except (httpx.InvalidURL, UnicodeError) as error:
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
    ) -> httpx.Response:
        """Send a request and return its answer, whose status is below 400 (304 included).

        Raises
        ------
        ServiceError
            The service refused it.
        UnreachableError
            No service answered, for as long as the patience lasts.
        """
        until = time.monotonic() + self.patience_seconds
        pause = FIRST_PAUSE_SECONDS
        given = {k: v for k, v in (params or {}).items() if v is not None and v != ""}
        query = given or None  # an empty one would take away what the path asks
        while True:
            last: Exception
            try:
                answer = self._http.request(
                    method, path, params=query, json=json, data=data, files=files, headers=headers
                )
                if answer.status_code < 400:
                    return answer
                last = ServiceError(answer.status_code, _problem(answer))
                if answer.status_code not in PASSING_STATUS | {429}:
                    raise last
                pause = max(pause, _seconds(answer.headers.get("Retry-After"), default=0.0))
            except httpx.UnsupportedProtocol as error:
                raise UnreachableError(f"{self.url!r} is no http or https URL: {error}") from None
            except httpx.TransportError as error:
                last = UnreachableError(self._explain(error))
            if time.monotonic() + pause > until:
                raise last
            time.sleep(pause)
            pause = min(pause * 1.7, LONGEST_PAUSE_SECONDS)

    def get(self, path: str, **params: Any) -> Document:
        """Return the JSON object at a path."""
        return _document(self.request("GET", path, params=params))

    def pages(self, path: str, *, limit: int | None = None, **params: Any) -> Iterator[Document]:
        """Iterate over the items of a paged list, at most ``limit`` of them."""
        left = limit
        cursor: str | None = None
        while left is None or left > 0:
            size = 200 if left is None else min(200, left)
            page = self.get(path, limit=size, cursor=cursor, **params)
            items = page["items"][:left]
            yield from items
            left = None if left is None else left - len(items)
            cursor = page.get("next_cursor")
            if not cursor:
                return

    def _explain(self, error: httpx.TransportError) -> str:
        reason = str(error) or type(error).__name__
        return f"no Proteus service answers at {self.url} ({reason})"


class JobWatch:
    """Follows one job by asking for it again and again, cheaply by its ETag.

    Parameters
    ----------
    client : Client
        Where to ask.
    job : dict
        The job as it was last seen.
    """

    def __init__(self, client: Client, job: Document) -> None:
        self._client = client
        self._etag = ""
        self.job = job
        self.pause_seconds = 0.3

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.job["state"] in {"succeeded", "failed", "cancelled"}

    def poll(self) -> Document:
        """Ask once, unless it has ended, and return the job as it is now."""
        if self.ended:
            return self.job
        headers = {"If-None-Match": self._etag} if self._etag else {}
        answer = self._client.request("GET", f"/v1/jobs/{self.job['id']}", headers=headers)
        self._etag = answer.headers.get("ETag", "")
        told = _seconds(answer.headers.get("Retry-After"), default=0.3)
        self.pause_seconds = min(max(told, 0.1), 2.0)
        if answer.status_code != 304:
            self.job = _document(answer)
        return self.job

    def changes(self) -> Iterator[Document]:
        """Iterate over the job's states until it has ended."""
        yield self.job
        while not self.ended:
            time.sleep(self.pause_seconds)
            yield self.poll()


def _is_this_machine(url: str) -> bool:
    """Whether the URL is one that no proxy has to do with."""
    host = httpx.URL(url).host
    return host in {"localhost", "::1", "0.0.0.0"} or host.startswith("127.")


def _document(answer: httpx.Response) -> Document:
    """Return the answer's JSON object."""
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


def _problem(answer: httpx.Response) -> Document:
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


def _seconds(text: str | None, *, default: float) -> float:
    """Return a ``Retry-After`` in seconds; a date or nothing is the default."""
    try:
        return float(text) if text else default
    except ValueError:
        return default
