"""Jobs: progress by ETag and by events, cancelling, retrying."""

import json
import threading
import time

import pytest
from sqlalchemy import select

from service.api import jobs as jobs_api
from service.waiting import read_job
from tests.meshes import bumpy_sphere
from tests.service.running import DIE, EGG, GEM, Api, Json, off
from workers.pipeline.overtime import fail_overtime
from workers.pipeline.workbench import Workbench
from workers.storage.database import Database
from workers.storage.models import Job, Part
from workers.storage.parts import claim_part
from workers.storage.watching import store_step


@pytest.fixture
def job(zoo: Api) -> Json:
    """A queued job over two shapes, one of which is no mesh."""
    accepted: Json = zoo.upload("zoo", {"egg.off": EGG, "bad.off": b"x"})["job"]
    return accepted


def events_of(text: str) -> list[tuple[str, Json]]:
    """Ids and data of a stream of events."""
    found = []
    for block in text.strip().split("\n\n"):
        fields = dict(
            line.split(": ", 1) for line in block.splitlines() if not line.startswith(":")
        )
        if fields:
            assert fields["event"] == "job"
            found.append((fields["id"], json.loads(fields["data"])))
    return found


def test_a_job_tells_its_progress_and_when_to_ask_again(zoo: Api, job: Json) -> None:
    path = f"/v1/jobs/{job['id']}"
    waiting = zoo.client.get(path)
    assert waiting.json() == job
    assert int(waiting.headers["Retry-After"]) > 0
    tag = {"If-None-Match": waiting.headers["ETag"]}
    assert zoo.client.get(path, headers=tag).status_code == 304
    zoo.work()
    ended = zoo.client.get(path, headers=tag)
    assert ended.status_code == 200
    assert "Retry-After" not in ended.headers
    found = ended.json()
    assert (found["state"], found["attempts"]) == ("succeeded", 1)
    assert found["progress"] == {"done": 2, "total": 2, "unit": "shapes"}
    assert [error["item"] for error in found["errors"]] == ["bad.off"]
    assert found["created_at"] <= found["started_at"] <= found["finished_at"]


def test_a_job_says_what_is_done_now_and_its_watchers_hear_of_it(zoo: Api) -> None:
    accepted = zoo.ask_mesh("zoo", off(bumpy_sphere(2, seed=9)), 202)
    path = f"/v1/jobs/{accepted['job']['id']}"
    assert accepted["job"]["step"] is None
    with zoo.services.database.begin() as session:
        part = session.scalars(select(Part.id).where(Part.job_id == accepted["job"]["id"])).one()
        claim_part(session, part, message="m", now=time.time(), lease_seconds=30)
    tag = {"If-None-Match": zoo.client.get(path).headers["ETag"]}
    with zoo.services.database.begin() as session:
        store_step(session, accepted["job"]["id"], "spectrum")
    assert zoo.client.get(path, headers=tag).json()["step"] == "spectrum"
    query = zoo.get(f"/v1/queries/{accepted['query_id']}", 202)
    assert query["job"]["step"] == "spectrum"
    assert zoo.post(f"{path}/cancel")["step"] is None


def test_a_query_that_took_too_long_says_so(zoo: Api) -> None:
    accepted = zoo.ask_mesh("zoo", off(bumpy_sphere(2, seed=10)), 202)
    with zoo.services.database.begin() as session:
        part = session.scalars(select(Part.id).where(Part.job_id == accepted["job"]["id"])).one()
        claim = claim_part(session, part, message="m", now=time.time(), lease_seconds=30)
    assert claim is not None
    bench = Workbench(
        zoo.services.database, zoo.services.blobs, zoo.settings, zoo.services.dispatcher.send
    )
    assert fail_overtime(bench, part, claim.owner, shape_id=None, step="spectrum")
    assert not fail_overtime(bench, part, claim.owner, shape_id=None, step="spectrum")
    problem = zoo.get(f"/v1/queries/{accepted['query_id']}", 422)
    assert problem["type"] == "/problems/time-limit"
    assert "'spectrum'" in problem["detail"]
    assert "PROTEUS_SHAPE_SECONDS" in problem["detail"]


