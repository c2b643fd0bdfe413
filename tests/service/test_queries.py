"""Questions: the order of answers, filters, meshes that are described once, batches."""

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sqlalchemy import select

from tests.meshes import scaled
from tests.service.conftest import Start
from tests.service.running import DIE, EGG, GEM, ZOO, Api, Json, off, zoo_files
from workers.geometry.formats import parse
from workers.retrieval.model import Model
from workers.retrieval.scan import distances
from workers.storage.arrays import vector_from_bytes
from workers.storage.descriptors import get_vector
from workers.storage.models import Query
from workers.storage.trained_models import load_model

BALL, TWIN, RING, GREY, CRATE = ZOO


def found(answer: Json) -> list[str]:
    return [match["shape"]["name"] for match in answer["matches"]]


def without_time(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key != "took_ms"}


def test_a_shape_finds_its_scaled_twin_first(zoo: Api) -> None:
    answer = zoo.ask("zoo", shape_id=zoo.shape_ids[BALL])
    assert (answer["collection"], answer["model"], answer["dissimilarity"]) == ("zoo", "heat", "l1")
    assert answer["query"] == {
        "shape_id": zoo.shape_ids[BALL], "sha256": None, "region": None,
    }  # fmt: skip
    assert answer["searched"] == 4
    assert found(answer)[0] == TWIN
    assert [match["rank"] for match in answer["matches"]] == [1, 2, 3, 4]
    far = [match["distance"] for match in answer["matches"]]
    near = [match["similarity"] for match in answer["matches"]]
    assert far == sorted(far)
    assert near == sorted(near, reverse=True)
    assert near[0] == pytest.approx(1.0, abs=1e-4)
    assert all(0 <= similarity <= 1 for similarity in near)


def test_an_answer_is_the_exact_scan_of_stored_descriptors(zoo: Api) -> None:
    with zoo.services.database.read() as session:
        model: Model = load_model(session, "heat")
        ids = list(zoo.shape_ids.values())
        stored = [get_vector(session, shape_id, "heat") for shape_id in ids]
    vectors = np.stack([vector_from_bytes(vector) for vector in stored if vector])
    for name in (None, "earth-movers", "kullback-leibler"):
        expected = distances(vectors[2], vectors, model, dissimilarity=name)
        body = {"shape_id": ids[2], "include_self": True}
        answer = zoo.ask("zoo", **body, **({"dissimilarity": name} if name else {}))
        got = {match["shape"]["id"]: match["distance"] for match in answer["matches"]}
        assert [got[shape_id] for shape_id in ids] == expected.tolist()
        assert answer["dissimilarity"] == (name or "l1")


def test_a_shape_finds_itself_only_when_asked_to(zoo: Api) -> None:
    ring = zoo.shape_ids[RING]
    itself = zoo.ask("zoo", shape_id=ring, include_self=True)
    assert itself["searched"] == 5
    assert found(itself)[0] == RING
    first = itself["matches"][0]
    assert (first["distance"], first["similarity"]) == (0.0, 1.0)
    others = zoo.ask("zoo", shape_id=ring)
    assert [m["distance"] for m in others["matches"]] == [
        m["distance"] for m in itself["matches"][1:]
    ]


def test_the_same_question_has_the_same_answer_on_another_replica(zoo: Api, start: Start) -> None:
    first = [zoo.ask("zoo", shape_id=shape) for shape in zoo.shape_ids.values()]
    url = zoo.settings.resolved_database_url
    replica = start("replica", database_url=url, blob_url=zoo.settings.resolved_blob_url)
    second = [replica.ask("zoo", shape_id=shape) for shape in zoo.shape_ids.values()]
    assert list(map(without_time, first)) == list(map(without_time, second))


def test_limit_and_distance_cut_the_same_ranking(zoo: Api) -> None:
    whole = zoo.ask("zoo", shape_id=zoo.shape_ids[GREY])["matches"]
    assert zoo.ask("zoo", shape_id=zoo.shape_ids[GREY], limit=2)["matches"] == whole[:2]
    bound = whole[1]["distance"]
    near = zoo.ask("zoo", shape_id=zoo.shape_ids[GREY], max_distance=bound)
    assert near["matches"] == [match for match in whole if match["distance"] <= bound]
    assert near["searched"] == 4
    assert zoo.ask("zoo", shape_id=zoo.shape_ids[GREY], max_distance=0)["matches"] == []


