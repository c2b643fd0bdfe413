"""Collections: names, counts, changes, and the model they are searched under."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.service.running import Api


def test_a_collection_is_made_once_and_found_by_its_name(api: Api) -> None:
    made = api.post("/v1/collections", 201, json={"name": "zoo", "description": "animals"})
    assert made["model"] == "heat"
    assert (made["shape_count"], made["ready_count"], made["failed_count"]) == (0, 0, 0)
    assert made["created_at"].endswith("Z")
    assert api.get("/v1/collections/zoo") == made
    problem = api.post("/v1/collections", 409, json={"name": "zoo"})
    assert problem["type"] == "/problems/name-taken"


def test_of_many_that_make_the_same_collection_one_succeeds(api: Api) -> None:
    def make(_: int) -> int:
        answer = api.client.post("/v1/collections", json={"name": "zoo"})
        return int(answer.status_code)

    with ThreadPoolExecutor(8) as pool:
        statuses = sorted(pool.map(make, range(8)))
    assert statuses == [201] + [409] * 7


@pytest.mark.parametrize("name", ["", "Zoo", "-zoo", "zoo/../x", "z" * 64, "zoo\n", "zö", 7, None])
def test_names_are_small_and_plain(api: Api, name: object) -> None:
    problem = api.post("/v1/collections", 422, json={"name": name})
    assert problem["detail"].startswith("name: ")


def test_an_unknown_model_makes_no_collection(api: Api) -> None:
    problem = api.post("/v1/collections", 404, json={"name": "zoo", "model": "magic"})
    assert problem["type"] == "/problems/model-not-found"
    assert api.get("/v1/collections")["items"] == []


def test_pages_hold_every_collection_once_in_order_of_names(api: Api) -> None:
    names = [f"c{n:02}" for n in range(7)]
    for name in reversed(names):
        api.post("/v1/collections", 201, json={"name": name})
    seen: list[str] = []
    cursor = None
    while True:
        page = api.get("/v1/collections", params={"limit": 3, "cursor": cursor})
        seen += [item["name"] for item in page["items"]]
        cursor = page["next_cursor"]
        if cursor is None:
            break
    assert seen == names


def test_a_change_leaves_alone_what_it_does_not_name(api: Api) -> None:
    api.post("/v1/collections", 201, json={"name": "zoo", "description": "animals"})
    renamed = api.patch("/v1/collections/zoo", json={"name": "park"})
    assert (renamed["name"], renamed["description"]) == ("park", "animals")
    assert api.patch("/v1/collections/park", json={"description": None})["description"] == ""
    api.get("/v1/collections/zoo", 404)
    api.post("/v1/collections", 201, json={"name": "zoo"})
    assert api.patch("/v1/collections/park", 409, json={"name": "zoo"})
    api.patch("/v1/collections/park", 422, json={"name": None})
    problem = api.patch("/v1/collections/park", 422, json={"model": "heat"})
    assert "model" in problem["detail"]


def test_jobs_follow_a_collection_that_is_renamed(zoo: Api) -> None:
    zoo.patch("/v1/collections/zoo", json={"name": "park"})
    assert len(zoo.get("/v1/jobs", params={"collection": "park"})["items"]) == 1
    assert zoo.get("/v1/jobs", params={"collection": "zoo"})["items"] == []


def test_counts_tell_ready_from_failed(zoo: Api) -> None:
    zoo.upload("zoo", {"none.off": b"OFF\n"})
    assert zoo.get("/v1/collections/zoo")["shape_count"] == 6
    zoo.work()
    found = zoo.get("/v1/collections/zoo")
    assert (found["shape_count"], found["ready_count"], found["failed_count"]) == (6, 5, 1)


def test_a_deleted_collection_takes_its_shapes_with_it(zoo: Api) -> None:
    shape = next(iter(zoo.shape_ids.values()))
    zoo.ask("zoo", shape_id=shape)
    zoo.services.indexes.close()
    assert list((zoo.settings.data_path / "cache").glob("*.index"))
    zoo.delete("/v1/collections/zoo")
    zoo.get("/v1/collections/zoo", 404)
    zoo.get(f"/v1/shapes/{shape}", 404)
    zoo.delete("/v1/collections/zoo", 404)
    assert not list((zoo.settings.data_path / "cache").glob("*.index"))
    zoo.post("/v1/collections", 201, json={"name": "zoo"})
    assert zoo.get("/v1/collections/zoo")["shape_count"] == 0


def test_a_collection_moves_when_all_is_described_and_not_before(zoo: Api) -> None:
    shape = zoo.shape_ids["ball.null.0.off"]
    path = "/v1/collections/zoo/model"
    job = zoo.put(path, json={"model": "shape-dna"})["job"]
    assert (job["kind"], job["state"], job["progress"]["total"]) == ("describe", "queued", 5)
    assert zoo.ask("zoo", shape_id=shape)["model"] == "heat"
    zoo.work()
    assert zoo.get("/v1/collections/zoo")["model"] == "shape-dna"
    assert zoo.get(f"/v1/jobs/{job['id']}")["state"] == "succeeded"
    assert zoo.ask("zoo", shape_id=shape)["model"] == "shape-dna"
    assert zoo.ask("zoo", shape_id=shape, model="heat")["model"] == "heat"
    with zoo.worker():  # back again: nothing is left to describe
        back = zoo.put(f"{path}?wait=20", 200, json={"model": "heat"})["job"]
    assert (back["state"], back["progress"]["total"]) == ("succeeded", 0)


def test_a_move_to_nowhere_is_refused(zoo: Api) -> None:
    zoo.put("/v1/collections/zoo/model", 404, json={"model": "magic"})
    zoo.put("/v1/collections/none/model", 404, json={"model": "heat"})
    zoo.put("/v1/collections/zoo/model", 422, json={})
    zoo.put("/v1/collections/zoo/model?wait=61", 422, json={"model": "heat"})
