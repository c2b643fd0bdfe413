"""``proteus correspondence``: figures, arrays and a picture."""

import io
import json
from pathlib import Path

import numpy as np
from PIL import Image

from proteus.cli.query import PICTURED
from proteus.matched_points import PICTURE_PIXELS, Pair, draw
from tests.meshes import bumpy_sphere
from tests.proteus.conftest import Run
from tests.proteus.real_service import RealService
from tests.service.running import EGG, ZOO
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import write


def ids(service: RealService) -> dict[str, str]:
    with service.client() as client:
        return {shape["name"]: shape["id"] for shape in client.pages("/v1/collections/zoo/shapes")}


def test_figures_arrays_and_a_picture(run: Run, service: RealService, tmp_path: Path) -> None:
    known = ids(service)
    out, picture = tmp_path / "found.npz", tmp_path / "found.png"
    pair = known[ZOO[0]], known[ZOO[1]]
    result = run("correspondence", *pair, "--out", out, "--picture", picture)
    assert result.exit_code == 0, result.stderr
    assert "coverage" in result.stdout
    with np.load(out) as arrays:
        assert arrays["faces"].shape == arrays["confidence"].shape
    with Image.open(picture) as image:
        assert image.width > 1000
    found = json.loads(run("correspondence", *pair, "--json").stdout)
    assert set(found) == {"scale", "mirrored", "coverage", "mean_confidence", "points"}
    assert abs(found["scale"] - 3.0) < 0.1
    assert found["mirrored"] is False


def test_a_query_and_a_missing_shape(run: Run, service: RealService) -> None:
    known = ids(service)
    with service.client() as client:
        path = "/v1/collections/zoo/query/mesh"
        answer = client.request(
            "POST", path, params={"wait": 60}, files=[("mesh", ("egg.off", EGG))]
        )
        query = answer.headers["Location"].rpartition("/")[2]
    assert run("correspondence", query, known[ZOO[3]], "--query").exit_code == 0
    result = run("correspondence", known[ZOO[0]], "no-such-shape")
    assert result.exit_code == 1
    assert "there is no shape" in result.stderr


def test_a_query_is_drawn_beside_its_first_matches(
    run: Run, service: RealService, tmp_path: Path
) -> None:
    mesh, picture = tmp_path / "egg.off", tmp_path / "where.png"
    mesh.write_bytes(EGG)
    by_mesh = "query", mesh, "-c", "zoo", "--part", "-n", "2", "--picture", picture
    by_shape = "query", "--shape", ids(service)[ZOO[0]], "-c", "zoo", "--picture", picture
    for command, rows in ((by_mesh, 2), (by_shape, PICTURED)):
        result = run(*command)
        assert result.exit_code == 0, result.stderr
        with Image.open(picture) as image:
            assert image.height > rows * PICTURE_PIXELS
            assert image.height < (rows + 1) * PICTURE_PIXELS
            assert image.width == 2 * PICTURE_PIXELS
    nothing = run("query", mesh, "-c", "zoo", "-f", "label=none", "--picture", picture)
    assert nothing.exit_code == 1
    assert "nothing to draw" in nothing.stderr


def test_a_match_without_a_correspondence_is_grey() -> None:
    glb = write(bumpy_sphere(2), "glb")
    with Image.open(io.BytesIO(draw([Pair(glb, glb, None, "1. ball")]))) as image:
        shapes = np.asarray(image, dtype=np.float64)[:PICTURE_PIXELS]
    assert np.ptp(shapes, axis=2).max() < 3


def test_a_long_name_does_not_run_out_of_its_picture() -> None:
    glb = write(bumpy_sphere(2), "glb")
    with Image.open(io.BytesIO(draw([Pair(glb, glb, None, "1. " + "m" * 200)]))) as image:
        below = np.asarray(image, dtype=np.float64)[PICTURE_PIXELS:]
    inked = np.flatnonzero((below < 128.0).any(axis=(0, 2)))
    assert len(inked) > 0
    assert inked.min() > PICTURE_PIXELS - 64
    assert inked.max() < 2 * PICTURE_PIXELS - 1


def test_points_that_correspond_have_the_same_colour_and_others_are_grey() -> None:
    mesh = bumpy_sphere(2)
    faces = np.zeros(mesh.n_vertices, dtype=np.int64)
    weights = np.zeros((mesh.n_vertices, 3))
    for corner in range(3):
        faces[mesh.faces[:, corner]] = np.arange(mesh.n_faces)
    for corner in range(3):
        weights[mesh.faces[faces, corner] == np.arange(mesh.n_vertices), corner] = 1.0
    arrays = {"faces": faces, "barycentric": weights}
    sure, unsure = np.ones(mesh.n_vertices), np.zeros(mesh.n_vertices)

    def halves(confidence: FloatArray) -> tuple[FloatArray, FloatArray]:
        glb = write(mesh, "glb")
        found = {**arrays, "confidence": confidence, "covered": sure}
        drawn = draw([Pair(glb, glb, found)])
        with Image.open(io.BytesIO(drawn)) as image:
            left, right = np.split(np.asarray(image, dtype=np.float64), 2, axis=1)
        return left, right

    left, right = halves(sure)
    assert np.array_equal(left, right)
    left, _ = halves(unsure)
    assert np.ptp(left, axis=2).max() < 3
