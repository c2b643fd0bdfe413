"""Evaluations over HTTP: from files with names of the convention to Table 1."""

import numpy as np
import pytest

from tests.retrieval.leave_one_out import leave_one_out
from tests.service.running import EGG, GEM, ZOO, Api, Json, zoo_files
from tests.service.test_models import add_model
from tests.service.test_openapi import check
from workers.retrieval.measures import mean_measures

MEASURES = {"nearest_neighbour", "first_tier", "second_tier", "e_measure", "dcg", "map"}


def ask(api: Api, status: int = 202, *, wait: float = 0, **body: object) -> Json:
    answer: Json = api.post(f"/v1/evaluations?wait={wait}", status, json=body)
    return answer


def evaluated(api: Api, *models: str, collection: str = "zoo") -> Json:
    accepted = ask(api, collection=collection, models=models)
    api.work()
    found: Json = api.get(f"/v1/evaluations/{accepted['evaluation']['id']}")
    assert found["state"] == "succeeded"
    return found


def test_a_scaled_copy_is_found_again(zoo: Api) -> None:
    accepted = ask(zoo, collection="zoo", models=["heat", "shape-dna"])
    waiting, job = accepted["evaluation"], accepted["job"]
    assert (job["kind"], job["collection"], job["state"]) == ("evaluate", "zoo", "queued")
    assert (waiting["state"], waiting["job_id"]) == ("queued", job["id"])
    assert (waiting["n_queries"], waiting["table"], waiting["ranks"]) == (None, {}, [])
    zoo.work()
    found = zoo.get(f"/v1/evaluations/{waiting['id']}")
    assert (found["n_queries"], found["n_targets"]) == (1, 4)
    hundred = {"heat": 100.0, "shape-dna": 100.0}
    assert found["mean_average_precision"] == hundred
    assert found["table"] == {"scale": hundred}
    assert found["by_strength"] == {"scale": {"2": hundred}}
    assert found["measures"]["heat"].keys() == MEASURES
    assert found["precision_recall"]["heat"] == [[5.0 * i, 100.0] for i in range(21)]
    assert found["mean_of_rows"]["heat"] == {"value": 100.0, "low": None, "high": None}
    assert found["differences"]["shape-dna"]["mean_of_rows"]["value"] == 0.0
    (rank, _) = found["ranks"]
    assert (rank["query"], rank["rank"]) == (zoo.shape_ids[ZOO[1]], 1)
    assert rank["top"][0] == zoo.shape_ids[ZOO[0]]
    assert sorted(rank["top"]) == sorted(set(zoo.shape_ids.values()) - {rank["query"]})
    ended = zoo.get(f"/v1/jobs/{job['id']}")
    assert ended["progress"] == {"done": 7, "total": 7, "unit": "shapes"}


def test_the_order_is_that_of_the_search(zoo: Api) -> None:
    found = evaluated(zoo, "heat", "commute-time")
    (by_heat, by_commute) = found["ranks"]
    answer = zoo.ask("zoo", shape_id=by_heat["query"])
    assert [match["shape"]["id"] for match in answer["matches"]] == by_heat["top"]
    zoo.ask("zoo", 409, shape_id=by_heat["query"], model="commute-time")  # it does not follow
    collection = zoo.get("/v1/collections/zoo")
    assert (collection["model"], collection["ready_count"]) == ("heat", 5)
    zoo.put("/v1/collections/zoo/model", json={"model": "commute-time"})
    zoo.work()
    describing = zoo.get("/v1/jobs?kind=describe")["items"][0]
    assert describing["progress"]["total"] == 0  # the evaluation described them already
    answer = zoo.ask("zoo", shape_id=by_heat["query"])
    assert [match["shape"]["id"] for match in answer["matches"]] == by_commute["top"]


def test_waiting_answers_201_with_the_result(zoo: Api) -> None:
    with zoo.worker():
        answer = ask(zoo, 201, wait=30, collection="zoo", models=["biharmonic"])
    assert answer["job"]["state"] == answer["evaluation"]["state"] == "succeeded"
    assert answer["evaluation"] == zoo.get(f"/v1/evaluations/{answer['evaluation']['id']}")


def test_labels_alone_are_measured_leave_one_out(api: Api) -> None:
    api.post("/v1/collections", 201, json={"name": "poses"})
    ball, ball_scaled, ring, egg, crate = zoo_files().values()
    files = {
        **{"round/a.off": ball, "round/b.off": ball_scaled, "round/c.obj": egg},
        **{"other/a.ply": ring, "other/b.off": EGG, "other/c.stl": crate},
    }
    shapes = api.upload("poses", files)["shapes"]
    api.work()
    found = evaluated(api, "heat", collection="poses")
    assert (found["leave_one_out"], found["n_queries"], found["table"]) == (True, 6, {})
    shapes.sort(key=lambda shape: str(shape["id"]))
    far = np.zeros((6, 6))
    place = {shape["id"]: i for i, shape in enumerate(shapes)}
    for shape in shapes:
        for match in api.ask("poses", shape_id=shape["id"])["matches"]:
            far[place[shape["id"]], place[match["shape"]["id"]]] = match["distance"]
    expected = mean_measures(list(leave_one_out(far, [s["label"] for s in shapes]).values()))
    assert found["measures"]["heat"] == pytest.approx(
        {
            **{name: 100 * getattr(expected, name) for name in MEASURES - {"map"}},
            "map": 100 * expected.average_precision,
        }
    )