def test_lists_are_filtered_and_begin_with_the_newest(zoo: Api, job: Json) -> None:
    zoo.put("/v1/collections/zoo/model", json={"model": "biharmonic"})
    kinds = [item["kind"] for item in zoo.get("/v1/jobs")["items"]]
    assert kinds == ["describe", "ingest", "ingest"]
    ingests = zoo.get("/v1/jobs", params={"kind": "ingest", "state": "queued"})["items"]
    assert [item["id"] for item in ingests] == [job["id"]]
    assert zoo.get("/v1/jobs", params={"collection": "other"})["items"] == []
    page = zoo.get("/v1/jobs", params={"limit": 2})
    rest = zoo.get("/v1/jobs", params={"limit": 2, "cursor": page["next_cursor"]})
    assert (len(rest["items"]), rest["next_cursor"]) == (1, None)
    for wrong in ({"kind": "magic"}, {"state": "lost"}, {"collection": "\x00"}):
        zoo.get("/v1/jobs", 422, params=wrong)


def test_a_cancelled_job_computes_nothing_more_and_can_be_retried(zoo: Api, job: Json) -> None:
    path = f"/v1/jobs/{job['id']}"
    cancelled = zoo.post(f"{path}/cancel")
    assert cancelled["state"] == "cancelled"
    assert zoo.work() == 0
    problem = zoo.post(f"{path}/cancel", 409)
    assert problem["type"] == "/problems/conflict"
    again = zoo.post(f"{path}/retry")
    assert (again["state"], again["progress"]["done"]) == ("queued", 0)
    assert len(zoo.services.dispatcher.sent) == 4  # type: ignore[attr-defined]
    zoo.post(f"{path}/retry", 409)
    assert zoo.work() == 2
    failed_again = zoo.post(f"{path}/retry")
    assert failed_again["errors"] == []
    assert zoo.work() == 1
    assert zoo.get(path)["errors"][0]["item"] == "bad.off"


def test_a_worker_that_lost_its_job_stores_nothing(zoo: Api) -> None:
    """A job is cancelled while a worker has one of its parts."""
    job = zoo.upload("zoo", {"egg.off": EGG})["job"]
    part = zoo.services.dispatcher.sent[-1]  # type: ignore[attr-defined]
    with zoo.services.database.begin() as session:
        assert claim_part(session, part, message="m", now=0.0, lease_seconds=1e9)
    zoo.post(f"/v1/jobs/{job['id']}/cancel")
    assert zoo.work() == 0
    assert zoo.get("/v1/collections/zoo")["failed_count"] == 1


def test_the_events_of_a_job_end_with_its_last_state(
    zoo: Api, job: Json, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = threading.Event()

    def read_and_tell(database: Database, job_id: str) -> Job:
        found = read_job(database, job_id)
        watched.set()
        return found

    def work() -> None:
        watched.wait()
        zoo.work()

    monkeypatch.setattr(jobs_api, "read_job", read_and_tell)
    worker = threading.Thread(target=work)
    worker.start()
    answer = zoo.client.get(f"/v1/jobs/{job['id']}/events")
    worker.join()
    assert answer.headers["Content-Type"].startswith("text/event-stream")
    events = events_of(answer.text)
    assert events[0][1] == job
    assert events[-1][1] == zoo.get(f"/v1/jobs/{job['id']}")
    assert events[-1][1]["state"] == "succeeded"
    numbers = [int(number) for number, _ in events]
    assert numbers == sorted(set(numbers))


def test_a_browser_that_saw_the_end_is_told_to_stay_away(zoo: Api, job: Json) -> None:
    path = f"/v1/jobs/{job['id']}/events"
    zoo.work()
    ((number, _),) = events_of(zoo.client.get(path).text)
    assert zoo.client.get(path, headers={"Last-Event-ID": number}).status_code == 204
    assert zoo.client.get(path, headers={"Last-Event-ID": "1"}).status_code == 200
    zoo.get("/v1/jobs/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c/events", 404)


def test_many_may_watch_and_wait_at_once(zoo: Api) -> None:
    """More than there are threads: waiting must not hold one."""
    job = zoo.upload("zoo", {"gem.off": GEM})["job"]
    statuses: list[int] = []

    def watch() -> None:
        statuses.append(zoo.client.get(f"/v1/jobs/{job['id']}/events").status_code)

    def hold_on() -> None:
        answer = zoo.client.post(
            "/v1/collections/zoo/shapes?wait=50", files={"files": ("gem.off", GEM)}
        )
        statuses.append(answer.status_code)

    threads = [threading.Thread(target=watch) for _ in range(30)]
    threads += [threading.Thread(target=hold_on) for _ in range(30)]
    for thread in threads:
        thread.start()
    assert zoo.get("/healthz") == {"status": "ok"}
    zoo.upload("zoo", {"die.off": DIE})
    zoo.work()
    for thread in threads:
        thread.join()
    assert statuses == [200] * 60
