"""Why two shapes match: the distance of a query's answer, taken apart."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import octahedron, scaled
from tests.service.running import EGG, ZOO, Api, Json, off
from workers.storage.trained_models import load_model

BALL, TWIN, RING, GREY, CRATE = ZOO
ABSENT = "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"


def comparison(api: Api, match: str, status: int = 200, /, **params: str) -> Json:
    found: Json = api.get(f"/v1/shapes/{match}/comparison", status, params=params)
    return found


def check(api: Api, answer: Json, **params: str) -> list[Json]:
    """Assert that each match of an answer is explained by shares that sum to its distance.

    Where windows were compared, too, it is the distance of the descriptors.
    """
    explained = []
    for match in answer["matches"]:
        shape = match["shape"]["id"]
        found = comparison(api, shape, **params)
        assert (found["shape_id"], found["model"]) == (shape, answer["model"])
        if not answer["searched_closely"]:
            assert found["distance"] == match["distance"]
            assert found["similarity"] == match["similarity"]
        shares = [channel["share"] for channel in found["channels"]]
        assert_allclose(sum(shares), found["distance"], rtol=1e-12)
        assert shares == sorted(shares, reverse=True)
        explained.append(found)
    return explained


def move_to(api: Api, model: str) -> None:
    api.put("/v1/collections/zoo/model", json={"model": model})
    api.work()


def test_a_match_of_a_stored_shape_is_explained_under_heat(zoo: Api) -> None:
    ring = zoo.shape_ids[RING]
    answer = zoo.ask("zoo", shape_id=ring, include_self=True)
    for found in check(zoo, answer, shape_id=ring):
        assert found["asked_with"] == {"shape_id": ring, "query_id": None}
        assert found["fusion"] == zoo.get("/v1/models/heat")["fusion"]
        (channel,) = found["channels"]
        (described,) = zoo.get("/v1/models/heat")["channels"]
        assert {key: channel[key] for key in described.keys() & channel.keys()} == {
            key: described[key] for key in described.keys() & channel.keys()
        }
        for key, shape in (("values", found["shape_id"]), ("asked_values", ring)):
            shown = zoo.get(f"/v1/shapes/{shape}/distribution")
            assert (channel[key], channel["axis"]) == (shown["values"], shown["axis"])
        difference = np.subtract(channel["values"], channel["asked_values"])
        assert channel["distance"] == pytest.approx(np.abs(difference).sum(), rel=1e-6)
    others = zoo.ask("zoo", shape_id=ring, dissimilarity="earth-movers")
    check(zoo, others, shape_id=ring, dissimilarity="earth-movers")


def test_a_match_of_a_mesh_is_explained_as_it_was_asked(zoo: Api) -> None:
    first = zoo.ask_mesh("zoo", EGG, 202)["query_id"]
    query = zoo.ask_mesh("zoo", EGG, 202, dissimilarity="hellinger")["query_id"]
    zoo.work()
    for asked, way in ((first, "l1"), (query, "hellinger")):
        for found in check(zoo, zoo.get(f"/v1/queries/{asked}"), query_id=asked):
            assert found["asked_with"] == {"shape_id": None, "query_id": asked}
            assert {channel["dissimilarity"] for channel in found["channels"]} == {way}
    move_to(zoo, "shape-dna")
    match = zoo.shape_ids[BALL]
    assert comparison(zoo, match, shape_id=zoo.shape_ids[RING])["model"] == "shape-dna"
    problem = comparison(zoo, match, 409, query_id=query, model="shape-dna")
    assert "'heat', but not under 'shape-dna'" in problem["detail"]


def test_points_are_looked_for_under_the_default_model_in_one_direction(zoo: Api) -> None:
    move_to(zoo, "proteus")
    with zoo.services.database.read() as session:
        model = load_model(session, "proteus")
    ring, ball = zoo.shape_ids[RING], zoo.shape_ids[BALL]
    compared = {channel.name for channel in model.channels}
    for found in check(zoo, zoo.ask("zoo", shape_id=ring), shape_id=ring):
        assert {channel["name"] for channel in found["channels"]} == compared
        for part in found["channels"]:
            expected = part["weight"] * (part["distance"] / part["scale"]) ** 0.25
            assert part["share"] == pytest.approx(expected, rel=1e-12)
    there, back = (
        {part["name"]: part["distance"] for part in found["channels"]}
        for found in (comparison(zoo, ring, shape_id=ball), comparison(zoo, ball, shape_id=ring))
    )
    one_sided = {channel.name for channel in model.reranked}
    assert one_sided
    assert {name for name in there if there[name] != back[name]} == one_sided
    query = zoo.ask_mesh("zoo", EGG, 202)["query_id"]
    zoo.work()
    check(zoo, zoo.get(f"/v1/queries/{query}"), query_id=query)


def test_a_comparison_is_of_two_that_there_are(zoo: Api) -> None:
    ball, ring = zoo.shape_ids[BALL], zoo.shape_ids[RING]
    for wrong in ({}, {"shape_id": ring, "query_id": ABSENT}):
        assert "exactly one" in comparison(zoo, ball, 422, **wrong)["detail"]
    not_found = "/problems/{}-not-found"
    for kind, wrong in (
        ("shape", {"shape_id": ABSENT}),
        ("shape", {"shape_id": ""}),
        ("query", {"query_id": "x" * 200}),
        ("model", {"shape_id": ring, "model": "magic"}),
    ):
        assert comparison(zoo, ball, 404, **wrong)["type"] == not_found.format(kind)
    assert comparison(zoo, ABSENT, 404, shape_id=ring)["type"] == not_found.format("shape")
    comparison(zoo, ball, 422, shape_id="\x00")
    comparison(zoo, ball, 422, shape_id=ring, dissimilarity="cosine")
    problem = comparison(zoo, ball, 409, shape_id=ring, model="shape-dna")
    assert problem["type"] == "/problems/model-not-ready"


def test_what_is_not_described_yet_is_not_compared(zoo: Api) -> None:
    ball = zoo.shape_ids[BALL]
    (waiting,) = zoo.upload("zoo", {"egg.off": EGG})["shapes"]
    assert "queued" in comparison(zoo, ball, 409, shape_id=waiting["id"])["detail"]
    assert "queued" in comparison(zoo, waiting["id"], 409, shape_id=ball)["detail"]
    query = zoo.ask_mesh("zoo", off(scaled(octahedron(), 3.0)), 202)["query_id"]
    assert "queued" in comparison(zoo, ball, 409, query_id=query)["detail"]
    broken = zoo.ask_mesh("zoo", b"no mesh", 202)["query_id"]
    zoo.work()
    comparison(zoo, ball, query_id=query)
    assert comparison(zoo, ball, 415, query_id=broken)["type"] == "/problems/unsupported-format"
