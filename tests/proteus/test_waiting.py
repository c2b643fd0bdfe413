"""The bar of a command that waits says what the service is at."""

import io

import httpx
from rich.console import Console

from proteus.client import Client
from proteus.terminal.output import Output
from proteus.terminal.waiting import wait_for_job


def test_the_bar_names_the_step_in_words() -> None:
    told = iter(["reading", "spectrum", "polishing", None])

    def answer(_request: httpx.Request) -> httpx.Response:
        step = next(told)
        state = "succeeded" if step is None else "running"
        return httpx.Response(200, json={**job, "step": step, "state": state})

    job = {"id": "j", "state": "queued", "progress": {"done": 0, "total": 1, "unit": "meshes"}}
    screen = io.StringIO()
    output = Output(messages=Console(file=screen, force_terminal=True, width=120))
    with Client(transport=httpx.MockTransport(answer)) as client:
        ended = wait_for_job(client, output, job, title="cat.ply")
    assert ended["state"] == "succeeded"
    for words in ("reading the mesh", "computing its spectrum", "polishing"):
        assert f"cat.ply: {words}" in screen.getvalue()