def test_a_question_may_say_what_it_stands_for(zoo: Api) -> None:
    for match in ("auto", "whole", "part"):
        answer = zoo.ask("zoo", shape_id=zoo.shape_ids[RING], match=match)
        assert answer["searched"] == 4
        assert zoo.ask_mesh("zoo", zoo_files()[RING], match=match)["searched"] == 5
    zoo.ask_mesh("zoo", zoo_files()[RING], 422, match="most")


def test_what_was_not_given_is_not_stored(zoo: Api) -> None:
    """So that the same question is still the same after an option was added."""
    zoo.ask_mesh("zoo", zoo_files()[RING], limit="2")
    zoo.ask_mesh("zoo", zoo_files()[RING], match="part")
    with zoo.services.database.read() as session:
        stored = list(session.scalars(select(Query.parameters).order_by(Query.id)))
    assert stored == [{"limit": 2}, {"match": "part"}]


def test_a_filter_leaves_distances_as_they_are(zoo: Api) -> None:
    whole = zoo.ask("zoo", shape_id=zoo.shape_ids[CRATE])
    wanted = {"must": [{"field": "label", "equals": "ball"}]}
    some = zoo.ask("zoo", shape_id=zoo.shape_ids[CRATE], filter=wanted)
    kept = [match for match in whole["matches"] if match["shape"]["label"] == "ball"]
    assert [m["distance"] for m in some["matches"]] == [m["distance"] for m in kept]
    assert some["searched"] == 2
    itself = zoo.ask("zoo", shape_id=zoo.shape_ids[BALL], filter=wanted)
    assert (found(itself), itself["searched"]) == ([TWIN], 1)
    none = {"must": [{"field": "label", "equals": "unicorn"}]}
    empty = zoo.ask("zoo", shape_id=zoo.shape_ids[CRATE], filter=none)
    assert (empty["matches"], empty["searched"]) == ([], 0)


def test_a_patched_label_counts_from_the_next_question_on(zoo: Api) -> None:
    wanted = {"must": [{"field": "metadata.seen", "equals": True}]}
    ask = {"shape_id": zoo.shape_ids[CRATE], "filter": wanted}
    assert found(zoo.ask("zoo", **ask)) == []
    zoo.patch(f"/v1/shapes/{zoo.shape_ids[RING]}", json={"metadata": {"seen": True}})
    assert found(zoo.ask("zoo", **ask)) == [RING]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({"dissimilarity": "cosine"}, "jensen-shannon"),
        ({"limit": 0}, "limit"),
        ({"limit": 1001}, "limit"),
        ({"max_distance": -1}, "max_distance"),
        ({"match": "most"}, "match"),
        ({"shape_id": 7}, "shape_id"),
        ({"shape_id": "\x00"}, "shape_id"),
        ({"labels": "cat"}, "labels"),
        ({"filter": {"must": [{"field": "colour", "equals": 1}]}}, "filter.must.0.field"),
        ({"filter": {"must": [{"field": "label"}]}}, "exactly one"),
        ({"filter": {"must": [{"field": "label", "equals": 1, "in": [1]}]}}, "exactly one"),
        ({"filter": {"must": [{"field": "label", "in": []}]}}, "filter.must.0.in"),
        ({"filter": {"must": [{"field": "label", "range": {}}]}}, "at least one"),
        ({"filter": {"must": [{"field": "label", "range": {"gt": 1, "lt": "a"}}]}}, "all numbers"),
        ({"filter": {"must": [{"field": "metadata", "equals": "\x00"}]}}, "NUL"),
        ({"filter": {"any": []}}, "filter.any"),
        ({"filter": []}, "filter"),
    ],
)
def test_questions_that_make_no_sense_say_what_is_wrong(zoo: Api, body: Json, reason: str) -> None:
    problem = zoo.ask("zoo", 422, **{"shape_id": zoo.shape_ids[BALL], **body})
    assert problem["type"] == "/problems/invalid-request"
    assert reason in problem["detail"]


def test_a_model_that_the_collection_is_not_described_under_conflicts(zoo: Api) -> None:
    problem = zoo.ask("zoo", 409, shape_id=zoo.shape_ids[BALL], model="shape-dna")
    assert problem["type"] == "/problems/model-not-ready"
    assert "PUT /v1/collections/zoo/model" in problem["detail"]
    zoo.ask("zoo", 404, shape_id=zoo.shape_ids[BALL], model="magic")
    zoo.ask("none", 404, shape_id=zoo.shape_ids[BALL])


