"""Every answer to a question asked with a mesh can be linked to."""

import json
import time

from sqlalchemy import func, select

from service.security import new_key
from tests.meshes import octahedron, scaled
from tests.service.conftest import Start
from tests.service.running import EGG, ZOO, Api, Json, off, zoo_files
from workers.storage.blobs import mesh_key
from workers.storage.models import Query

RING = ZOO[2]
CONTENT = zoo_files()[RING]


def ask(api: Api, content: bytes, name: str = "zoo", **data: str) -> tuple[str, Json]:
    """Ask with a mesh that is described already; the place of the answer, and the answer."""
    path = f"/v1/collections/{name}/query/mesh?wait=0"
    answer = api.client.post(path, files={"mesh": ("q.off", content)}, data=data)
    assert answer.status_code == 200, answer.text
    return answer.headers["Location"], answer.json()


def n_queries(api: Api) -> int:
    with api.services.database.read() as session:
        return session.scalar(select(func.count()).select_from(Query)) or 0


def without_time(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key != "took_ms"}


def test_an_answer_at_once_is_found_again_at_its_place(zoo: Api) -> None:
    place, answer = ask(zoo, CONTENT, limit="2")
    assert place.startswith("/v1/queries/")
    assert without_time(zoo.get(place)) == without_time(answer)
    assert len(answer["matches"]) == 2
    assert zoo.get(f"{place}/mesh") == CONTENT
    shape = zoo.shape_ids[RING]
    for part in ("/mesh?format=glb", "/spectrum", "/signature", "/eigenfunction?number=1"):
        assert zoo.get(place + part) == zoo.get(f"/v1/shapes/{shape}{part}")
    assert zoo.work() == 0
    assert zoo.get("/v1/jobs?kind=query")["items"] == []


def test_the_same_question_has_the_same_place(zoo: Api) -> None:
    wanted = json.dumps({"must": [{"field": "metadata.new", "equals": True}]})
    alike = json.dumps({"must": [{"field": "metadata.new", "equals": 1}]})
    asked: list[dict[str, str]] = [
        {}, {"limit": "2"}, {"dissimilarity": "l2"}, {"filter": wanted}, {"filter": alike},
    ]  # fmt: skip
    places = [ask(zoo, CONTENT, **data)[0] for data in asked]
    assert len(set(places)) == len(asked) == n_queries(zoo)
    assert [ask(zoo, CONTENT, **data)[0] for data in asked] == places
    assert ask(zoo, zoo_files()[ZOO[0]])[0] not in places
    zoo.post("/v1/collections", 201, json={"name": "other"})
    assert ask(zoo, CONTENT, "other")[0] not in places
    assert n_queries(zoo) == len(asked) + 2


def test_a_question_that_was_waited_for_has_a_place_too(zoo: Api) -> None:
    path = "/v1/collections/zoo/query/mesh?wait=30"
    files = {"mesh": ("q.off", off(scaled(octahedron(), 2.0)))}
    with zoo.worker():
        answer = zoo.client.post(path, files=files)
    assert answer.status_code == 200
    place = answer.headers["Location"]
    assert without_time(zoo.get(place)) == without_time(answer.json())
    assert ask(zoo, files["mesh"][1])[0] == place
    waiting = zoo.client.post(path.replace("30", "0"), files={"mesh": ("q.off", EGG)})
    assert waiting.status_code == 202
    assert waiting.headers["Location"] == f"/v1/queries/{waiting.json()['query_id']}"


def test_a_place_outlives_the_shape_of_the_same_bytes(zoo: Api) -> None:
    place, answer = ask(zoo, CONTENT)
    zoo.delete(f"/v1/shapes/{zoo.shape_ids[RING]}")
    again = zoo.get(place)
    assert again["searched"] == answer["searched"] - 1
    assert again["matches"] == [
        {**match, "rank": rank} for rank, match in enumerate(answer["matches"][1:], start=1)
    ]
    assert zoo.get(f"{place}/mesh?format=off")
    zoo.delete("/v1/collections/zoo")
    zoo.get(place, 404)


def test_a_file_that_went_missing_is_stored_again(zoo: Api) -> None:
    sha256 = zoo.get(f"/v1/shapes/{zoo.shape_ids[RING]}")["sha256"]
    zoo.services.blobs.delete(mesh_key(sha256))
    place, _ = ask(zoo, CONTENT)
    assert zoo.get(f"{place}/mesh") == CONTENT


def test_who_may_only_read_may_ask(zoo: Api, start: Start) -> None:
    token, setting = new_key("web", ["read"])
    url, blobs = zoo.settings.resolved_database_url, zoo.settings.resolved_blob_url
    api = start("replica", database_url=url, blob_url=blobs, api_keys=setting)
    api.client.headers["Authorization"] = f"Bearer {token}"
    place, answer = ask(api, CONTENT)
    assert without_time(api.get(place)) == without_time(answer)


def test_a_question_that_is_asked_again_is_kept_as_long_as_a_new_one(zoo: Api) -> None:
    place, _ = ask(zoo, CONTENT)
    query_id = place.rpartition("/")[2]

    def age(seconds: float) -> None:
        with zoo.services.database.begin() as session:
            session.get_one(Query, query_id).created_at = time.time() - seconds

    def made() -> float:
        with zoo.services.database.read() as session:
            return session.get_one(Query, query_id).created_at

    age(3600)
    assert ask(zoo, CONTENT)[0] == place
    assert made() < time.time() - 3000, "most repetitions write nothing"
    age(30 * 86_400)
    assert ask(zoo, CONTENT)[0] == place
    assert made() > time.time() - 60
