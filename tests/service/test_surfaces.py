"""What there is to see of a mesh, of a query as of a shape of the same bytes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import octahedron, scaled
from tests.service.running import EGG, GEM, ZOO, Api, off, zoo_files
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.laplacian import mesh_laplacian

BALL = ZOO[0]
COMPUTED = ("/mesh?format=glb", "/spectrum", "/signature", "/eigenfunction?number=1")


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
        "/eigenfunction?number=2",
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


def test_an_eigenfunction_has_a_value_for_every_vertex_of_the_glb(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[BALL]}"
    mesh = clean(parse(zoo_files()[BALL], filename=BALL).mesh).mesh
    answer = zoo.client.get(f"{path}/eigenfunction?number=3")
    values = np.frombuffer(answer.content, dtype="<f4")
    assert values.shape == (mesh.n_vertices,)
    laplacian = mesh_laplacian(mesh)
    energy = values @ (laplacian.stiffness @ values)  # ∫|∇φ|² = λ where ∫φ² = 1
    mass = values @ (laplacian.areas * values)
    expected = zoo.get(f"{path}/spectrum")["eigenvalues"][2]
    # the working mesh is finer: what differs is the discretisation, of edges a sixth of the radius
    assert_allclose([mass, energy / mass], [1.0, expected], rtol=0.1)
    tag = {"If-None-Match": answer.headers["ETag"]}
    assert zoo.client.get(f"{path}/eigenfunction?number=3", headers=tag).status_code == 304
    assert zoo.client.get(f"{path}/eigenfunction?number=2", headers=tag).status_code == 200
    assert zoo.client.get(f"{path}/signature", headers=tag).status_code == 200


@pytest.mark.parametrize("number", ["0", "-1", "101", "1" * 30])
def test_a_number_without_an_eigenfunction_says_how_many_there_are(zoo: Api, number: str) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[BALL]}"
    count = len(zoo.get(f"{path}/spectrum")["eigenvalues"])
    problem = zoo.get(f"{path}/eigenfunction", 422, params={"number": number})
    assert f"has {count} of them" in problem["detail"]
    zoo.get(f"{path}/eigenfunction", 422)
    zoo.get(f"{path}/eigenfunction", 422, params={"number": "first"})