def test_plain_vectors_are_not_compared_as_distributions(zoo: Api) -> None:
    zoo.put("/v1/collections/zoo/model", json={"model": "shape-dna"})
    zoo.work()
    ask = {"shape_id": zoo.shape_ids[BALL], "model": "shape-dna"}
    assert "l1, l2" in zoo.ask("zoo", 422, **ask, dissimilarity="earth-movers")["detail"]
    zoo.ask("zoo", **ask, dissimilarity="l2")


def test_a_shape_that_is_not_computed_cannot_be_asked_with(zoo: Api) -> None:
    waiting = zoo.upload("zoo", {"egg.off": EGG, "bad.off": b"x"})["shapes"]
    for shape in waiting:
        problem = zoo.ask("zoo", 409, shape_id=shape["id"])
        assert problem["type"] == "/problems/shape-not-ready"
    assert zoo.ask("zoo", shape_id=zoo.shape_ids[BALL])["searched"] == 4
    zoo.work()
    assert zoo.ask("zoo", shape_id=waiting[0]["id"])["searched"] == 5
    reason = zoo.get(f"/v1/shapes/{waiting[1]['id']}")["error"]["detail"]
    assert reason in zoo.ask("zoo", 409, shape_id=waiting[1]["id"])["detail"]


def test_a_shape_of_another_collection_can_be_asked_with(zoo: Api) -> None:
    zoo.post("/v1/collections", 201, json={"name": "other"})
    ball = zoo.upload("other", {"b.off": zoo_files()[BALL]})["shapes"][0]
    zoo.work()
    answer = zoo.ask("zoo", shape_id=ball["id"])
    assert answer["searched"] == 5
    assert [match["distance"] for match in answer["matches"][:2]] == pytest.approx([0, 0], abs=1e-4)
    assert found(zoo.ask("other", shape_id=zoo.shape_ids[RING])) == ["b.off"]


def test_a_mesh_that_is_stored_is_answered_at_once(zoo: Api) -> None:
    answer = zoo.ask_mesh("zoo", zoo_files()[RING])
    assert answer["query"]["sha256"] == hashlib.sha256(zoo_files()[RING]).hexdigest()
    assert found(answer)[0] == RING
    assert (answer["matches"][0]["distance"], answer["searched"]) == (0.0, 5)
    by_id = zoo.ask("zoo", shape_id=zoo.shape_ids[RING], include_self=True)
    assert answer["matches"] == by_id["matches"]
    assert zoo.work() == 0


def test_a_new_mesh_is_described_once_and_ranked_whenever_it_is_asked_for(zoo: Api) -> None:
    mesh = scaled(parse(zoo_files()[BALL], filename="").mesh, 0.5)
    content = off(mesh)
    first = zoo.ask_mesh("zoo", content, 202, limit="2")
    second = zoo.ask_mesh("zoo", content, 202)
    assert first["query_id"] != second["query_id"]
    assert first["job"]["id"] == second["job"]["id"]
    assert (first["job"]["kind"], first["job"]["state"]) == ("query", "queued")
    path = f"/v1/queries/{first['query_id']}"
    assert zoo.get(path, 202)["query_id"] == first["query_id"]
    assert zoo.work() == 1
    answer = zoo.get(path)
    assert sorted(found(answer)) == sorted([BALL, TWIN])
    assert_allclose([match["distance"] for match in answer["matches"]], 0, atol=1e-4)
    assert zoo.get("/v1/collections/zoo")["shape_count"] == 5
    zoo.delete(f"/v1/shapes/{zoo.shape_ids[TWIN]}")
    again = zoo.get(path)
    assert found(again)[0] == BALL
    assert len(again["matches"]) == 2
    assert zoo.ask_mesh("zoo", content)["searched"] == 4
    zoo.delete("/v1/collections/zoo")
    zoo.get(path, 404)


def test_a_client_may_hold_on_for_its_mesh(zoo: Api) -> None:
    with zoo.worker():
        answer = zoo.ask_mesh("zoo", EGG, wait=30)
        assert len(answer["matches"]) == 5
        waiting = zoo.ask_mesh("zoo", GEM, 202, wait=0)
        assert zoo.get(f"/v1/queries/{waiting['query_id']}?wait=30")["searched"] == 5


