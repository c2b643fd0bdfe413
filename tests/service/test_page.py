"""The page at the root: its files, how they are compressed and kept, and what it may do."""

import gzip
from collections.abc import Mapping
from pathlib import Path

import httpx
import pytest

from service.compression import accepts_gzip
from service.page import page_file
from service.security import new_key
from tests.service.conftest import Start
from tests.service.running import Api, checked

SCRIPT = b"console.log('proteus');\n" * 50
INDEX = b'<!doctype html><script type="module" src="/assets/index-4f0c9b0e.js"></script>'
ICON = b'<svg xmlns="http://www.w3.org/2000/svg"/>'
BUILT: Mapping[str, bytes] = {
    "index.html": INDEX,
    "favicon.svg": ICON,
    "docs": b"not the documentation",
    ".hidden": b"secret",
    "assets/index-4f0c9b0e.js": SCRIPT,
    "assets/index-4f0c9b0e.css": b"body { margin: 0 }",
    "assets/fonts/sans-1d4a4a52.woff2": b"\0\1\2\3",
    ".other/file.txt": b"not served",
}
YEAR = "public, max-age=31536000, immutable"
TYPES = {
    "/": "text/html; charset=utf-8",
    "/index.html": "text/html; charset=utf-8",
    "/favicon.svg": "image/svg+xml",
    "/assets/index-4f0c9b0e.js": "text/javascript; charset=utf-8",
    "/assets/index-4f0c9b0e.css": "text/css; charset=utf-8",
    "/assets/fonts/sans-1d4a4a52.woff2": "font/woff2",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page that was built."""
    folder = tmp_path / "dist"
    for name, content in BUILT.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    monkeypatch.setattr("service.page.FOLDER", folder)
    return folder


@pytest.fixture
def site(folder: Path, start: Start) -> Api:
    return start()


def get(api: Api, path: str, **headers: str) -> httpx.Response:
    given = {"Accept-Encoding": "identity"} | {
        name.replace("_", "-"): value for name, value in headers.items()
    }
    answer: httpx.Response = api.client.get(path, headers=given, follow_redirects=False)
    return answer


def test_files_come_as_they_were_built(site: Api) -> None:
    for path, kind in TYPES.items():
        answer = get(site, path)
        assert answer.status_code == 200, path
        assert answer.content == BUILT[path.removeprefix("/") or "index.html"]
        assert answer.headers["Content-Type"] == kind
        assert "Content-Encoding" not in answer.headers
        kept = YEAR if path.startswith("/assets/") else "no-cache"
        assert answer.headers["Cache-Control"] == kept
        assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_files_are_read_once(folder: Path, site: Api) -> None:
    (folder / "index.html").unlink()
    (folder / "assets/new.js").write_bytes(b"")
    assert get(site, "/").content == INDEX
    site.get("/assets/new.js", 404)


def test_texts_are_compressed_for_who_takes_gzip_and_always_alike(site: Api) -> None:
    path = "/assets/index-4f0c9b0e.js"
    plain, packed = get(site, path), get(site, path, Accept_Encoding="br, gzip;q=0.5")
    assert packed.headers["Content-Encoding"] == "gzip"
    assert packed.content == SCRIPT
    assert int(packed.headers["Content-Length"]) < len(SCRIPT) / 5
    assert packed.headers["ETag"] != plain.headers["ETag"]
    assert plain.headers["Vary"] == packed.headers["Vary"] == "Accept-Encoding"
    font = get(site, "/assets/fonts/sans-1d4a4a52.woff2", Accept_Encoding="gzip")
    assert "Content-Encoding" not in font.headers
    assert "Vary" not in font.headers
    first, second = (page_file("a.js", SCRIPT).zipped for _ in range(2))
    assert first is not None
    assert (first, first[4:8]) == (second, bytes(4))  # the time of the header is 0
    assert gzip.decompress(first) == SCRIPT


@pytest.mark.parametrize(
    ("header", "accepted"),
    [
        ("gzip", True),
        ("GZIP", True),
        ("deflate, gzip;q=1.0, *;q=0.5", True),
        ("br;q=1, *", True),
        ("", False),
        ("identity", False),
        ("gzip;q=0", False),
        ("gzip; q=0.000, *", False),
        ("gzip;q=much", False),
        ("*;q=0", False),
        ("xgzip, gzip-not", False),
        (",;,=;q=", False),
    ],
)
def test_gzip_is_taken_by_whom_it_says(header: str, accepted: bool) -> None:
    assert accepts_gzip(header) is accepted


@pytest.mark.parametrize("coding", ["identity", "gzip"])
@pytest.mark.parametrize("path", ["/", "/favicon.svg", "/assets/index-4f0c9b0e.js"])
def test_what_the_client_has_is_not_sent_again(site: Api, path: str, coding: str) -> None:
    first = get(site, path, Accept_Encoding=coding)
    tag = first.headers["ETag"]
    again = get(site, path, Accept_Encoding=coding, If_None_Match=tag)
    assert (again.status_code, again.content) == (304, b"")
    for name in ("ETag", "Cache-Control", "Vary"):
        assert again.headers[name] == first.headers[name]
    assert get(site, path, Accept_Encoding=coding, If_None_Match='"x"').status_code == 200


def test_the_page_runs_nothing_but_its_own_files(site: Api) -> None:
    for path in ("/", "/index.html"):
        headers = get(site, path).headers
        allowed = dict(
            part.strip().split(" ", 1) for part in headers["Content-Security-Policy"].split(";")
        )
        assert allowed == {
            "default-src": "'none'",
            "script-src": "'self'",
            "style-src": "'self'",
            "img-src": "'self' blob: data:",
            "font-src": "'self'",
            "connect-src": "'self' blob:",
            "worker-src": "'self' blob:",
            "form-action": "'none'",
            "frame-ancestors": "'none'",
            "base-uri": "'none'",
        }
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers.get_list("X-Content-Type-Options") == ["nosniff"]


def test_a_head_has_the_headers_and_no_body(site: Api) -> None:
    for path in ("/", "/favicon.svg", "/assets/index-4f0c9b0e.js"):
        head = site.client.head(path)
        whole = site.client.get(path)
        assert (head.status_code, head.content) == (200, b"")
        for name in ("Content-Length", "Content-Type", "ETag", "Cache-Control"):
            assert head.headers[name] == whole.headers[name]
    assert site.client.head("/assets/none.js").status_code == 404


@pytest.mark.parametrize(
    "path",
    [
        *("/none.js", "/assets", "/assets/", "/assets/none.js", "/assets/fonts"),
        *("/.hidden", "/.other/file.txt", "/assets/index.html", "/assets//index-4f0c9b0e.js"),
        *("/assets/../index.html", "/assets/%2e%2e/index.html", "/assets/..%2findex.html"),
        *("/assets/%2e%2e/%2e%2e/%2e%2e/etc/passwd", "/assets/%2fetc/passwd", "/%2fetc/passwd"),
        *("/assets/%00", "/assets/..%5cindex.html", "/assets/%ff"),
    ],
)
def test_nothing_else_is_there(site: Api, path: str) -> None:
    url = httpx.URL("http://testserver").copy_with(raw_path=path.encode())  # not made simpler
    answer = site.client.get(url)
    if answer.status_code == 200:  # the client took the dots away by itself
        assert (path, answer.content) == ("/assets/../index.html", INDEX)
        return
    assert checked(answer, 404)["type"] == "/problems/not-found"


def test_the_service_is_where_it_was(site: Api) -> None:
    assert "swagger" in get(site, "/docs").text
    assert site.get("/healthz") == {"status": "ok"}
    assert not [path for path in site.get("/openapi.json")["paths"] if path in TYPES]
    assert "expected" in site.post("/", 405)["detail"]
    site.post("/assets/index-4f0c9b0e.js", 405)


def test_nobody_needs_a_key_for_the_page(folder: Path, start: Start) -> None:
    _, setting = new_key("ci", ["read"])
    api = start(api_keys=setting, rate_limit="1/hour")
    for _ in range(2):
        for path in TYPES:
            assert get(api, path).status_code == 200
    api.get("/v1/models", 401)


def test_a_page_that_was_not_built_says_so(api: Api) -> None:
    answer = get(api, "/")
    assert (answer.status_code, answer.headers["Content-Type"]) == (200, TYPES["/"])
    assert "not built" in answer.text
    assert "make page" in answer.text
    assert 'href="docs"' in answer.text
    assert "<script" not in answer.text
    assert "style" not in answer.text
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert get(api, "/", If_None_Match=answer.headers["ETag"]).status_code == 304
    api.get("/assets/index.js", 404)
