"""Shapes: what is said of them, and what there is to see of them."""

import io
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from tests.service.running import ZOO, Api, zoo_files
from workers.diffusion.distances import diagonal_signature
from workers.diffusion.kernels import HeatKernel
from workers.geometry.cleaning import clean
from workers.geometry.formats import parse
from workers.geometry.preparation import prepare
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import default_view

BALL, RING, CRATE = "ball.null.0.off", "ring.null.0.ply", "crate.stl"


def names(page: dict[str, list[dict[str, str]]]) -> list[str]:
    return [shape["name"] for shape in page["items"]]


def test_a_shape_tells_what_its_name_and_its_mesh_say(zoo: Api) -> None:
    ball = zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}")
    assert (ball["label"], ball["transformation"], ball["strength"]) == ("ball", "null", 0)
    assert (ball["n_vertices"], ball["n_faces"], ball["n_components"]) == (162, 320, 1)
    assert (ball["state"], ball["error"], ball["format"]) == ("ready", None, "off")
    crate = zoo.get(f"/v1/shapes/{zoo.shape_ids[CRATE]}")
    assert (crate["label"], crate["n_vertices"], crate["n_boundary_loops"]) == (None, 8, 0)
    assert crate["area"] == pytest.approx(22.0)  # 2 (1·2 + 2·3 + 3·1)
    assert crate["repairs"] == ["merged 28 duplicate vertices"]


def test_lists_are_filtered_and_paged_in_the_order_of_upload(zoo: Api) -> None:
    path = "/v1/collections/zoo/shapes"
    assert sorted(names(zoo.get(path))) == sorted(ZOO)
    balls = names(zoo.get(path, params={"label": "ball"}))
    assert sorted(balls) == ["ball.null.0.off", "ball.scale.2.off"]
    assert names(zoo.get(path, params={"label": "ball", "transformation": "scale"})) == [ZOO[1]]
    assert names(zoo.get(path, params={"name": CRATE})) == [CRATE]
    assert names(zoo.get(path, params={"state": "failed"})) == []
    assert len(names(zoo.get(path, params={"state": "ready"}))) == 5
    seen: list[str] = []
    cursor = None
    while cursor or not seen:
        page = zoo.get(path, params={"limit": 2, **({"cursor": cursor} if cursor else {})})
        seen += names(page)
        cursor = page["next_cursor"]
    assert seen == names(zoo.get(path))
    for wrong in ({"state": "lost"}, {"limit": 0}, {"limit": 1001}, {"cursor": "?"}):
        zoo.get(path, 422, params=wrong)


def test_a_patch_changes_what_it_names_and_nothing_is_computed_again(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[BALL]}"
    before = zoo.get(path)
    body = {"label": "sphere", "metadata": {"a": [1, {"b": None}]}, "name": "round.off"}
    after = zoo.patch(path, json=body)
    assert after == {**before, **body}
    assert zoo.work() == 0
    assert zoo.patch(path, json={"label": None}) == {**after, "label": None}
    assert zoo.patch(path, json={"metadata": None})["metadata"] == {}
    assert zoo.patch(path, json={}) == zoo.get(path)
    for wrong in ({"name": None}, {"name": ""}, {"label": "x" * 256}, {"state": "ready"}):
        zoo.patch(path, 422, json=wrong)


def test_a_deleted_shape_is_gone_from_every_list_and_answer(zoo: Api) -> None:
    ball, twin = zoo.shape_ids[BALL], zoo.shape_ids["ball.scale.2.off"]
    assert zoo.ask("zoo", shape_id=ball)["matches"][0]["shape"]["id"] == twin
    zoo.delete(f"/v1/shapes/{twin}")
    answer = zoo.ask("zoo", shape_id=ball)
    assert twin not in [match["shape"]["id"] for match in answer["matches"]]
    assert answer["searched"] == 3
    zoo.get(f"/v1/shapes/{twin}", 404)
    zoo.delete(f"/v1/shapes/{twin}", 404)
    zoo.ask("zoo", 404, shape_id=twin)


