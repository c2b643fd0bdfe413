"""Questions with a region of a stored shape: how it is cut, answered, kept and refused."""

import hashlib
from typing import Any

import numpy as np
import pytest
from sqlalchemy import select

from tests.service.conftest import Start
from tests.service.running import ZOO, Api, Json, zoo_files
from workers.geometry.formats import parse, write
from workers.geometry.regions import cut_disc, cut_vertices
from workers.storage.models import Query
from workers.storage.solutions import load_cleaned

BALL, TWIN, RING, GREY, CRATE = ZOO
DISC = {"center": 3, "radius": 1.1}


def found(answer: Json) -> list[str]:
    return [match["shape"]["name"] for match in answer["matches"]]


def without_time(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key != "took_ms"}


def ask(
    api: Api, status: int, region: Json, *, wait: float = 0, name: str = BALL, **options: Any
) -> tuple[Json, str]:
    """Ask with a region; the answer, and where it is found again."""
    body = {"shape_id": api.shape_ids[name], "region": region, **options}
    answer = api.client.post(f"/v1/collections/zoo/query?wait={wait}", json=body)
    assert answer.status_code == status, answer.text
    return answer.json(), answer.headers.get("Location", "")


def test_a_region_is_described_by_a_job_and_then_ranked(zoo: Api) -> None:
    accepted, place = ask(zoo, 202, DISC)
    assert place == f"/v1/queries/{accepted['query_id']}"
    assert (accepted["job"]["kind"], accepted["job"]["state"]) == ("query", "queued")
    assert zoo.get(place, 202)["query_id"] == accepted["query_id"]
    assert zoo.work() == 1
    answer = zoo.get(place)
    assert answer["searched"] == 5
    whole = parse(zoo_files()[BALL], filename="").mesh
    cut = cut_disc(whole, 3, 1.1)
    assert 4 <= cut.n_faces < whole.n_faces
    content = write(cut, "ply")
    assert answer["query"] == {
        "shape_id": zoo.shape_ids[BALL],
        "sha256": hashlib.sha256(content).hexdigest(),
        "region": {"n_vertices": cut.n_vertices, "n_faces": cut.n_faces},
    }
    assert zoo.get(f"{place}/mesh") == content
    for part in ("/mesh?format=glb", "/spectrum", "/signature", "/eigenfunction?number=1"):
        zoo.get(place + part)
    assert zoo.get("/v1/collections/zoo")["shape_count"] == 5


def test_the_answer_is_that_of_the_same_mesh_sent_as_a_file(zoo: Api) -> None:
    _, place = ask(zoo, 202, DISC)
    zoo.work()
    sent = zoo.ask_mesh("zoo", zoo.get(f"{place}/mesh"))
    cut = zoo.get(place)
    assert cut["matches"] == sent["matches"]
    assert cut["query"]["sha256"] == sent["query"]["sha256"]
    assert zoo.work() == 0


def test_the_same_region_is_the_same_query_however_it_is_given(zoo: Api) -> None:
    whole = load_cleaned(zoo.services.blobs, zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}")["sha256"])
    disc = cut_disc(whole, 3, 1.1)
    vertices = [
        int(np.flatnonzero((whole.vertices == vertex).all(axis=1))[0]) for vertex in disc.vertices
    ]
    _, place = ask(zoo, 202, DISC)
    zoo.work()
    answer, again = ask(zoo, 200, DISC)
    given = {"vertices": [*vertices[::-1], vertices[0]]}
    other, same = ask(zoo, 200, given)
    assert place == again == same
    assert without_time(answer) == without_time(other) == without_time(zoo.get(place))
    assert zoo.work() == 0


def test_a_client_may_hold_on_for_its_region(zoo: Api) -> None:
    with zoo.worker():
        answer, place = ask(zoo, 200, DISC, wait=30)
        assert len(answer["matches"]) == 5
        assert without_time(zoo.get(place)) == without_time(answer)


def test_the_shape_is_among_the_answers_unless_it_is_not_wanted(zoo: Api) -> None:
    with zoo.worker():
        given: list[tuple[Json, int]] = [
            ({}, 5), ({"include_self": True}, 5), ({"include_self": False}, 4),
        ]  # fmt: skip
        for options, expected in given:
            answer, place = ask(zoo, 200, DISC, wait=30, **options)
            assert answer["searched"] == expected
            assert (BALL in found(answer)) == (expected == 5)
            assert without_time(zoo.get(place)) == without_time(answer)


def test_a_region_of_all_vertices_is_the_shape_itself(zoo: Api) -> None:
    shape = zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}")
    for region in (
        {"vertices": list(range(shape["n_vertices"]))},
        {"center": 0, "radius": 1e9},
        {"center": 0, "radius": 1e308},
    ):
        answer, place = ask(zoo, 200, region)
        assert answer["query"]["sha256"] == shape["sha256"]
        assert answer["query"]["region"] == {
            "n_vertices": shape["n_vertices"], "n_faces": shape["n_faces"],
        }  # fmt: skip
        itself = zoo.ask("zoo", shape_id=zoo.shape_ids[BALL], include_self=True)
        assert answer["matches"] == itself["matches"]
        assert zoo.get(f"{place}/mesh") == zoo_files()[BALL]
    assert zoo.work() == 0


