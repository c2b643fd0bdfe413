"""Correspondence over HTTP: a job computes it once, then it is answered at once."""

import io

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.service.running import EGG, ZOO, Api
from workers.geometry.formats import parse
from workers.storage.blobs import cleaned_key
from workers.storage.jobs import cancel_job

BALL, LARGE_BALL, RING, THIRD = ZOO[0], ZOO[1], ZOO[2], ZOO[3]
ABSENT = "0199b1c4-0000-7000-8000-000000000000"


def path_of(zoo: Api, first: str, second: str, *options: str) -> str:
    ids = zoo.shape_ids
    return "&".join([f"/v1/shapes/{ids[first]}/correspondence?shape={ids[second]}", *options])


def test_a_job_matches_two_shapes_and_the_result_stays(zoo: Api) -> None:
    path = path_of(zoo, BALL, LARGE_BALL)
    accepted = zoo.get(path, 202)
    assert accepted["job"]["kind"] == "correspondence"
    assert accepted["job"]["state"] == "queued"
    assert zoo.get(path, 202)["job"]["id"] == accepted["job"]["id"], "the same job"
    assert zoo.work() == 1
    found = zoo.get(path)
    first = parse(zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}/mesh?format=glb"), filename="").mesh
    other = f"/v1/shapes/{zoo.shape_ids[LARGE_BALL]}/mesh?format=glb"
    second = parse(zoo.get(other), filename="").mesh
    assert [point["vertex"] for point in found["points"]] == [*range(first.n_vertices)]
    faces = second.faces[[point["face"] for point in found["points"]]]
    weights = np.array([point["barycentric"] for point in found["points"]])
    places = np.einsum("nc,nci->ni", weights, second.vertices[faces])
    off = np.linalg.norm(places - 3.0 * first.vertices, axis=1) / np.sqrt(second.area)
    assert off.mean() < 0.02
    assert found["scale"] == pytest.approx(3.0, rel=0.02)
    assert found["mirrored"] is False
    assert found["coverage"] > 0.95
    assert len(found["stretch"]) == len(found["bending"]) == first.n_vertices
    assert np.abs(found["stretch"]).mean() < 0.1
    assert min(point["confidence"] for point in found["points"]) > 0.5
    assert zoo.work() == 0


def test_the_arrays_are_the_same_as_npz_and_have_a_tag(zoo: Api) -> None:
    path = path_of(zoo, BALL, THIRD)
    zoo.get(path, 202)
    zoo.work()
    found = zoo.get(path)
    answer = zoo.client.get(f"{path}&format=npz")
    assert answer.headers["content-type"] == "application/octet-stream"
    with np.load(io.BytesIO(answer.content)) as arrays:
        assert arrays["faces"].tolist() == [point["face"] for point in found["points"]]
        assert_allclose(arrays["stretch"], found["stretch"], atol=1e-6)
        n_second = zoo.get(f"/v1/shapes/{zoo.shape_ids[THIRD]}")["n_vertices"]
        assert arrays["covered"].shape == (n_second,)
        assert float(arrays["scale"]) == found["scale"]
    again = zoo.client.get(path, headers={"If-None-Match": answer.headers["ETag"]})
    assert again.status_code == 304


def test_the_way_back_is_another_result(zoo: Api) -> None:
    zoo.get(path_of(zoo, BALL, LARGE_BALL), 202)
    zoo.work()
    zoo.get(path_of(zoo, LARGE_BALL, BALL), 202)
    zoo.work()
    assert zoo.get(path_of(zoo, LARGE_BALL, BALL))["scale"] == pytest.approx(1.0 / 3.0, rel=0.02)


def test_a_query_corresponds_to_a_shape(zoo: Api) -> None:
    query = zoo.ask_mesh("zoo", EGG, 202)["query_id"]
    path = f"/v1/queries/{query}/correspondence?shape={zoo.shape_ids[THIRD]}"
    problem = zoo.get(path, 409)
    assert problem["type"] == "/problems/shape-not-ready"
    zoo.work()
    zoo.get(path, 202)
    zoo.work()
    points = zoo.get(path)["points"]
    glb = zoo.get(f"/v1/queries/{query}/mesh?format=glb")
    assert len(points) == parse(glb, filename="").mesh.n_vertices


def test_what_is_asked_for_must_exist(zoo: Api) -> None:
    ball = zoo.shape_ids[BALL]
    path = f"/v1/shapes/{ball}/correspondence"
    for missing in (ABSENT, "x", "%F0%9F%90%88"):
        assert zoo.get(f"{path}?shape={missing}", 404)["type"] == "/problems/shape-not-found"
    for absent in ("shapes", "queries"):
        zoo.get(f"/v1/{absent}/{ABSENT}/correspondence?shape={ball}", 404)
    zoo.get(path, 422)
    zoo.get(f"{path}?shape=%00", 422)
    zoo.get(f"{path}?shape={ball}&format=csv", 422)
    zoo.get(f"{path}?shape={ball}&wait=61", 422)
    assert zoo.work() == 0, "nothing was begun"


def test_shapes_that_are_not_computed_are_not_ready(zoo: Api) -> None:
    shape = zoo.upload("zoo", {"egg.off": EGG})["shapes"][0]["id"]
    zoo.services.blobs.delete(cleaned_key(zoo.get(f"/v1/shapes/{shape}")["sha256"]))
    ball = zoo.shape_ids[BALL]
    for path in (
        f"/v1/shapes/{ball}/correspondence?shape={shape}",
        f"/v1/shapes/{shape}/correspondence?shape={ball}",
    ):
        assert "expected ready" in zoo.get(path, 409)["detail"]


def test_a_failure_is_the_answer_and_a_cancelled_job_is_made_again(
    zoo: Api, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = path_of(zoo, RING, BALL)
    first = zoo.get(path, 202)["job"]["id"]
    with zoo.services.database.begin() as session:
        cancel_job(session, first)
    second = zoo.get(path, 202)["job"]["id"]
    assert second != first
    key = cleaned_key(zoo.get(f"/v1/shapes/{zoo.shape_ids[RING]}")["sha256"])
    data = zoo.services.blobs.get(key)
    zoo.services.blobs.delete(key)  # as if it were pruned meanwhile
    zoo.work()
    zoo.services.blobs.put(key, data)
    assert "was deleted" in zoo.get(path, 409)["detail"]
    later = "workers.pipeline.correspondence_plan.REMEMBERED_SECONDS"
    monkeypatch.setattr(later, -1)
    zoo.get(path, 202)
    zoo.work()
    zoo.get(path)


def test_wait_holds_on_for_the_job(zoo: Api) -> None:
    path = path_of(zoo, BALL, RING)
    with zoo.worker():
        found = zoo.get(f"{path}&wait=60")
    assert found["points"]