@pytest.mark.parametrize("identifier", ["1", "x" * 300, "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c"])
def test_ids_that_are_none_are_not_found(api: Api, identifier: str) -> None:
    derived = ("/thumbnail.png", "/spectrum", "/signature", "/eigenfunction?number=1")
    for path in ("", "/mesh", *derived, "/distribution"):
        problem = api.get(f"/v1/shapes/{identifier}{path}", 404)
        assert problem["type"] == "/problems/shape-not-found"
    api.patch(f"/v1/shapes/{identifier}", 404, json={})
    assert api.get(f"/v1/jobs/{identifier}", 404)["type"] == "/problems/job-not-found"
    assert api.get(f"/v1/queries/{identifier}", 404)["type"] == "/problems/query-not-found"


def test_the_original_is_the_file_as_it_was_uploaded(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[RING]}/mesh"
    answer = zoo.client.get(path)
    assert answer.content == zoo_files()[RING]
    assert answer.headers["ETag"] == f'"{zoo.get(path.removesuffix("/mesh"))["sha256"]}"'
    assert answer.headers["Content-Disposition"].startswith(
        'attachment; filename="ring.null.0.ply"'
    )
    again = zoo.client.get(path, headers={"If-None-Match": f'"x", W/{answer.headers["ETag"]}'})
    assert (again.status_code, again.content) == (304, b"")
    assert zoo.client.get(path, headers={"If-None-Match": '"x"'}).status_code == 200


@pytest.mark.parametrize("form", ["off", "ply", "obj", "stl", "glb"])
def test_a_mesh_in_another_format_is_the_same_surface(zoo: Api, form: str) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[CRATE]}"
    answer = zoo.client.get(f"{path}/mesh", params={"format": form})
    assert f'filename="crate.{form}"' in answer.headers["Content-Disposition"]
    assert answer.headers["ETag"] == f'"{zoo.get(path)["sha256"]}"'
    parsed = parse(answer.content, filename="unnamed")
    assert parsed.format == form
    assert clean(parsed.mesh).mesh.n_vertices == 8
    assert parsed.mesh.area == pytest.approx(22.0, rel=1e-6)  # STL and GLB keep float32


def test_no_file_name_breaks_out_of_its_header(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[BALL]}"
    zoo.patch(path, json={"name": '..\\"x\r\nSet-Cookie: a=b;Kätzchen.off'})
    answer = zoo.client.get(f"{path}/mesh")
    assert "Set-Cookie" not in answer.headers
    plain = answer.headers["Content-Disposition"].split(";")[1]
    assert plain == ' filename="_x_Set-Cookie_a_b_K_tzchen.off"'
    zoo.get(f"{path}/mesh", 422, params={"format": "../../etc/passwd"})


def test_a_thumbnail_is_a_picture_of_256_by_256(zoo: Api) -> None:
    answer = zoo.client.get(f"/v1/shapes/{zoo.shape_ids[BALL]}/thumbnail.png")
    assert answer.headers["Content-Type"] == "image/png"
    with Image.open(io.BytesIO(answer.content)) as picture:
        assert picture.size == (256, 256)
        assert np.asarray(picture.convert("L")).std() > 1  # something is drawn


def test_the_spectrum_is_that_of_the_prepared_mesh(zoo: Api) -> None:
    answer = zoo.get(f"/v1/shapes/{zoo.shape_ids[RING]}/spectrum")
    mesh = clean(parse(zoo_files()[RING], filename=RING).mesh).mesh
    prepared = prepare(mesh, default_view(working_vertices=500)).mesh
    expected = compute_spectrum(prepared, n_eigenpairs=100)
    assert_allclose(answer["eigenvalues"], expected.eigenvalues, rtol=1e-9)
    assert answer["area"] == pytest.approx(expected.area)


