"""Freeing what is no longer needed over HTTP."""

import os
import time

from service.security import new_key
from tests.service.conftest import Start
from tests.service.running import Api
from workers.storage.pruning import KINDS


def make_old(api: Api) -> None:
    """Let all blobs look as if they were a year old."""
    for path in (api.settings.data_path / "blobs").rglob("*"):
        os.utime(path, (time.time() - 365 * 86_400,) * 2)


def test_what_can_be_freed_is_shown_then_freed_by_a_job(zoo: Api) -> None:
    name, shape_id = next(iter(zoo.shape_ids.items()))
    zoo.delete(f"/v1/shapes/{shape_id}")
    make_old(zoo)
    shown = zoo.get("/v1/prune")
    kinds = {kind["kind"]: kind for kind in shown["kinds"]}
    assert list(kinds) == list(KINDS)
    assert (kinds["meshes"]["count"], kinds["meshes"]["kept_days"]) == (1, 7.0)
    assert shown["count"] == sum(kind["count"] for kind in kinds.values()) > 3
    assert shown["bytes"] == sum(kind["bytes"] for kind in kinds.values()) > 0
    assert zoo.get("/v1/prune") == shown, name
    job = zoo.post("/v1/prune", 202)["job"]
    assert (job["kind"], job["result"]) == ("prune", None)
    assert zoo.post("/v1/prune", 202)["job"]["id"] == job["id"]
    zoo.work()
    ended = zoo.get(f"/v1/jobs/{job['id']}")
    assert (ended["state"], ended["progress"]["done"]) == ("succeeded", len(KINDS))
    assert ended["result"]["count"] >= shown["count"]
    assert zoo.get("/v1/jobs?kind=prune")["items"] == [ended]
    assert zoo.get("/v1/prune")["count"] == 0
    for left in list(zoo.shape_ids.values())[1:]:
        assert zoo.get(f"/v1/shapes/{left}/mesh")
        assert zoo.get(f"/v1/shapes/{left}/thumbnail.png")
        assert zoo.get(f"/v1/shapes/{left}/spectrum")


def test_one_may_wait_for_the_end(zoo: Api) -> None:
    with zoo.worker():
        job = zoo.post("/v1/prune?wait=60", 200)["job"]
    assert job["state"] == "succeeded"


def test_only_an_administrator_may_free(start: Start) -> None:
    admin, admin_setting = new_key("boss", ["admin"])
    writer, writer_setting = new_key("web", ["write"])
    api = start(api_keys=f"{admin_setting},{writer_setting}")
    for method in (api.get, api.post):
        method("/v1/prune", 403, headers={"Authorization": f"Bearer {writer}"})
        method("/v1/prune", 401)
    api.get("/v1/prune", headers={"Authorization": f"Bearer {admin}"})
    api.post("/v1/prune", 202, headers={"Authorization": f"Bearer {admin}"})
