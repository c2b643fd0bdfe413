"""The same surface twice is one wall; two surfaces with something between them are two."""

import numpy as np
import pytest

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    translated,
    union,
)
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import count_components

BODY = bumpy_sphere(3)
SAID = "left out 1 shell that only doubled another one"


def turned(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.parametrize("offset", [1e-6, 1e-5, 1e-4, 3e-4])
@pytest.mark.parametrize("base", [BODY, cylinder(20, 10)], ids=["body", "tube"])
def test_one_of_two_sides_stays(base: TriangleMesh, offset: float) -> None:
    for other in (base, turned(base)):
        both = union(
            base, translated(scaled(other, 1.0 + offset), (0.3 * offset, 0.7 * offset, 0.0))
        )
        cleaned = clean(both)
        assert cleaned.repairs == (SAID,)
        assert cleaned.mesh.n_faces == base.n_faces
        assert clean(cleaned.mesh).mesh is cleaned.mesh


def test_the_side_that_is_wound_outward_stays() -> None:
    for first, second in ((BODY, turned(BODY)), (turned(BODY), BODY)):
        mesh = clean(union(first, scaled(second, 1.0001))).mesh
        corners = mesh.vertices[mesh.faces]
        assert np.linalg.det(corners).sum() > 0.0


def test_another_triangulation_of_the_same_surface_is_the_same_wall() -> None:
    fine, coarse = cylinder(60, 7), cylinder(60, 4)
    assert clean(union(coarse, scaled(fine, 1.0001))).mesh.n_faces == fine.n_faces


@pytest.mark.parametrize("thickness", [2e-3, 0.01, 0.1])
def test_a_wall_with_some_thickness_stays(thickness: float) -> None:
    both = union(BODY, turned(scaled(BODY, 1.0 - 2.0 * thickness)))
    assert clean(both).mesh is both


def test_equal_parts_in_other_places_stay() -> None:
    both = union(BODY, translated(BODY, (0.05, 0.0, 0.0)), translated(BODY, (9.0, 0.0, 0.0)))
    assert clean(both).mesh is both


def test_surfaces_with_the_same_box_and_area_stay() -> None:
    one = rectangle(10, 10)
    x, y, _ = one.vertices.T
    hill, dip = (
        TriangleMesh(np.stack([x, y, sign * 0.1 * np.sin(2 * np.pi * x)], axis=1), one.faces)
        for sign in (1.0, -1.0)
    )
    both = union(hill, translated(dip, (0.0, 1e-6, 0.0)))
    assert count_components(clean(both).mesh) == 2


@pytest.mark.parametrize("seed", range(3))
def test_neither_place_nor_unit_nor_numbering_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    both = union(BODY, scaled(turned(BODY), 1.0002), translated(icosphere(2), (7, 0, 0)))
    other, _ = renumbered(scaled(rotated(both, rng), 10.0**seed), rng)
    first, second = clean(both), clean(other)
    assert first.repairs == second.repairs == (SAID,)
    assert second.mesh.area / 100.0**seed == pytest.approx(first.mesh.area, rel=1e-9)
