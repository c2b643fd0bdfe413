"""Models that are made over HTTP: what is refused, what is trained, and searching under them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import bumpy_sphere, cylinder
from tests.service.running import EGG, GEM, ZOO, Api, Json, off
from workers.diffusion.kernels import kernel_from_json
from workers.storage.models import Job, TrainedModel
from workers.transformations import TRANSFORMATIONS

ON_ZOO: Json = {"collection": "zoo", "transformations": ["noise"], "strengths": [2]}
SPLINE: Json = {"name": "mine", "method": "spline", "training": ON_ZOO}


def train(api: Api, status: int = 202, **changes: object) -> Json:
    answer: Json = api.post("/v1/models", status, json={**SPLINE, **changes})
    return answer


def counts(api: Api) -> tuple[int, int]:
    """Rows of jobs and of models."""
    with api.services.database.read() as session:
        return session.query(Job).count(), session.query(TrainedModel).count()


@pytest.fixture
def trained(zoo: Api) -> Api:
    """The collection "zoo", and the model "mine" that was learned from it."""
    train(zoo)
    assert zoo.work() == 5 + 1
    return zoo


# -- what is asked for ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "parameters", "shown"),
    [
        ("heat", {"time": 0.05}, {"time": 0.05, "unit": "first-eigenvalue", "view": "closed"}),
        ("heat", {"unit": "area"}, {"time": 0.15, "unit": "area", "view": "closed"}),
        ("heat", {"unit": "none", "time": 7}, {"time": 7, "unit": "none", "view": "closed"}),
        ("commute-time", {"view": "open"}, {"unit": "area", "view": "open"}),
        ("biharmonic", {}, {"view": "closed"}),
        ("shape-dna", {"eigenvalues": 12}, {"eigenvalues": 12, "view": "closed"}),
    ],
)
def test_models_with_nothing_to_learn_are_ready_at_once(
    zoo: Api, method: str, parameters: Json, shown: Json
) -> None:
    body = {"name": "mine", "method": method, "parameters": parameters}
    answer = zoo.post("/v1/models", 201, json=body)
    model, job = answer["model"], answer["job"]
    assert (model["state"], model["method"], model["parameters"]) == ("ready", method, shown)
    assert (job["kind"], job["state"], job["progress"]["total"]) == ("train", "succeeded", 0)
    assert model == zoo.get("/v1/models/mine")
    assert job == zoo.get(f"/v1/jobs/{job['id']}")
    zoo.put("/v1/collections/zoo/model", json={"model": "mine"})
    zoo.work()
    found = zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])
    assert (found["model"], found["searched"]) == ("mine", 4)
    if shown.get("unit") != "none":  # the nearest is the same shape in another size
        assert found["matches"][0]["shape"]["name"] == ZOO[1]
        assert found["matches"][0]["distance"] < 0.05


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"method": "magic"}, "'heat', 'commute-time', 'biharmonic', 'shape-dna', 'heat-time'"),
        ({"name": "Mine"}, "name"),
        ({"parameters": {"points": 9}}, "points: extra inputs are not permitted"),
        ({"parameters": {"splines": 3}}, "splines: input should be greater than or equal to 4"),
        ({"parameters": {"smoothness": "NaN"}}, "smoothness"),
        ({"parameters": {"view": "torn"}}, "'closed' or 'open'"),
        ({"method": "heat"}, "training"),
        ({"method": "heat", "training": None, "parameters": {"time": 0}}, "time"),
        ({"method": "heat", "training": None, "parameters": {"time": 1e9}}, "at most 20/λ₁"),
        ({"training": {**ON_ZOO, "classes": 3}}, "classes: extra inputs are not permitted"),
        ({"training": {**ON_ZOO, "strengths": [0]}}, "greater than or equal to 1"),
        ({"training": {**ON_ZOO, "strengths": []}}, "strengths"),
        ({"training": {**ON_ZOO, "seed": -1}}, "seed"),
        ({"training": {**ON_ZOO, "shapes": 1}}, "shapes"),
        ({"training": {**ON_ZOO, "transformations": ["melt"]}}, ", ".join(TRANSFORMATIONS)),
        (
            {"training": {"collection": "zoo", "correspondence": "vertex-order", "strengths": [1]}},
            "nothing is simulated",
        ),
        ({"training": {"correspondence": "vertex-order"}}, "needs a collection"),
    ],
)
def test_what_makes_no_sense_is_refused_and_writes_nothing(
    zoo: Api, body: Json, words: str
) -> None:
    before = counts(zoo)
    problem = train(zoo, 422, **body)
    assert problem["type"] == "/problems/invalid-request"
    assert words in problem["detail"]
    assert counts(zoo) == before


@pytest.mark.parametrize(
    ("training", "kind", "words"),
    [
        ({"collection": "zoo"}, "insufficient-training-data", "no transformation is given"),
        ({"correspondence": "vertex-order", "collection": "zoo"}, "insufficient-training-data", ""),
        ({**ON_ZOO, "collection": "new"}, "insufficient-training-data", "0 shapes that are ready"),
        ({**ON_ZOO, "collection": "late"}, "shape-not-ready", "a.off of collection 'late'"),
    ],
)
def test_too_little_to_learn_from_is_refused_and_writes_nothing(
    zoo: Api, training: Json, kind: str, words: str
) -> None:
    zoo.post("/v1/collections", 201, json={"name": "new"})
    zoo.post("/v1/collections", 201, json={"name": "late"})
    zoo.upload("late", {"a.off": EGG})
    before = counts(zoo)
    problem = train(zoo, 409, training=training)
    assert problem["type"] == f"/problems/{kind}"
    assert words in problem["detail"]
    assert counts(zoo) == before


def test_a_collection_to_learn_from_must_exist(zoo: Api) -> None:
    assert "none" in train(zoo, 404, training={**ON_ZOO, "collection": "none"})["detail"]


# -- from training to searching -------------------------------------------------------------


def test_a_training_is_a_job_and_ends_with_a_model(zoo: Api) -> None:
    answer = train(zoo, parameters={"splines": 8})
    job, model = answer["job"], answer["model"]
    assert (job["kind"], job["state"], job["model"], job["collection"]) == (
        "train",
        "queued",
        "mine",
        "zoo",
    )
    assert job["progress"] == {"done": 0, "total": 5, "unit": "pairs"}
    assert (model["state"], model["channels"]) == ("training", [])
    assert model["training"]["transformations"] == ["noise"]
    assert zoo.get("/v1/models/mine") == model
    assert zoo.put("/v1/collections/zoo/model", 409, json={"model": "mine"})
    zoo.work()
    model = zoo.get("/v1/models/mine")
    report = model["training"]
    assert (model["state"], report["strengths"]) == ("ready", [2])
    assert (report["n_pairs"], report["n_held_out_pairs"]) == (4, 1)
    assert model["parameters"]["splines"] == 8
    assert {"learned", "commute-time", "heat"} <= report["criterion"]["training"].keys()
    (curve,) = model["kernels"]
    kernel = kernel_from_json(model["channels"][0]["kernel"])
    squared = kernel.squared_transfer(np.array(curve["eigenvalues"]))
    assert_allclose(curve["squared_transfer"], squared, rtol=1e-12)
    listed = {item["name"]: item for item in zoo.get("/v1/models")["items"]}
    assert listed["mine"]["training"] == report


def test_a_client_can_hold_on_for_a_training(zoo: Api) -> None:
    with zoo.worker():
        answer = zoo.post("/v1/models?wait=60", 201, json=SPLINE)
    assert (answer["job"]["state"], answer["model"]["state"]) == ("succeeded", "ready")


def test_a_collection_moves_to_a_learned_model_and_back(trained: Api) -> None:
    asked = trained.shape_ids[ZOO[0]]
    before = trained.ask("zoo", shape_id=asked)["matches"]
    trained.put("/v1/collections/zoo/model", json={"model": "mine"})
    trained.upload("zoo", {"late.egg.off": EGG})
    assert trained.ask("zoo", shape_id=asked)["matches"] == before
    trained.work()
    under_mine = trained.ask("zoo", shape_id=asked)
    assert (under_mine["model"], under_mine["searched"]) == ("mine", 5)
    assert under_mine["matches"][0]["shape"]["name"] == ZOO[1]
    assert under_mine["matches"][0]["similarity"] > 0.95
    assert under_mine["matches"][-1]["similarity"] < 0.9
    assert trained.ask_mesh("zoo", GEM, 202)
    trained.put("/v1/collections/zoo/model", json={"model": "heat"})
    trained.work()
    after = trained.ask("zoo", shape_id=asked)
    assert (after["model"], after["searched"]) == ("heat", 5)
    old = [match for match in after["matches"] if match["shape"]["name"] != "late.egg.off"]
    assert [(m["shape"]["id"], m["distance"]) for m in old] == [
        (m["shape"]["id"], m["distance"]) for m in before
    ]
    assert "zoo" not in trained.delete("/v1/models/mine").decode()


def test_shapes_outside_the_learned_range_fail_under_that_model_alone(zoo: Api) -> None:
    """λ₁₀₀/λ₁ of a needle is a hundred times that of a ball, and there the kernel is not known."""
    needles = [off(cylinder(12, 80, radius=0.05, height=height)) for height in (8.0, 9.0)]
    needle = zoo.upload("zoo", {"needle.off": needles[0]})["shapes"][0]["id"]
    for name in ("round", "thin"):
        zoo.post("/v1/collections", 201, json={"name": name})
    zoo.upload("round", {"a.0.off": off(bumpy_sphere(2, 7)), "b.0.off": off(bumpy_sphere(2, 8))})
    zoo.upload("thin", {"needle.off": needles[0]})
    zoo.work()
    train(zoo, training={**ON_ZOO, "collection": "round", "strengths": [1]})
    zoo.work()
    # one of many: the others are searched under the model
    job = zoo.put("/v1/collections/zoo/model", json={"model": "mine"})["job"]
    zoo.work()
    (error,) = zoo.get(f"/v1/jobs/{job['id']}")["errors"]
    assert (error["item"], error["type"]) == ("needle.off", "kernel-domain")
    assert "kernel is known for eigenvalues from" in error["detail"]
    assert zoo.get(f"/v1/shapes/{needle}")["error"] == {
        "type": "kernel-domain",
        "detail": error["detail"],
    }
    assert zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])["searched"] == 4
    zoo.put("/v1/collections/zoo/model", json={"model": "heat"})
    zoo.work()
    assert zoo.ask("zoo", shape_id=needle)["searched"] == 5
    # all of them: the collection stays where it is, and is told why
    job = zoo.put("/v1/collections/thin/model", json={"model": "mine"})["job"]
    zoo.work()
    job = zoo.get(f"/v1/jobs/{job['id']}")
    assert job["state"] == "failed"
    assert f"the first, needle.off: {error['detail']}" in job["errors"][-1]["detail"]
    found = zoo.get("/v1/collections/thin")
    assert (found["model"], found["ready_count"], found["failed_count"]) == ("heat", 1, 0)
    # what arrives later is found under the model that the collection has
    late = zoo.upload("thin", {"late.off": needles[1]})
    zoo.work()
    assert zoo.get(f"/v1/jobs/{late['job']['id']}")["state"] == "succeeded"
    shape = zoo.get(f"/v1/shapes/{late['shapes'][0]['id']}")
    assert (shape["state"], shape["error"]) == ("ready", None)
    assert zoo.ask("thin", shape_id=shape["id"])["searched"] == 1


def test_the_diagonal_of_a_learned_kernel_is_shown(trained: Api) -> None:
    """k(x,x) of the model that a collection is searched under, or of another by its name."""
    shape = trained.shape_ids[ZOO[0]]
    path = f"/v1/shapes/{shape}/signature"
    learned = trained.get(path, params={"kernel": "model:mine"})
    own = trained.get(path)
    assert len(learned) == len(own)
    assert learned != own
    assert trained.get(path, params={"kernel": "model:heat"}) == own
    values = np.frombuffer(learned, "<f4")
    assert np.isfinite(values).all()
    assert values.min() >= 0.0
    trained.get(path, 404, params={"kernel": "model:none"})
    trained.get(path, 422, params={"kernel": "model:shape-dna"})
    trained.put("/v1/collections/zoo/model", json={"model": "mine"})
    trained.work()
    assert trained.get(path) == learned


def test_a_name_is_free_again_once_its_failed_model_is_deleted(zoo: Api) -> None:
    job = train(zoo)["job"]["id"]
    assert train(zoo, 409)["type"] == "/problems/name-taken"
    assert "in training" in zoo.delete("/v1/models/mine", 409)["detail"]
    zoo.post(f"/v1/jobs/{job}/cancel")
    assert zoo.get("/v1/models/mine")["state"] == "failed"
    assert "delete it" in train(zoo, 409)["detail"]
    zoo.post(f"/v1/jobs/{job}/retry")
    assert zoo.get("/v1/models/mine")["state"] == "training"
    zoo.post(f"/v1/jobs/{job}/cancel")
    zoo.delete("/v1/models/mine")
    train(zoo)
    zoo.work()
    assert zoo.get("/v1/models/mine")["state"] == "ready"
    assert "exists already" in train(zoo, 409)["detail"]
    assert train(zoo, 409, name="heat")["type"] == "/problems/name-taken"


# -- banks ----------------------------------------------------------------------------------

BANK: Json = {
    "name": "mine",
    "method": "bank",
    "parameters": {"views": ["closed"], "channels": 8},
    "training": {"collection": "zoo", "transformations": ["noise", "scale"], "strengths": [2]},
}


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"parameters": {"views": []}}, "views"),
        ({"parameters": {"views": ["torn"]}}, "'smooth-open'"),
        ({"parameters": {"views": ["open", "open"]}}, "each at most once"),
        ({"parameters": {"power": 0}}, "power"),
        ({"parameters": {"power": 1.5}}, "power"),
        ({"parameters": {"channels": 0}}, "channels"),
        ({"training": {**ON_ZOO, "creatures": -1}}, "creatures"),
        ({"training": {"correspondence": "vertex-order", "collection": "zoo"}}, "simulates"),
        ({"training": {"transformations": ["noise", "all"], "creatures": 1000}}, "comparisons"),
        ({"method": "spline", "parameters": {}, "training": {"creatures": 3}}, "creatures: extra"),
    ],
)
def test_banks_that_make_no_sense_are_refused_and_write_nothing(
    zoo: Api, body: Json, words: str
) -> None:
    before = counts(zoo)
    problem = zoo.post("/v1/models", 422, json={**BANK, **body})
    assert words in problem["detail"]
    assert counts(zoo) == before


def test_one_shape_is_too_little_for_a_bank(zoo: Api) -> None:
    zoo.post("/v1/collections", 201, json={"name": "one"})
    zoo.upload("one", {"a.off": EGG})
    zoo.work()
    training = {**BANK["training"], "collection": "one"}
    problem = zoo.post("/v1/models", 409, json={**BANK, "training": training})
    assert problem["type"] == "/problems/insufficient-training-data"
    assert "at least 2 shapes are needed" in problem["detail"]


@pytest.mark.parametrize(("view", "eigenpairs"), [("closed", 100), ("detailed", 200)])
def test_a_bank_is_trained_activated_and_searched_under(
    zoo: Api, view: str, eigenpairs: int
) -> None:
    parameters = {**BANK["parameters"], "views": [view]}
    answer = zoo.post("/v1/models", 202, json={**BANK, "parameters": parameters})
    total = 5 + 5 * 2
    assert answer["job"]["progress"] == {"done": 0, "total": total, "unit": "variants"}
    assert (answer["model"]["state"], answer["model"]["channels"]) == ("training", [])
    assert zoo.work() == total + 1
    model = zoo.get("/v1/models/mine")
    assert (model["state"], model["fusion"]) == ("ready", {"power": 0.25})
    assert 1 <= len(model["channels"]) <= 8
    assert [(one["name"], one["eigenpairs"]) for one in model["views"]] == [(view, eigenpairs)]
    assert {curve["name"] for curve in model["kernels"]} == {
        channel["name"] for channel in model["channels"] if channel["kernel"]
    }
    assert {"rows", "ablation", "similarity", "failed_variants"} <= model["training"].keys()
    zoo.put("/v1/collections/zoo/model", json={"model": "mine"})
    zoo.work()
    found = zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])
    assert found["model"] == "mine"
    assert found["matches"][0]["shape"]["name"] == ZOO[1]  # the same shape in another size
    assert found["matches"][0]["similarity"] > 0.95
    assert found["matches"][0]["similarity"] > found["matches"][1]["similarity"]


def test_a_bank_goes_on_without_the_shapes_that_failed(zoo: Api) -> None:
    """Half of a collection is no mesh at all: what is ready is learned from."""
    bad = {f"bad-{i}.off": b"OFF\n3 1 0\n" + str(i).encode() for i in range(5)}
    zoo.upload("zoo", bad)
    zoo.work()
    assert zoo.get("/v1/collections/zoo")["failed_count"] == 5
    zoo.post("/v1/models", 202, json=BANK)
    zoo.work()
    report = zoo.get("/v1/models/mine")["training"]
    assert (report["n_references"], report["n_failed_variants"]) == (5, 0)
