"""Jobs of the service: followed to their end, and why one failed."""

import time
from collections.abc import Iterator

from proteus.client import Client, Document, json_object, retry_after

STEPS = {
    "reading": "reading the mesh",
    "simplifying": "simplifying the mesh",
    "spectrum": "computing its spectrum",
    "describing": "describing it",
    "matching": "matching its points",
}
"""What is done with a mesh, in words; other steps are named as they are."""

ENDED = frozenset({"succeeded", "failed", "cancelled"})
SHORTEST_PAUSE_SECONDS = 0.1
FIRST_PAUSE_SECONDS = 0.3
LONGEST_PAUSE_SECONDS = 2.0


class JobWatch:
    """Follows one job by polling. Its ETag makes an unchanged job cheap to ask for.

    Parameters
    ----------
    client : Client
        Of the service that has the job.
    job : dict
        The job as it was last seen.
    """

    def __init__(self, client: Client, job: Document) -> None:
        self._client = client
        self._etag = ""
        self.job = job
        self.pause_seconds = FIRST_PAUSE_SECONDS

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.job["state"] in ENDED

    def poll(self) -> Document:
        """Ask once, unless it has ended, and return the job as it is now."""
        if self.ended:
            return self.job
        headers = {"If-None-Match": self._etag} if self._etag else {}
        answer = self._client.request("GET", f"/v1/jobs/{self.job['id']}", headers=headers)
        self._etag = answer.headers.get("ETag", "")
        pause = retry_after(answer, default=FIRST_PAUSE_SECONDS)
        self.pause_seconds = min(max(pause, SHORTEST_PAUSE_SECONDS), LONGEST_PAUSE_SECONDS)
        if answer.status_code != 304:
            self.job = json_object(answer)
        return self.job

    def changes(self) -> Iterator[Document]:
        """Iterate over the job's states until it has ended."""
        yield self.job
        while not self.ended:
            time.sleep(self.pause_seconds)
            yield self.poll()


def step_of(job: Document) -> str:
    """Return what a job is at, in words; empty where that is not known."""
    step = str(job.get("step") or "")  # a service of an earlier version tells none
    return STEPS.get(step, step)


def failure_of(job: Document) -> str:
    """Return in one line why a job did not succeed: its first error, and how many there are."""
    reasons = [f"{e['item']}: {e['detail']}" for e in job["errors"]] or ["no reason given"]
    more = f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else ""
    return f"the job {job['id']} {job['state']}: {reasons[0]}{more}"
