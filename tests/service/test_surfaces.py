"""What there is to see of a mesh that was asked with is what a shape of the same bytes shows."""

import pytest

from tests.meshes import octahedron, scaled
from tests.service.running import EGG, GEM, Api, off
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse

COMPUTED = ("/mesh?format=glb", "/spectrum", "/signature")


def asked_with(api: Api, content: bytes) -> str:
    """Path of a query whose mesh is described."""
    path = f"/v1/queries/{api.ask_mesh('zoo', content, 202)['query_id']}"
    api.work()
    return path


def test_a_query_shows_the_file_that_it_was_asked_with(zoo: Api) -> None:
    path = asked_with(zoo, EGG)
    answer = zoo.client.get(f"{path}/mesh")
    assert answer.content == EGG
    assert answer.headers["ETag"] == f'"{zoo.get(path)["query"]["sha256"]}"'
    given = {"If-None-Match": answer.headers["ETag"]}
    assert zoo.client.get(f"{path}/mesh", headers=given).status_code == 304
    glb = zoo.client.get(f"{path}/mesh?format=glb")
    assert 'filename="query.glb"' in glb.headers["Content-Disposition"]
    cleaned = clean(parse(EGG, filename="").mesh).mesh
    assert parse(glb.content, filename="").mesh.n_vertices == cleaned.n_vertices


@pytest.mark.parametrize(
    "part",
    [
        *("/mesh", "/mesh?format=glb", "/mesh?format=obj", "/spectrum", "/signature"),
        *("/signature?kernel=biharmonic", "/signature?kernel=model:heat"),
    ],
)
def test_a_shape_of_the_same_bytes_shows_the_same(zoo: Api, part: str) -> None:
    query = asked_with(zoo, GEM)
    zoo.upload("zoo", {"gem.off": GEM})
    zoo.work()
    (shape,) = zoo.get("/v1/collections/zoo/shapes?name=gem.off")["items"]
    assert zoo.get(query + part) == zoo.get(f"/v1/shapes/{shape['id']}{part}")


def test_a_query_is_seen_under_its_own_model(zoo: Api) -> None:
    path = asked_with(zoo, EGG)
    zoo.put("/v1/collections/zoo/model", json={"model": "shape-dna"})
    zoo.work()
    assert zoo.get(f"{path}/signature") == zoo.get(f"{path}/signature?kernel=heat:0.15")
    assert zoo.get(f"{path}/spectrum")["eigenvalues"]
    zoo.get(f"{path}/signature?kernel=magic", 422)
    zoo.get(f"{path}/signature?kernel=model:magic", 404)


def test_a_query_in_work_is_not_ready_and_one_that_failed_says_why(zoo: Api) -> None:
    fresh = off(scaled(octahedron(), 2.0))  # of which no spectrum is stored
    waiting = f"/v1/queries/{zoo.ask_mesh('zoo', fresh, 202)['query_id']}"
    broken = f"/v1/queries/{zoo.ask_mesh('zoo', b'no mesh', 202)['query_id']}"
    for part in COMPUTED:
        problem = zoo.get(waiting + part, 409)
        assert problem["type"] == "/problems/shape-not-ready"
        assert "queued" in problem["detail"]
    assert zoo.get(f"{waiting}/mesh") == fresh
    zoo.work()
    for part in COMPUTED:
        zoo.get(waiting + part)
        problem = zoo.get(broken + part, 415)
        assert problem["type"] == "/problems/unsupported-format"
        assert problem["detail"] == zoo.get(broken, 415)["detail"]
    cancelled = zoo.ask_mesh("zoo", b"nothing", 202)
    zoo.post(f"/v1/jobs/{cancelled['job']['id']}/cancel")
    path = f"/v1/queries/{cancelled['query_id']}/mesh"
    assert zoo.get(f"{path}?format=off", 409)["type"] == "/problems/cancelled"
    assert zoo.get(path) == b"nothing"


@pytest.mark.parametrize("identifier", ["1", "x" * 300, "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"])
def test_nothing_is_seen_of_a_query_that_there_is_not(api: Api, identifier: str) -> None:
    for part in ("/mesh", *COMPUTED):
        problem = api.get(f"/v1/queries/{identifier}{part}", 404)
        assert problem["type"] == "/problems/query-not-found"


def test_a_query_stays_to_be_seen_when_the_shape_of_its_bytes_is_gone(zoo: Api) -> None:
    path = asked_with(zoo, EGG)
    zoo.upload("zoo", {"egg.off": EGG})
    zoo.work()
    (shape,) = zoo.get("/v1/collections/zoo/shapes?name=egg.off")["items"]
    zoo.delete(f"/v1/shapes/{shape['id']}")
    for part in COMPUTED:
        zoo.get(path + part)