def test_lists_begin_with_the_newest_and_leave_ranks_out(zoo: Api) -> None:
    first, second = evaluated(zoo, "heat"), evaluated(zoo, "shape-dna")
    assert zoo.get("/v1/evaluations")["items"] == [
        {**second, "ranks": []},
        {**first, "ranks": []},
    ]
    page = zoo.get("/v1/evaluations", params={"limit": 1, "collection": "zoo"})
    rest = zoo.get("/v1/evaluations", params={"cursor": page["next_cursor"]})
    assert [item["id"] for item in page["items"] + rest["items"]] == [second["id"], first["id"]]
    zoo.patch("/v1/collections/zoo", json={"name": "park"})
    assert zoo.get("/v1/evaluations", params={"collection": "zoo"})["items"] == []
    assert len(zoo.get("/v1/evaluations", params={"collection": "park"})["items"]) == 2
    zoo.delete("/v1/collections/park")
    assert zoo.get(f"/v1/evaluations/{first['id']}")["table"] == first["table"]


@pytest.mark.parametrize(
    ("status", "body", "words"),
    [
        (404, {"collection": "none", "models": ["heat"]}, "no collection named 'none'"),
        (404, {"collection": "zoo", "models": ["heat", "none"]}, "no model named 'none'"),
        (409, {"collection": "zoo", "models": ["young"]}, "expected ready"),
        (422, {"collection": "zoo", "models": []}, "models"),
        (422, {"collection": "zoo", "models": ["heat", "heat"]}, "each model once"),
        (422, {"collection": "zoo", "models": [f"m{i}" for i in range(21)]}, "at most 20"),
        (422, {"collection": "zoo"}, "models"),
        (422, {"collection": "zoo", "models": ["heat"], "dissimilarity": "x"}, "no dissimilarity"),
        (422, {"collection": "zoo", "models": ["heat"], "seed": 1}, "seed"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(zoo: Api, status: int, body: Json, words: str) -> None:
    add_model(zoo, "young", state="training")
    assert words in zoo.post("/v1/evaluations", status, json=body)["detail"]
    assert zoo.get("/v1/evaluations")["items"] == []
    assert zoo.get("/v1/jobs?kind=evaluate")["items"] == []


def test_a_collection_without_labels_says_what_is_missing(api: Api) -> None:
    api.post("/v1/collections", 201, json={"name": "zoo"})
    api.upload("zoo", {"gem.off": GEM, "egg.off": EGG})
    detail = api.post("/v1/evaluations", 409, json={"collection": "zoo", "models": ["heat"]})[
        "detail"
    ]
    assert detail.startswith("2 shapes of collection 'zoo' are still being computed")
    api.work()
    problem = api.post("/v1/evaluations", 422, json={"collection": "zoo", "models": ["heat"]})
    assert problem["detail"].startswith("found 2 shapes that can be compared, 0 of them with a")
    assert "<label>.<transformation>.<strength>.off" in problem["detail"]


def test_a_failed_evaluation_says_so_and_can_be_retried(zoo: Api) -> None:
    add_model(zoo, "mine")
    accepted = ask(zoo, collection="zoo", models=["mine"])
    zoo.post(f"/v1/jobs/{accepted['job']['id']}/cancel")
    path = f"/v1/evaluations/{accepted['evaluation']['id']}"
    assert zoo.get(path)["state"] == "cancelled"
    zoo.post(f"/v1/jobs/{accepted['job']['id']}/retry")
    zoo.delete("/v1/models/mine")
    zoo.work()
    assert zoo.get(path)["state"] == "failed"
    assert zoo.get(path)["table"] == {}
    job = zoo.get(f"/v1/jobs/{accepted['job']['id']}")
    assert job["errors"][0]["type"] == "model-not-found"


@pytest.mark.parametrize("identifier", ["none", "%00", "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"])
def test_unknown_evaluations_are_not_found(api: Api, identifier: str) -> None:
    problem = api.get(f"/v1/evaluations/{identifier}", 404)
    assert problem["type"] == "/problems/evaluation-not-found"


def test_answers_are_what_the_document_says(zoo: Api) -> None:
    found = evaluated(zoo, "heat", "commute-time")
    document = zoo.get("/openapi.json")
    for path, answer in (
        ("/v1/evaluations/{evaluation_id}", found),
        ("/v1/evaluations", zoo.get("/v1/evaluations")),
    ):
        content = document["paths"][path]["get"]["responses"]["200"]["content"]
        check(document, content["application/json"]["schema"], answer, path)
