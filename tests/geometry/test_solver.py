"""A solver prepares what views have in common once, and that changes nothing."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    scaled,
    tetrahedron,
    translated,
    union,
)
from workers.errors import InvalidMeshError
from workers.geometry import preparation
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import Preparation, prepare
from workers.geometry.solution import Solver, solve
from workers.geometry.topology import count_components
from workers.geometry.views import Step, View, default_view, named_view, open_view, window_view

CREATURE = bumpy_sphere(4, 1)  # 2,562 vertices
TUBE = cylinder(60, 40)  # 2,460 vertices, two loops
PAIR = union(bumpy_sphere(3, 2), translated(icosphere(3, 0.9), (9.0, 0.0, 0.0)))
CLOSED, OPEN = default_view(working_vertices=400), open_view(working_vertices=400)
WINDOWS = window_view(working_vertices=400)


def assert_same(found: TriangleMesh, expected: TriangleMesh) -> None:
    assert_array_equal(found.vertices, expected.vertices)
    assert_array_equal(found.faces, expected.faces)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Names of the steps that were run, and of how many vertices."""
    seen: list[tuple[str, int]] = []

    def counted(name: str) -> object:
        step = preparation._STEPS[name]

        def run(mesh: TriangleMesh, parameters: Mapping[str, float]) -> object:
            seen.append((name, mesh.n_vertices))
            return step(mesh, parameters)

        return run

    monkeypatch.setattr(preparation, "_STEPS", {name: counted(name) for name in preparation._STEPS})
    return seen


@pytest.mark.parametrize("mesh", [CREATURE, TUBE, PAIR], ids=["creature", "tube", "pair"])
@pytest.mark.parametrize("view", [CLOSED, OPEN], ids=["closed", "open"])
def test_what_is_prepared_is_what_is_solved(mesh: TriangleMesh, view: View) -> None:
    few = replace(view, eigenpairs=12)
    solver = Solver(mesh)
    prepared = solver.prepared(few)
    assert_same(prepared, solve(mesh, few).mesh)
    assert_same(prepared, solver.under(few).mesh)
    assert_same(prepared, Solver(mesh).prepared(few))


def test_components_are_prepared_apart_and_one_after_the_other() -> None:
    prepared = Solver(PAIR).prepared(WINDOWS)
    assert count_components(prepared) == 2
    assert prepared.area == pytest.approx(PAIR.area, rel=0.03)


def test_a_component_that_the_view_leaves_nothing_of_is_left_out() -> None:
    """Of none at all nothing is left: that is said."""
    crumb = scaled(tetrahedron(), 0.9)
    few = View("few", (Step("simplify", {"vertices": 3}),))
    mesh = union(bumpy_sphere(2, 3), translated(crumb, (9.0, 0.0, 0.0)))

    def fails_on_crumbs(mesh: TriangleMesh, _: Mapping[str, float]) -> tuple[TriangleMesh, ...]:
        raise InvalidMeshError(f"{mesh.n_vertices} vertices are too few")

    original = preparation._STEPS["simplify"]
    with pytest.MonkeyPatch.context() as patch:

        def simplify(mesh: TriangleMesh, parameters: Mapping[str, float]) -> object:
            return (fails_on_crumbs if mesh.n_vertices < 10 else original)(mesh, parameters)

        steps = {**preparation._STEPS, "simplify": simplify}
        patch.setattr(preparation, "_STEPS", steps)
        view = View("some", (Step("simplify", {"vertices": 100}),))
        prepared = Solver(mesh).prepared(view)
        assert count_components(prepared) == 1
        patch.setattr(preparation, "_STEPS", {**steps, "simplify": fails_on_crumbs})
        with pytest.raises(InvalidMeshError, match="too few"):
            Solver(mesh).prepared(few)


def test_steps_that_views_share_run_once(runs: list[tuple[str, int]]) -> None:
    """No hole is capped of a closed shape, so all views size and simplify the same mesh."""
    solver = Solver(CREATURE)
    solver.prepared(CLOSED)
    first = list(runs)
    assert [name for name, _ in first] == ["cap-holes", "refine", "coarsen", "simplify", "double"]
    solver.prepared(OPEN)
    assert runs == first
    solver.prepared(WINDOWS)
    # Loops of another length are capped, and noise is looked for; then nothing is to be refined.
    own = [("cap-holes", CREATURE.n_vertices), ("fair-rough", 800), ("refine", 800)]
    assert runs[len(first) :] == own
    again = list(runs)
    for view in (CLOSED, OPEN, WINDOWS):
        solver.prepared(view)
        solver.under(replace(view, eigenpairs=10))
    assert runs == again


def test_a_step_after_another_mesh_is_run_again(runs: list[tuple[str, int]]) -> None:
    """A tube is capped under "closed" and stays open under "open"."""
    solver = Solver(TUBE)
    closed, opened = solver.prepared(CLOSED), solver.prepared(OPEN)
    assert [name for name, _ in runs].count("simplify") == 2
    assert not np.array_equal(closed.faces, opened.faces)


@pytest.mark.parametrize("mesh", [CREATURE, TUBE], ids=["creature", "tube"])
def test_meshes_and_notes_are_the_same_whatever_ran_before(mesh: TriangleMesh) -> None:
    smooth = named_view("smooth", working_vertices=400)
    shared = Preparation(mesh)
    views = (OPEN, smooth, WINDOWS, CLOSED)
    found = {view.name: shared.under(view) for view in views}
    for view in views:
        alone = prepare(mesh, view)
        assert_same(found[view.name].mesh, alone.mesh)
        assert found[view.name].notes == alone.notes
        assert any(note.startswith("simplify: ") for note in alone.notes)


def test_a_step_that_fails_is_told_by_the_view_that_asks() -> None:
    flat = View("flat", (Step("simplify", {"vertices": 3}),))
    thin = replace(flat, name="thin")

    def flattened(mesh: TriangleMesh, _: Mapping[str, float]) -> tuple[TriangleMesh, tuple[str]]:
        return TriangleMesh(mesh.vertices, mesh.faces[:2]), ("two faces",)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preparation, "_STEPS", {**preparation._STEPS, "simplify": flattened})
        shared = Preparation(CREATURE)
        for view in (flat, thin, flat):
            with pytest.raises(InvalidMeshError, match=f"of the view {view.name!r} left 2 of"):
                shared.under(view)


def test_the_view_of_windows_caps_small_holes_alone() -> None:
    pricked = TriangleMesh(CREATURE.vertices, CREATURE.faces[1:])
    assert prepare(TUBE, WINDOWS).notes[0].startswith("coarsen")  # p² / A of its rims is π
    assert prepare(pricked, WINDOWS).notes[0] == "cap-holes: added 1 faces"


def test_it_is_told_what_is_done() -> None:
    said: list[str] = []
    solver = Solver(CREATURE, said.append)
    solver.prepared(WINDOWS)
    assert said == ["simplifying"]
