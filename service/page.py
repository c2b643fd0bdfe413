"""The page at ``/``: what was built of ``service/web``, read once at the start.

Nobody needs a key for it; what it asks of the service does.
"""

import gzip
import hashlib
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from starlette.exceptions import HTTPException

from service.api.answers import is_known
from service.compression import accepts_gzip

FOLDER = Path(__file__).parent / "web" / "dist"
ASSETS = "assets"
INDEX = "index.html"
METHODS = ["GET", "HEAD"]
ASK_AGAIN = "no-cache"
KEEP = "public, max-age=31536000, immutable"
TEXTS = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".css": "text/css",
    ".txt": "text/plain",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".map": "application/json",
    ".webmanifest": "application/manifest+json",
}
"""Types that are sent compressed, by the file's ending."""

OTHERS = {
    ".wasm": "application/wasm",
    ".woff2": "font/woff2",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".webp": "image/webp",
    ".ico": "image/x-icon",
    ".glb": "model/gltf-binary",
    ".zip": "application/zip",
}
ALLOWED = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "font-src 'self'; connect-src 'self' blob:; worker-src 'self' blob:; form-action 'none'; "
    "frame-ancestors 'none'; base-uri 'none'"
)
GUARDED = {
    "Content-Security-Policy": ALLOWED,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
"""Headers of the page itself: it runs nothing but its own files, and stands in no frame."""

NOT_BUILT = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Proteus</title>
</head>
<body>
<h1>Proteus</h1>
<p>The page was not built in this checkout: <code>make page</code> builds it, then start again.</p>
<p>The service itself is there, and so is its <a href="docs">documentation</a>.</p>
</body>
</html>
"""


@dataclass(frozen=True)
class PageFile:
    """A file of the page, as it is sent.

    Attributes
    ----------
    plain : bytes
    zipped : bytes or None
        The same compressed by gzip, of texts.
    media_type : str
    tag : str
        Of the content, without quotes.
    headers : Mapping
        Sent with every answer.
    """

    plain: bytes
    zipped: bytes | None
    media_type: str
    tag: str
    headers: Mapping[str, str]

    def answer(self, request: Request) -> Response:
        """Send it as the client takes it, or say that the client has it already."""
        zipped = self.zipped
        if zipped is not None and not accepts_gzip(request.headers.get("accept-encoding", "")):
            zipped = None
        tag = f'"{self.tag}"' if zipped is None else f'"{self.tag}.gz"'
        headers = {"ETag": tag, **self.headers}
        if is_known(request, tag):
            return Response(status_code=304, headers=headers)
        if zipped is not None:
            headers["Content-Encoding"] = "gzip"
        return Response(zipped or self.plain, media_type=self.media_type, headers=headers)


def page_file(name: str, content: bytes) -> PageFile:
    """Prepare a file of the page by its name below the folder."""
    ending = Path(name).suffix.lower()
    is_text = ending in TEXTS
    headers = {"Cache-Control": KEEP if name.startswith(f"{ASSETS}/") else ASK_AGAIN}
    if is_text:
        headers["Vary"] = "Accept-Encoding"
    if name == INDEX:
        headers |= GUARDED
    return PageFile(
        plain=content,
        zipped=gzip.compress(content, mtime=0) if is_text else None,
        media_type=TEXTS.get(ending) or OTHERS.get(ending, "application/octet-stream"),
        tag=hashlib.sha256(content).hexdigest()[:32],
        headers=headers,
    )


def read_page(folder: Path) -> dict[str, PageFile]:
    """Files of the built page by their names below a folder, but for hidden ones.

    Without an index there is one that says so.
    """
    paths = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    files = {
        path.as_posix(): page_file(path.as_posix(), (folder / path).read_bytes())
        for path in sorted(paths)
        if not any(part.startswith(".") for part in path.parts)
    }
    return {INDEX: page_file(INDEX, NOT_BUILT.encode()), **files}


def add_page(app: FastAPI, folder: Path) -> None:
    """Serve the page at ``/`` and its files below it; routes that there are already go first."""
    files = read_page(folder)

    async def asset(request: Request, name: str) -> Response:
        found = files.get(f"{ASSETS}/{name}")
        if found is None:
            raise HTTPException(404)
        return found.answer(request)

    for name, file in {**files, "": files[INDEX]}.items():
        if not name.startswith(f"{ASSETS}/"):
            app.add_api_route(f"/{name}", _answers(file), methods=METHODS, include_in_schema=False)
    app.add_api_route(f"/{ASSETS}/{{name:path}}", asset, methods=METHODS, include_in_schema=False)


def _answers(file: PageFile) -> Callable[[Request], Coroutine[Any, Any, Response]]:
    async def show(request: Request) -> Response:
        return file.answer(request)

    return show
