"""Views: their steps, their keys, and the working meshes they make."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import (
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
)
from workers.errors import InvalidRequestError
from workers.geometry import views
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import prepare
from workers.geometry.smoothing import fair
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import boundary_loops
from workers.geometry.views import (
    FAIRING_ROUGH,
    Step,
    View,
    default_view,
    named_view,
    open_view,
    window_view,
)


def test_the_default_view_closes_refines_and_simplifies() -> None:
    view = default_view(working_vertices=1500)
    assert [step.name for step in view.steps] == [
        *("cap-holes", "refine", "coarsen", "simplify", "double")
    ]
    assert len(boundary_loops(prepare(cylinder(20, 10), view).mesh)) == 0
    assert prepare(box(), view).mesh.n_vertices >= 1000
    assert prepare(bumpy_sphere(4), view).mesh.n_vertices == pytest.approx(1500, rel=0.02)


def test_the_open_view_leaves_the_boundary() -> None:
    assert len(boundary_loops(prepare(cylinder(40, 30), open_view()).mesh)) == 2


def test_the_detailed_view_is_the_closed_one_with_more_eigenpairs() -> None:
    detailed, closed = named_view("detailed", working_vertices=1500), default_view()
    assert detailed.steps == default_view(working_vertices=1500).steps
    assert detailed.eigenpairs == 2 * closed.eigenpairs
    assert detailed.key != default_view(working_vertices=1500).key


def test_a_sheet_is_doubled_once_it_is_simplified() -> None:
    strip = rectangle(200, 15, 20.0, 1.5)  # p² / A = 62
    prepared = prepare(strip, default_view(working_vertices=1500))
    assert len(boundary_loops(prepared.mesh)) == 0
    assert prepared.notes[-1].startswith("double: mirrored 1,")
    assert prepared.mesh.area == pytest.approx(2 * strip.area, rel=0.01)


def test_a_body_that_keeps_a_pinhole_is_not_doubled() -> None:
    """Simplification may lose a face; once it did, whole bodies came out twice."""
    body = icosphere(4)
    pricked = TriangleMesh(body.vertices, body.faces[1:])
    view = View("v", (Step("double", {"longest": 30.0}),))
    assert len(boundary_loops(pricked)) == 1
    assert prepare(pricked, view).mesh is pricked


def test_steps_say_what_they_did() -> None:
    prepared = prepare(cylinder(90, 90), default_view(working_vertices=1500))
    assert len(prepared.notes) == 3
    assert re.fullmatch(r"cap-holes: added [\d,]+ faces", prepared.notes[0])
    assert re.fullmatch(r"coarsen: [\d,]+ vertices made (2,9|3,0)\d\d", prepared.notes[1])
    assert re.fullmatch(r"simplify: (2,9|3,0)\d\d vertices made 1,[45]\d\d", prepared.notes[2])


def test_a_mesh_that_needs_nothing_is_returned_as_it_is() -> None:
    mesh = icosphere(4)
    prepared = prepare(mesh, default_view())
    assert prepared.mesh is mesh
    assert prepared.notes == ()


def test_copies_of_an_open_mesh_have_the_same_working_mesh() -> None:
    rng = np.random.default_rng(8)
    mesh = cylinder(50, 40)
    view = default_view(working_vertices=1200)
    expected = prepare(mesh, view).mesh
    copy, _ = renumbered(scaled(rotated(mesh, rng), 0.02), rng)
    found = prepare(copy, view).mesh
    assert_allclose(
        first_eigenvalues(found, 20) * found.area,
        first_eigenvalues(expected, 20) * expected.area,
        rtol=1e-9,
    )


def test_a_view_goes_through_json() -> None:
    for view in (default_view(), open_view(working_vertices=77), View("bare", (), 5)):
        assert View.from_json(view.to_json()) == view
        assert View.from_json(view.to_json()).key == view.key


def test_keys_name_the_view_and_change_with_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    view = default_view()
    assert re.fullmatch(r"closed-[0-9a-f]{12}", view.key)
    keys = {
        view.key,
        default_view(working_vertices=4999).key,
        View("closed", view.steps[::-1]).key,
        View("closed", view.steps, eigenpairs=99).key,
        open_view().key,
    }
    monkeypatch.setattr(views, "PREPARATION_VERSION", "other")
    keys.add(view.key)
    monkeypatch.undo()
    monkeypatch.setattr(views, "SOLVER_VERSION", "other")
    keys.add(view.key)
    assert len(keys) == 7


def test_whole_numbers_and_floats_have_one_key() -> None:
    one, other = (View("v", (Step("refine", {"vertices": n}),)) for n in (1000, 1000.0))
    assert one.key == other.key
    assert hash(one) == hash(other)


def test_windows_are_of_a_faired_mesh_only_where_it_is_noisy_and_before_it_is_refined() -> None:
    """Faces that were cut into four are flat inside, so that noise would not be seen there."""
    clean = icosphere(3)  # 642 vertices, which are refined to 2,562 and stay the first
    height = 1.0 + 0.03 * np.random.default_rng(0).normal(size=(clean.n_vertices, 1))
    noisy = TriangleMesh(clean.vertices * height, clean.faces)
    time = FAIRING_ROUGH.parameters["time"]
    for mesh, expected in ((clean, clean), (noisy, fair(noisy, time=time))):
        found = prepare(mesh, window_view()).mesh
        assert found.n_vertices == 2562
        assert_allclose(found.vertices[: mesh.n_vertices], expected.vertices, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        (
            "melt",
            {},
            "no preparation step 'melt'; expected one of .'cap-holes', 'coarsen', 'double'",
        ),
        ("refine", {}, "takes 'vertices', but was given"),
        ("refine", {"vertices": 1, "speed": 2}, "speed"),
        ("simplify", {"vertices": -1}, "expected a number from 0"),
        ("simplify", {"vertices": float("nan")}, "expected a number from 0"),
        ("simplify", {"vertices": "many"}, "expected a number from 0"),
    ],
)
def test_steps_that_make_no_sense_are_refused(
    name: str, parameters: dict[str, float], message: str
) -> None:
    with pytest.raises(InvalidRequestError, match=message):
        Step(name, parameters)


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"name": "a", "steps": None, "eigenpairs": 5},
        {"name": "a", "steps": [{"name": "refine"}], "eigenpairs": 5},
        {"name": "a", "steps": [], "eigenpairs": 0},
        {"name": 7, "steps": [], "eigenpairs": 5},
    ],
)
def test_views_that_make_no_sense_are_refused(content: dict[str, object]) -> None:
    with pytest.raises(InvalidRequestError):
        View.from_json(content)
