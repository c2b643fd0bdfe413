"""Components count by their areas, smoothly, and are solved apart."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import bumpy_sphere, icosphere, octahedron, scaled, translated, union
from workers.errors import InvalidMeshError
from workers.geometry import solution as solution_module
from workers.geometry.arrays import FloatArray
from workers.geometry.components import (
    MOST_DESCRIBED,
    component_weights,
    described_components,
)
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import View, default_view, named_view
from workers.geometry.solution import Solution, solve
from workers.geometry.spectrum import compute_spectrum

areas_of_components = st.lists(st.floats(0.001, 1000.0), min_size=1, max_size=50).map(np.array)


@given(areas_of_components)
def test_weights_sum_to_one_and_grow_with_the_area(areas: FloatArray) -> None:
    weights = component_weights(areas)
    assert weights.sum() == pytest.approx(1.0)
    order = np.argsort(areas)
    assert (np.diff(weights[order]) >= -1e-15).all()


@given(areas_of_components, st.floats(1e-6, 1e6), st.integers(0, 99))
def test_weights_do_not_see_unit_or_order(areas: FloatArray, unit: float, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(areas))
    assert_allclose(component_weights(unit * areas[order]), component_weights(areas)[order], 1e-9)


@given(areas_of_components, st.floats(0.0, 0.1))
def test_weights_change_no_faster_than_areas(areas: FloatArray, change: float) -> None:
    grown = areas.copy()
    grown[0] *= 1.0 + change
    difference = np.abs(component_weights(grown) - component_weights(areas)).sum()
    assert difference <= 8.0 * change + 1e-12  # s t³ has the relative slope 1 + 3 · 2 at most


@pytest.mark.parametrize("share", [0.01, 0.022, 0.1])
def test_fragments_of_a_share_weigh_its_fourth_power(share: float) -> None:
    for count in (1, 2, 20):
        areas = np.array([1.0 - share, *[share / count] * count])
        weight = component_weights(areas)[1:].sum()
        body = (1.0 - share) * (0.5 * (1.0 - share) + share) ** 3
        assert (weight / (1.0 - weight) * body) ** 0.25 < share  # t counts their own kind half
        assert (weight / (1.0 - weight)) ** 0.25 == pytest.approx(share, rel=0.25)


def test_equal_components_weigh_the_same() -> None:
    assert_allclose(component_weights(np.ones(300)), 1.0 / 300.0)
    assert_allclose(component_weights(np.ones(3000)), 1.0 / 3000.0)


def test_a_connected_mesh_is_its_own_component() -> None:
    mesh = bumpy_sphere(2)
    found = described_components(mesh)
    assert found.equal_parts == 1.0
    assert found.parts[0].mesh is mesh


def test_components_come_with_vertices_of_their_own_the_largest_first() -> None:
    small, large = octahedron(), scaled(octahedron(), 1.5)
    found = described_components(union(small, translated(large, (5, 0, 0))))
    assert_array_equal(found.parts[0].mesh.vertices, large.vertices + np.array([5, 0, 0]))
    assert_array_equal(found.parts[1].mesh.faces, small.faces)
    assert sum(part.weight for part in found.parts) == pytest.approx(1.0)


def test_one_of_many_components_stands_for_others_of_its_size() -> None:
    many = union(*[translated(octahedron(), (3.0 * i, 0, 0)) for i in range(300)])
    found = described_components(many)
    assert len(found.parts) == MOST_DESCRIBED
    assert sum(part.copies for part in found.parts) == pytest.approx(300)
    assert found.equal_parts == pytest.approx(300)


def test_a_small_component_is_prepared_with_fewer_vertices() -> None:
    view = default_view()
    assert view.for_share(0.25) is view
    sizes = {step.name: step.parameters.get("vertices") for step in view.for_share(0.025).steps}
    assert sizes == {"cap-holes": None, "refine": 250, "simplify": 500, "double": None}
    assert view.for_share(0.125).steps[2].parameters["vertices"] == 2500


def test_a_surface_of_two_components_has_the_eigenvalues_of_both() -> None:
    near, far = icosphere(3), translated(scaled(bumpy_sphere(3), 0.9), (4, 0, 0))
    view = View("plain", (), 20)
    found = solve(union(near, far), view)
    values = np.sort(
        np.concatenate([compute_spectrum(m, n_eigenpairs=20).eigenvalues for m in (near, far)])
    )
    assert_allclose(found.spectrum.eigenvalues, values[:20], rtol=1e-9)
    weighted = found.spectrum.eigenvectors.T @ (
        found.spectrum.areas[:, None] * found.spectrum.eigenvectors
    )
    assert_allclose(weighted, np.eye(20), atol=1e-9)
    assert found.mesh.n_vertices == near.n_vertices + far.n_vertices
    assert found.mesh.area == pytest.approx(near.area + far.area)


def test_a_component_that_a_view_leaves_nothing_of_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_connected = solution_module._solve_connected

    def fail_for_small(mesh: TriangleMesh, view: View) -> Solution:
        if mesh.area < 1.0:
            raise InvalidMeshError("too thin")
        return solve_connected(mesh, view)

    monkeypatch.setattr(solution_module, "_solve_connected", fail_for_small)
    body, speck = bumpy_sphere(2), translated(scaled(octahedron(), 0.2), (4, 0, 0))
    found = solve(union(body, speck), named_view("closed"))
    assert [part.weight for part in found.parts] == [pytest.approx(1.0)]
    with pytest.raises(InvalidMeshError, match="too thin"):
        solve(union(speck, translated(speck, (1, 0, 0))), named_view("closed"))