def test_a_mesh_may_bring_all_options_of_a_question(zoo: Api) -> None:
    wanted = {"must_not": [{"field": "label", "equals": "ball"}]}
    answer = zoo.ask_mesh(
        "zoo",
        zoo_files()[RING],
        limit="1",
        model="heat",
        dissimilarity="l2",
        max_distance="5",
        filter=json.dumps(wanted),
        include_self="false",
    )
    assert (found(answer), answer["searched"], answer["dissimilarity"]) == ([RING], 3, "l2")
    content = zoo_files()[RING]
    zoo.ask_mesh("zoo", content, 422, limit="many")
    zoo.ask_mesh("zoo", content, 422, filter="{")
    zoo.ask_mesh("zoo", content, 422, filter='{"must": 1}')
    zoo.ask_mesh("zoo", content, 422, max_distance="nan")
    zoo.ask_mesh("zoo", content, 422, dissimilarity="cosine")
    zoo.ask_mesh("zoo", content, 422, shape_id="x")
    zoo.ask_mesh("zoo", content, 409, model="shape-dna")
    zoo.ask_mesh("none", content, 404)
    assert zoo.work() == 0


def test_a_mesh_that_is_none_is_a_problem_with_its_reason(zoo: Api) -> None:
    with zoo.worker():
        problem = zoo.ask_mesh("zoo", b"OFF\n1 1 0\n0 0 0\n3 0 1 2\n", 422, wait=30)
        assert problem["type"] == "/problems/invalid-mesh"
        assert problem["detail"]
        assert (
            zoo.ask_mesh("zoo", b"no mesh", 415, wait=30)["type"] == "/problems/unsupported-format"
        )
    assert zoo.ask_mesh("zoo", b"", 422)["type"] == "/problems/invalid-mesh"
    late = zoo.ask_mesh("zoo", b"nothing", 202)
    zoo.work()
    zoo.get(f"/v1/queries/{late['query_id']}", 415)
    gone = zoo.ask_mesh("zoo", b"nothing at all", 202)
    zoo.post(f"/v1/jobs/{gone['job']['id']}/cancel")
    assert zoo.get(f"/v1/queries/{gone['query_id']}", 409)["type"] == "/problems/cancelled"


def test_a_batch_answers_each_question_as_if_it_stood_alone(zoo: Api) -> None:
    queries: list[Json] = [
        {"shape_id": shape, "limit": n + 1} for n, shape in enumerate(zoo.shape_ids.values())
    ]
    path = "/v1/collections/zoo/query/batch"
    results = zoo.post(path, json={"queries": queries})["results"]
    alone = [zoo.ask("zoo", **query) for query in queries]
    assert list(map(without_time, results)) == list(map(without_time, alone))
    queries[3]["dissimilarity"] = "cosine"
    assert zoo.post(path, 422, json={"queries": queries})["detail"].startswith("queries.3: ")
    queries[3] = {"shape_id": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"}
    assert zoo.post(path, 404, json={"queries": queries})["type"] == "/problems/shape-not-found"
    zoo.post(path, 422, json={"queries": []})
    zoo.post(path, 422, json={"queries": queries[:1] * 101})
    assert (
        "queries.1.limit"
        in zoo.post(path, 422, json={"queries": [queries[0], {"limit": 0}]})["detail"]
    )


def test_questions_while_shapes_come_and_go_see_whole_states(zoo: Api) -> None:
    ball = zoo.shape_ids[BALL]
    files = {"egg.off": EGG, "gem.off": GEM, "die.off": DIE}

    def ask(_: int) -> int:
        answer = zoo.ask("zoo", shape_id=ball)
        assert answer["searched"] == len(answer["matches"])
        assert found(answer)[0] == TWIN
        return int(answer["searched"])

    with ThreadPoolExecutor(4) as pool, zoo.worker():
        asked = [pool.submit(ask, n) for n in range(20)]
        shapes = zoo.upload("zoo", files, 201, params={"wait": 60})["shapes"]
        asked += [pool.submit(ask, n) for n in range(10)]
        for shape in shapes:
            zoo.delete(f"/v1/shapes/{shape['id']}")
        asked += [pool.submit(ask, n) for n in range(10)]
        counts = [future.result() for future in asked]
    assert set(counts) <= {4, 5, 6, 7}
    assert ask(0) == 4