def test_a_region_brings_all_options_of_a_question_and_they_are_kept(zoo: Api) -> None:
    wanted = {"must_not": [{"field": "label", "equals": "ring"}]}
    options: Json = {"limit": 2, "dissimilarity": "l2", "filter": wanted, "match": "part"}
    with zoo.worker():
        answer, place = ask(zoo, 200, DISC, wait=30, **options)
    assert (len(answer["matches"]), answer["searched"], answer["dissimilarity"]) == (2, 4, "l2")
    assert without_time(zoo.get(place)) == without_time(answer)
    with zoo.services.database.read() as session:
        (stored,) = session.scalars(select(Query.parameters))
    region = answer["query"]["region"]
    assert stored == {"shape_id": zoo.shape_ids[BALL], "region": region, **options}


def test_a_region_is_asked_for_again_after_its_shape_is_gone(zoo: Api) -> None:
    _, place = ask(zoo, 202, DISC)
    zoo.delete(f"/v1/shapes/{zoo.shape_ids[BALL]}")
    zoo.work()
    answer = zoo.get(place)
    assert answer["query"]["shape_id"] == zoo.shape_ids[BALL]
    assert answer["searched"] == 4


def test_a_region_of_a_shape_of_another_collection_can_be_asked_with(zoo: Api) -> None:
    zoo.post("/v1/collections", 201, json={"name": "other"})
    body = {"shape_id": zoo.shape_ids[RING], "region": {"center": 0, "radius": 1.0}}
    with zoo.worker():
        answer = zoo.post("/v1/collections/other/query?wait=30", json=body)
    assert (answer["collection"], answer["searched"]) == ("other", 0)


def test_the_parts_of_a_ring_find_the_ring(zoo: Api) -> None:
    ring = parse(zoo_files()[RING], filename="").mesh
    half = np.flatnonzero(ring.vertices[:, 0] >= 0.0).tolist()
    with zoo.worker():
        answer, _ = ask(zoo, 200, {"vertices": half}, wait=30, name=RING)
    cut = cut_vertices(ring, np.array(half))
    assert answer["query"]["region"] == {"n_vertices": cut.n_vertices, "n_faces": cut.n_faces}
    assert RING in found(answer)


@pytest.mark.parametrize(
    ("region", "reason"),
    [
        ({}, "region: expected either vertices, or center and radius; found neither"),
        ({"center": 1}, "found center"),
        ({"radius": 1.0}, "found radius"),
        ({"vertices": [1], "center": 1}, "found vertices and center"),
        ({"vertices": [1], "center": 1, "radius": 1.0}, "found vertices and center and radius"),
        ({"vertices": []}, "region.vertices: list should have at least 1 item"),
        ({"vertices": [0, -1]}, "region.vertices.1"),
        ({"vertices": [0, 2**31]}, "region.vertices.1"),
        ({"vertices": [0.5]}, "region.vertices.0"),
        ({"vertices": ["0"]}, "region.vertices.0"),
        ({"vertices": [0, 162]}, "region.vertices: there is no vertex 162, expected 0 to 161"),
        (
            {"vertices": [0, 0, 0]},
            "region.vertices: vertices: 1, faces with all their corners among them: 0",
        ),
        ({"vertices": [0, 100, 161]}, "among them: 0; expected at least 4 faces"),
        ({"center": 162, "radius": 1}, "region.center: there is no vertex 162, expected 0 to 161"),
        (
            {"center": 0, "radius": 1e-6},
            "region.radius: whole faces within 1e-06 of vertex 0: 0; expected",
        ),
        ({"center": 0, "radius": 0}, "region.radius"),
        ({"center": 0, "radius": -1.0}, "region.radius"),
        ({"center": 0, "radius": "1"}, "region.radius"),
        ({"centre": 0, "radius": 1}, "region.centre"),
        ([0, 1, 2], "region"),
    ],
)
def test_regions_that_make_no_sense_say_what_is_wrong(zoo: Api, region: Json, reason: str) -> None:
    problem, _ = ask(zoo, 422, region)
    assert problem["type"] == "/problems/invalid-request"
    assert reason in problem["detail"]
    assert zoo.work() == 0


def test_what_the_region_is_cut_from_must_be_there(zoo: Api, start: Start) -> None:
    body = {"region": DISC, "shape_id": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"}
    assert zoo.ask("zoo", 404, **body)["type"] == "/problems/shape-not-found"
    zoo.ask("none", 404, shape_id=zoo.shape_ids[BALL], region=DISC)
    zoo.ask("zoo", 409, shape_id=zoo.shape_ids[BALL], region=DISC, model="shape-dna")
    zoo.ask("zoo", 422, shape_id=zoo.shape_ids[BALL], region=DISC, dissimilarity="cosine")
    api = start()
    api.post("/v1/collections", 201, json={"name": "new"})
    (waiting,) = api.upload("new", {BALL: zoo_files()[BALL]})["shapes"]
    problem = api.ask("new", 409, shape_id=waiting["id"], region=DISC)
    assert problem["type"] == "/problems/shape-not-ready"


def test_a_batch_says_that_it_takes_no_region(zoo: Api) -> None:
    shape = zoo.shape_ids[BALL]
    queries = [{"shape_id": shape}, {"shape_id": shape, "region": DISC}]
    problem = zoo.post("/v1/collections/zoo/query/batch", 422, json={"queries": queries})
    assert problem["detail"].startswith("queries.1: a batch takes no region")
    assert "POST /v1/collections/{c}/query" in problem["detail"]


def test_null_is_no_region(zoo: Api) -> None:
    shape = zoo.shape_ids[BALL]
    plain, place = zoo.ask("zoo", shape_id=shape), zoo.ask("zoo", shape_id=shape, region=None)
    assert without_time(plain) == without_time(place)
