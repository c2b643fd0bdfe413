"""Loose parts change a descriptor smoothly, and many equal parts are described as such."""

from functools import cache

import numpy as np
import pytest

from tests.meshes import bumpy_sphere, icosphere, octahedron, random_rotation, union
from workers.geometry.arrays import Float32Array
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import solve
from workers.retrieval.builtin import built_in_models
from workers.retrieval.channels.normalisation import part_spectra
from workers.retrieval.model import Model, describe
from workers.retrieval.scan import distances, rerank
from workers.storage.shipped_models import shipped_model

BODY = bumpy_sphere(3)
ROUNDING = 0.2  # a relative difference of 10⁻⁴ in all channels gives 0.1: their fourth root counts
MODELS = {
    model.name: model
    for model in (*built_in_models(working_vertices=800), shipped_model(working_vertices=800))
}


def described(mesh: TriangleMesh, model: Model) -> Float32Array:
    cleaned = clean(mesh).mesh
    return describe({view.name: solve(cleaned, view) for view in model.views}, model)


@cache
def body_under(name: str) -> Float32Array:
    return described(BODY, MODELS[name])


def distance(query: Float32Array, other: Float32Array, model: Model) -> float:
    rows = other[None]
    found = rerank(query, lambda places: rows[places], distances(query, rows, model), model)
    return float(found[0])


def with_balls(share: float) -> TriangleMesh:
    ball = icosphere(1, float(np.sqrt(share * BODY.area / (4.0 * np.pi))))
    return union(
        BODY, *(TriangleMesh(ball.vertices + np.array([x, 0, 0]), ball.faces) for x in (0.0, 3.0))
    )


@pytest.mark.parametrize("name", ["proteus", "heat"])
def test_the_distance_grows_with_the_share_of_loose_parts(name: str) -> None:
    model = MODELS[name]
    shares = [0.0005, 0.005, 0.011, 0.02, 0.05, 0.2]
    found = [distance(described(with_balls(s), model), body_under(name), model) for s in shares]
    assert found == sorted(found)
    other = distance(described(icosphere(3), model), body_under(name), model)
    assert found[0] < 0.02 * other
    assert found[2] < 0.2 * other
    assert found[3] < 0.3 * other
    assert found[4] < 0.8 * other


def test_loose_parts_just_above_and_below_a_share_are_nearly_alike() -> None:
    model = MODELS["proteus"]
    for share in (0.0001, 0.01):
        below, above = (described(with_balls(f * share), model) for f in (0.98, 1.02))
        assert distance(below, above, model) < ROUNDING


def heap(part: TriangleMesh, count: int, seed: int) -> TriangleMesh:
    rng = np.random.default_rng(seed)
    turned = [part.vertices @ random_rotation(rng).T for _ in range(count)]
    places = [
        TriangleMesh(one + np.array([3.0 * i, 0, 0]), part.faces) for i, one in enumerate(turned)
    ]
    return union(*places)


def test_equal_parts_in_other_places_are_the_same_surface_and_not_a_single_part() -> None:
    model = MODELS["proteus"]
    part = bumpy_sphere(1, seed=4)
    first, second = (described(heap(part, 12, seed), model) for seed in (1, 2))
    single = described(part, model)
    assert distance(first, second, model) < ROUNDING
    assert distance(first, single, model) > 0.3


def test_the_area_of_many_parts_is_that_of_all() -> None:
    model = MODELS["proteus"]
    solution = solve(clean(heap(octahedron(), 100, 1)).mesh, model.views[0])
    area = sum(part.copies * part.solution.spectrum.area for part in solution.parts)
    assert area == pytest.approx(100 * octahedron().area)


def test_pieces_of_a_body_are_seen_in_its_scale_and_small_parts_at_most_as_a_fourth() -> None:
    model = MODELS["heat"]
    halves = solve(clean(heap(BODY, 2, 1)).mesh, model.views[0]).parts
    for spectrum, rest in part_spectra(halves, "area"):
        assert spectrum.area == pytest.approx(0.5)
        assert rest == pytest.approx(0.0)
    many = solve(clean(heap(octahedron(), 60, 1)).mesh, model.views[0]).parts
    for spectrum, rest in part_spectra(many, "area"):
        assert 0.25 <= spectrum.area < 0.26
        assert rest == pytest.approx(np.log(60.0 * spectrum.area))