def test_a_signature_has_a_value_for_every_vertex_of_the_glb(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[RING]}"
    mesh = parse(zoo.get(f"{path}/mesh?format=glb"), filename="ring.glb").mesh
    answer = zoo.client.get(f"{path}/signature")
    values = np.frombuffer(answer.content, dtype="<f4")
    assert values.shape == (mesh.n_vertices,)
    assert (values > 0).all()
    tag = {"If-None-Match": answer.headers["ETag"]}
    assert zoo.client.get(f"{path}/signature", headers=tag).status_code == 304
    assert zoo.client.get(f"{path}/signature?kernel=biharmonic", headers=tag).status_code == 200


def test_heat_time_counts_in_units_of_the_first_eigenvalue(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[RING]}"
    default = zoo.get(f"{path}/signature")
    assert (
        default
        == zoo.get(f"{path}/signature?kernel=heat:0.15")
        == zoo.get(f"{path}/signature?kernel=heat")
    )
    values = np.frombuffer(default, dtype="<f4")
    mesh = clean(parse(zoo_files()[RING], filename=RING).mesh).mesh
    spectrum = compute_spectrum(prepare(mesh, default_view(working_vertices=500)).mesh)
    expected = diagonal_signature(spectrum, HeatKernel(0.15 / spectrum.eigenvalues[0]))
    # carried from the finer working mesh: the same range but for interpolation
    assert_allclose(
        np.percentile(values, [10, 50, 90]), np.percentile(expected, [10, 50, 90]), 0.05
    )


@pytest.mark.parametrize(
    "kernel", ["magic", "heat:", "heat:x", "heat:0", "heat:nan", "biharmonic:2"]
)
def test_a_kernel_that_is_none_is_refused(zoo: Api, kernel: str) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[RING]}/signature"
    if kernel == "heat:":
        zoo.get(path, params={"kernel": kernel})
    else:
        zoo.get(path, 422, params={"kernel": kernel})


def test_a_distribution_stands_on_the_axis_of_its_channel(zoo: Api) -> None:
    path = f"/v1/shapes/{zoo.shape_ids[BALL]}/distribution"
    found = zoo.get(path)
    model = zoo.get("/v1/models/heat")
    assert (found["model"], found["channel"]) == ("heat", model["channels"][0]["name"])
    assert found["axis"] == {"kind": "edges", "values": model["channels"][0]["edges"]}
    assert len(found["values"]) == len(found["axis"]["values"]) - 1
    assert sum(found["values"]) == pytest.approx(1.0, rel=1e-5)
    twin = zoo.get(f"/v1/shapes/{zoo.shape_ids['ball.scale.2.off']}/distribution")
    assert_allclose(twin["values"], found["values"], atol=1e-6)  # heat at 0.15/λ₁ sees no scale
    zoo.get(path, 422, params={"channel": "none"})
    zoo.get(path, 404, params={"model": "none"})
    problem = zoo.get(path, 409, params={"model": "shape-dna"})
    assert problem["type"] == "/problems/model-not-ready"
    zoo.put("/v1/collections/zoo/model", json={"model": "shape-dna"})
    zoo.work()
    assert zoo.get(path)["axis"]["kind"] == "index"
    assert zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}/signature")  # of commute time


def test_what_is_not_computed_yet_says_so_and_what_failed_says_why(zoo: Api) -> None:
    shapes = zoo.upload("zoo", {"one.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"})["shapes"]
    path = f"/v1/shapes/{shapes[0]['id']}"
    derived = ("/mesh?format=glb", "/thumbnail.png", "/spectrum", "/signature", "/distribution")
    for part in derived:
        problem = zoo.get(path + part, 409)
        assert problem["type"] == "/problems/shape-not-ready"
        assert "queued" in problem["detail"]
    zoo.get(f"{path}/mesh")
    zoo.work()
    failed = zoo.get(path)
    assert (failed["state"], failed["error"]["type"]) == ("failed", "invalid-mesh")
    for part in derived:
        assert failed["error"]["detail"] in zoo.get(path + part, 409)["detail"]


def test_a_glb_starts_with_its_own_length(zoo: Api) -> None:
    data = zoo.get(f"/v1/shapes/{zoo.shape_ids[BALL]}/mesh?format=glb")
    assert struct.unpack("<4sII", data[:12]) == (b"glTF", 2, len(data))
