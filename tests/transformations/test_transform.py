"""What all transformations promise: determinism, origins, meshes that can be solved, errors."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import box, bumpy_sphere, cylinder, translated, union
from workers.creatures import Creature, make_creature
from workers.errors import InvalidRequestError
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import prepare
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import default_view, open_view
from workers.transformations import (
    PAPER_TRANSFORMATIONS,
    STRENGTHS,
    TRANSFORMATIONS,
    transform,
)
from workers.transformations.figure import draw_transformations
from workers.transformations.strengths import TABLE, settings

DOCUMENT = Path(__file__).parents[2] / "docs" / "transformations.md"
IN_PLACE = ("holes", "micro-holes", "partial", "view")  # vertices stay where they are
WHOLE = ("isometry", "scale", "local-scale", "noise", "shot-noise", "affine")  # all are kept


@cache
def creature_of(species: str) -> Creature:
    """A small individual, made once."""
    return make_creature(species, seed=0, vertices=2000)


@cache
def two_components() -> TriangleMesh:
    """A closed surface, and an open one beside it."""
    return union(bumpy_sphere(3), translated(cylinder(30, 20, radius=0.4), (2.5, 0.0, 0.0)))


SHAPES: dict[str, Callable[[], TriangleMesh]] = {
    "human": lambda: creature_of("human").rest,
    "octopus": lambda: creature_of("octopus").rest,
    "two components": two_components,
}


def test_the_paper_s_eleven_come_first_in_the_order_of_its_table() -> None:
    assert TRANSFORMATIONS[:11] == PAPER_TRANSFORMATIONS
    assert TRANSFORMATIONS[11:] == ("affine", "view", "scan")
    assert TRANSFORMATIONS[0] == "isometry"
    assert TRANSFORMATIONS[10] == "all"


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
def test_the_same_arguments_give_the_same_bytes_and_seeds_differ(transformation: str) -> None:
    mesh = creature_of("human").rest
    one, two = (transform(mesh, transformation, 3, seed=5) for _ in range(2))
    assert_array_equal(one.mesh.vertices, two.mesh.vertices)
    assert_array_equal(one.mesh.faces, two.mesh.faces)
    assert_array_equal(one.origin, two.origin)
    others = [transform(mesh, transformation, 3, seed=seed).mesh for seed in range(6, 8)]
    drawn = transformation != "sampling"  # nothing random is in it
    different = [not np.array_equal(one.mesh.vertices, other.vertices) for other in others]
    assert any(different) == drawn


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
def test_every_vertex_has_a_face_and_an_origin(transformation: str) -> None:
    mesh = creature_of("octopus").rest
    for strength in (2, 5):
        found = transform(mesh, transformation, strength, seed=1)
        assert_array_equal(np.unique(found.mesh.faces), np.arange(found.mesh.n_vertices))
        assert found.origin.shape == (found.mesh.n_vertices,)
        assert found.origin.min() >= 0
        assert found.origin.max() < mesh.n_vertices
        if transformation != "scan":  # finer than the mesh: several pixels see one vertex
            assert len(np.unique(found.origin)) == found.mesh.n_vertices
        assert found.mesh.n_faces >= 50
        assert np.isfinite(found.mesh.vertices).all()


@pytest.mark.parametrize("transformation", IN_PLACE)
def test_a_cut_leaves_what_it_leaves_in_place_on_the_pose(transformation: str) -> None:
    creature = creature_of("human")
    pose = creature.posed(1)
    found = transform(creature.rest, transformation, 4, seed=2, pose=pose)
    assert_array_equal(found.mesh.vertices, pose.vertices[found.origin])
    faces = {tuple(face) for face in creature.rest.faces.tolist()}
    assert {tuple(face) for face in found.origin[found.mesh.faces].tolist()} <= faces


@pytest.mark.parametrize("transformation", WHOLE)
def test_what_only_moves_vertices_keeps_all_faces(transformation: str) -> None:
    mesh = two_components()
    found = transform(mesh, transformation, 5, seed=0)
    assert_array_equal(found.origin, np.arange(mesh.n_vertices))
    assert_array_equal(found.mesh.faces, mesh.faces)


def test_with_a_pose_isometry_is_the_pose() -> None:
    creature = creature_of("human")
    pose = creature.posed(3)
    for strength in STRENGTHS:
        found = transform(creature.rest, "isometry", strength, seed=strength, pose=pose)
        assert_array_equal(found.mesh.vertices, pose.vertices)
        assert_array_equal(found.origin, np.arange(pose.n_vertices))


def test_all_at_once_happens_on_the_pose() -> None:
    creature = creature_of("human")
    pose = creature.posed(3)
    found = transform(creature.rest, "all", 1, seed=0, pose=pose)
    gaps = {}
    for name, mesh in (("pose", pose), ("rest", creature.rest)):
        one, two = (
            points - points.mean(axis=0)
            for points in (found.mesh.vertices, mesh.vertices[found.origin])
        )
        factor = np.sqrt((one**2).sum() / (two**2).sum())  # the mixture changes the scale
        gaps[name] = np.linalg.norm(one / factor - two, axis=1).mean()
    assert gaps["pose"] < 0.5 * gaps["rest"]


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_whatever_comes_out_can_be_cleaned_prepared_and_solved(
    shape: str, transformation: str
) -> None:
    mesh = SHAPES[shape]()
    for strength in (1, 5):
        found = clean(transform(mesh, transformation, strength, seed=4).mesh).mesh
        assert found.n_faces >= 50
        for view in (default_view(working_vertices=500), open_view(working_vertices=500)):
            spectrum = compute_spectrum(prepare(found, view).mesh, n_eigenpairs=10)
            assert len(spectrum.eigenvalues) == 10
            assert (spectrum.eigenvalues > 0).all()


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
def test_a_box_of_twelve_triangles_survives(transformation: str) -> None:
    found = transform(box(), transformation, 5, seed=0)
    assert found.mesh.n_faces >= 1
    assert np.isfinite(found.mesh.vertices).all()


@pytest.mark.parametrize("transformation", TRANSFORMATIONS)
def test_units_do_not_matter(transformation: str) -> None:
    mesh = creature_of("human").rest
    large = TriangleMesh(1000.0 * mesh.vertices, mesh.faces)
    one, two = (transform(m, transformation, 2, seed=0) for m in (mesh, large))
    assert_allclose(two.mesh.area, 1e6 * one.mesh.area, rtol=0.02)


def test_the_document_says_what_the_table_says() -> None:
    rows: dict[str, dict[str, list[float]]] = {}
    name = ""
    for line in DOCUMENT.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 7 or cells[0] == "transformation" or cells[0].startswith("---"):
            continue
        name = cells[0] or name
        rows.setdefault(name, {})[cells[1]] = [float(cell) for cell in cells[2:]]
    assert rows == {
        name: {quantity: list(levels) for quantity, levels in quantities.items()}
        for name, quantities in TABLE.items()
    }


def test_strengths_grow_or_shrink_without_turning() -> None:
    for quantities in TABLE.values():
        for levels in quantities.values():
            steps = np.diff(levels)
            assert (steps >= 0).all() or (steps <= 0).all()
    assert settings("holes", 5)["area left"] == 0.64


def test_the_figure_shows_all_with_their_names() -> None:
    sheet = draw_transformations(creature_of("human").rest, size=48)
    assert sheet.shape[1] == 5 * 48
    rows = sheet.shape[0] // 3  # 15 drawings
    shown = (sheet.min(axis=2) < 200).reshape(3, rows, 5, 48)[:, :48].mean(axis=(1, 3))
    assert (shown > 0.01).all()


def test_impossible_requests_are_refused() -> None:
    mesh = bumpy_sphere(2)
    with pytest.raises(
        InvalidRequestError, match="'rotation' is unknown, expected one of isometry"
    ):
        transform(mesh, "rotation", 1, seed=0)
    for strength in (0, 6, -1):
        with pytest.raises(InvalidRequestError, match=f"strength is {strength}, expected 1 to 5"):
            transform(mesh, "noise", strength, seed=0)
    with pytest.raises(InvalidRequestError, match="the seed is -1"):
        transform(mesh, "noise", 1, seed=-1)
    with pytest.raises(InvalidRequestError, match="the pose has 8 vertices, expected"):
        transform(mesh, "noise", 1, seed=0, pose=box())
