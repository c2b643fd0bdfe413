"""The main flow once more, on PostgreSQL."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.servers import postgres_database
from tests.service.conftest import Start
from tests.service.running import DIE, EGG, GEM, Api
from workers.storage.models import Shape

pytestmark = pytest.mark.server


@pytest.fixture
def park(start: Start, postgres: str) -> Iterator[Api]:
    """A service over a PostgreSQL database of its own, with the empty collection "zoo"."""
    with postgres_database(postgres) as url:
        api = start(database_url=url)
        api.post("/v1/collections", 201, json={"name": "zoo"})
        yield api
        api.services.database.dispose()


def test_from_upload_to_ranked_answer(park: Api, tmp_path: Path) -> None:
    files = {"egg.null.0.off": EGG, "gem.off": GEM, "none.off": b"x"}
    accepted = park.upload("zoo", files, data={"metadata": '{"year": 2024}'})
    assert park.work() == 3
    job = park.get(f"/v1/jobs/{accepted['job']['id']}")
    assert [error["item"] for error in job["errors"]] == ["none.off"]
    egg, gem, _ = (shape["id"] for shape in accepted["shapes"])
    wanted = {"must": [{"field": "metadata.year", "range": {"gte": 2024}}]}
    answer = park.ask("zoo", shape_id=egg, filter=wanted)
    assert [match["shape"]["id"] for match in answer["matches"]] == [gem]
    waiting = park.ask_mesh("zoo", DIE, 202)
    park.work()
    assert park.get(f"/v1/queries/{waiting['query_id']}")["searched"] == 2
    park.patch(f"/v1/shapes/{egg}", json={"label": "oval", "metadata": {"a": {"b": [1]}}})
    assert park.get("/v1/collections/zoo/shapes?label=oval")["items"][0]["id"] == egg
    park.put("/v1/collections/zoo/model", json={"model": "biharmonic"})
    park.work()
    assert park.get("/v1/collections/zoo")["model"] == "biharmonic"
    park.patch("/v1/collections/zoo", json={"name": "park"})
    park.delete(f"/v1/shapes/{gem}")
    assert park.ask("park", shape_id=egg)["searched"] == 0
    assert park.get("/readyz")["database"] == "ok"
    assert b"proteus_shapes 2.0" in park.get("/metrics")
    park.delete("/v1/collections/park")
    park.get(f"/v1/shapes/{egg}", 404)


def test_of_many_that_upload_the_same_in_any_order_none_fails(park: Api) -> None:
    files = [("files", (f"{n}.off", GEM + b"\n" * n)) for n in range(12)]

    def send(turn: int) -> set[str]:
        order = files[turn:] + files[:turn]
        answer = park.client.post("/v1/collections/zoo/shapes", files=order)
        assert answer.status_code == 202, answer.text
        return {shape["id"] for shape in answer.json()["shapes"]}

    with ThreadPoolExecutor(6) as pool:
        found = list(pool.map(send, range(12)))
    assert all(ids == found[0] for ids in found)
    with park.services.database.read() as session:
        assert session.query(Shape).count() == 12


def test_of_many_that_make_or_rename_a_collection_one_succeeds(park: Api) -> None:
    def make(turn: int) -> int:
        if turn % 2:
            answer = park.client.post("/v1/collections", json={"name": "new"})
        else:
            answer = park.client.patch("/v1/collections/zoo", json={"name": "new"})
        return int(answer.status_code)

    with ThreadPoolExecutor(6) as pool:
        statuses = sorted(pool.map(make, range(6)))
    assert sum(status in {200, 201} for status in statuses) == 1
    assert set(statuses) <= {200, 201, 404, 409}


def test_texts_that_postgresql_cannot_hold_are_refused_before(park: Api) -> None:
    park.post("/v1/collections", 422, json={"name": "a", "description": "\x00"})
    park.get("/v1/collections/zoo/shapes?label=%00", 422)
    park.get("/v1/models/%00", 404)
    park.get("/v1/shapes/%00", 404)
    park.upload("zoo", {"a.off": EGG}, 422, data={"label": "\x00"})
    shape = park.upload("zoo", {"a\x00.off": EGG}, data={"label": "\U0001f408"})["shapes"][0]
    assert (shape["name"], shape["label"]) in [("a.off", "\U0001f408"), ("a%00.off", "\U0001f408")]


def test_from_training_to_searching_under_what_was_learned(park: Api) -> None:
    park.upload("zoo", {"egg.null.0.off": EGG, "gem.null.0.off": GEM, "die.null.0.off": DIE})
    park.work()
    training = {"collection": "zoo", "transformations": ["noise"], "strengths": [1]}
    body = {"name": "mine", "method": "grid", "training": training}
    job = park.post("/v1/models", 202, json=body)["job"]["id"]
    assert "in training" in park.post("/v1/models", 409, json=body)["detail"]
    park.post(f"/v1/jobs/{job}/cancel")
    park.post(f"/v1/jobs/{job}/retry")
    assert park.work() == 3 + 1
    assert park.get("/v1/models/mine")["training"]["n_pairs"] == 3
    park.put("/v1/collections/zoo/model", json={"model": "mine"})
    park.work()
    shape = park.get("/v1/collections/zoo/shapes?label=egg")["items"][0]["id"]
    assert park.ask("zoo", shape_id=shape)["model"] == "mine"
    park.put("/v1/collections/zoo/model", json={"model": "heat"})
    park.work()
    park.delete("/v1/models/mine")
    park.get("/v1/models/mine", 404)


def test_of_many_that_train_a_model_of_one_name_one_succeeds(park: Api) -> None:
    training = {"transformations": ["scale"], "strengths": [1], "shapes": 2}
    body = {"name": "mine", "method": "spline", "training": training}
    with ThreadPoolExecutor(6) as pool:
        answers = list(pool.map(lambda _: park.client.post("/v1/models", json=body), range(6)))
    assert sorted(answer.status_code for answer in answers) == [202, *[409] * 5]
    jobs = park.get("/v1/jobs?kind=train")["items"]
    assert len(jobs) == 1
