"""Models over HTTP: the built-in ones, their channels and curves, and what protects them."""

import time

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.service.running import EGG, ZOO, Api
from workers.retrieval.builtin import built_in_models
from workers.storage.models import TrainedModel
from workers.storage.shipped_models import shipped_model


def add_model(api: Api, name: str, state: str = "ready") -> None:
    """Store a copy of ``heat`` as if it had been trained."""
    with api.services.database.begin() as session:
        heat = session.get_one(TrainedModel, "heat")
        session.add(
            TrainedModel(
                name=name,
                method="heat-time",
                state=state,
                built_in=False,
                definition={**heat.definition, "name": name} if state == "ready" else {},
                created_at=time.time(),
            )
        )


def test_the_built_in_models_are_there_from_the_first_start(api: Api) -> None:
    models = api.get("/v1/models")["items"]
    built_in = (
        *built_in_models(working_vertices=500),
        shipped_model(working_vertices=500),
    )
    expected = {model.name: model for model in built_in}
    assert {model["name"] for model in models} == expected.keys()
    assert {"proteus", "heat", "commute-time", "biharmonic", "shape-dna"} <= expected.keys()
    for model in models:
        assert model == api.get(f"/v1/models/{model['name']}")
        assert model["state"] == "ready"
        definition = expected[model["name"]].to_json()
        assert model["fusion"] == definition["fusion"]
        assert model["versions"] == definition["versions"]
        assert model["views"] == definition["views"]
        for channel, defined in zip(model["channels"], definition["channels"], strict=True):
            assert {key: channel[key] for key in defined} == defined


def test_the_shipped_model_tells_how_it_was_trained(api: Api) -> None:
    report = api.get("/v1/models/proteus")["training"]
    assert report["collection"] is None
    assert len(report["transformations"]) == 11
    assert report["rows"]["held_out"]["mean"] > 50.0
    assert {part["channel"] for part in report["ablation"]} == {
        channel.name for channel in shipped_model().channels
    }
    assert api.get("/v1/models/heat")["training"] is None


def test_curves_are_those_of_the_kernels(api: Api) -> None:
    heat = api.get("/v1/models/heat")
    (curve,) = heat["kernels"]
    time_ = heat["parameters"]["time"]
    eigenvalues = np.array(curve["eigenvalues"])
    assert_allclose(curve["squared_transfer"], np.exp(-2 * time_ * eigenvalues), rtol=1e-12)
    (curve,) = api.get("/v1/models/commute-time")["kernels"]
    assert_allclose(np.multiply(curve["squared_transfer"], curve["eigenvalues"]), 1, rtol=1e-12)
    assert api.get("/v1/models/shape-dna")["kernels"] == []


def test_models_are_paged_by_name(api: Api) -> None:
    first = api.get("/v1/models", params={"limit": 2})
    rest = api.get("/v1/models", params={"cursor": first["next_cursor"]})
    names = [model["name"] for model in first["items"] + rest["items"]]
    assert names == sorted(names)
    assert len(set(names)) == len(names)


def test_what_is_built_in_or_in_use_is_not_deleted(zoo: Api) -> None:
    assert "built in" in zoo.delete("/v1/models/heat", 409)["detail"]
    zoo.delete("/v1/models/none", 404)
    add_model(zoo, "mine")
    zoo.put("/v1/collections/zoo/model", json={"model": "mine"})
    zoo.work()
    assert "zoo" in zoo.delete("/v1/models/mine", 409)["detail"]
    zoo.put("/v1/collections/zoo/model", json={"model": "heat"})
    zoo.work()
    assert zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]], model="mine")["searched"] == 4
    zoo.delete("/v1/models/mine")
    zoo.ask("zoo", 404, shape_id=zoo.shape_ids[ZOO[0]], model="mine")
    zoo.get("/v1/models/mine", 404)


def test_a_model_in_training_has_no_channels_and_describes_nothing(zoo: Api) -> None:
    add_model(zoo, "young", state="training")
    found = zoo.get("/v1/models/young")
    assert (found["state"], found["channels"], found["kernels"]) == ("training", [], [])
    problem = zoo.put("/v1/collections/zoo/model", 409, json={"model": "young"})
    assert problem["type"] == "/problems/model-not-ready"
    zoo.post("/v1/collections", 409, json={"name": "new", "model": "young"})
    zoo.ask("zoo", 409, shape_id=zoo.shape_ids[ZOO[0]], model="young")


@pytest.mark.parametrize("name", ["%00", "x" * 64, "a%2Fb", "%ff"])
def test_names_that_are_none_are_not_found(api: Api, name: str) -> None:
    api.get(f"/v1/models/{name}", 404)


def test_a_collection_can_be_moved_to_the_trained_model(zoo: Api) -> None:
    """It is there from the start; a collection can be moved to it, and asked under it."""
    models = {model["name"]: model for model in zoo.get("/v1/models")["items"]}
    assert models["proteus"]["method"] == "bank"
    assert len(models["proteus"]["kernels"]) >= 4
    zoo.put("/v1/collections/zoo/model", json={"model": "proteus"})
    zoo.work()
    found = zoo.ask("zoo", shape_id=zoo.shape_ids[ZOO[0]])
    assert found["model"] == "proteus"
    assert found["matches"][0]["shape"]["name"] == ZOO[1]  # the same shape in another size
    assert found["matches"][0]["similarity"] > 0.99
    distances = [match["distance"] for match in found["matches"]]
    assert distances == sorted(distances)
    zoo.upload("zoo", {"late.off": EGG})
    zoo.work()
    first = zoo.ask_mesh("zoo", EGG)["matches"][0]  # its content is described already
    assert (first["distance"], first["similarity"]) == (0.0, 1.0)
