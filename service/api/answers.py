"""What answers have in common: where a job is, and whether the client has the bytes already."""

import re
from urllib.parse import quote

from fastapi import Request, Response

from workers.storage.jobs import ENDED
from workers.storage.models import Job

RETRY_SECONDS = 1


def describe_job(response: Response, job: Job, *, ended: int = 200) -> None:
    """Set status and headers of an answer that has a job.

    Parameters
    ----------
    ended : int
        Status once the job has ended; 202 before.
    """
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    if job.state in ENDED:
        response.status_code = ended
    else:
        response.status_code = 202
        response.headers["Retry-After"] = str(RETRY_SECONDS)


def is_known(request: Request, tag: str) -> bool:
    """Whether the client named this ETag in If-None-Match; weak ones count as well."""
    given = request.headers.get("if-none-match", "")
    tags = [entry.strip().removeprefix("W/") for entry in given.split(",")]
    return tag in tags or "*" in tags


def not_modified(tag: str) -> Response:
    """Answer that the client has it already."""
    return Response(status_code=304, headers={"ETag": tag, "Cache-Control": "no-cache"})


def file_response(data: bytes, *, media_type: str, tag: str, name: str | None = None) -> Response:
    """Answer bytes, to be saved under a name that no browser or shell can misread."""
    headers = {"ETag": tag, "Cache-Control": "no-cache"}
    if name is not None:
        plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name).lstrip(".") or "file"
        headers["Content-Disposition"] = (
            f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name, safe='')}"
        )
    return Response(data, media_type=media_type, headers=headers)
