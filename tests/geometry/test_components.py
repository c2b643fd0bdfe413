"""Components count by their areas, smoothly, and are solved apart."""

from collections.abc import Callable

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
    counted_shares,
    described_components,
)
from workers.geometry.preparation import Preparation
from workers.geometry.solution import Solution, solve
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.views import View, default_view, named_view

areas_of_components = st.lists(st.floats(0.001, 1000.0), min_size=1, max_size=50).map(np.array)


def weights_of(areas: FloatArray) -> FloatArray:
    counted = counted_shares(areas)
    weights: FloatArray = counted / counted.sum()
    return weights


@given(areas_of_components)
def test_no_more_than_the_area_counts_and_more_of_a_larger_component(areas: FloatArray) -> None:
    counted = counted_shares(areas)
    shares = areas / areas.sum()
    assert (counted <= shares * (1.0 + 1e-12)).all()
    order = np.argsort(areas)
    assert (np.diff(counted[order]) >= -1e-15).all()


@given(areas_of_components, st.floats(1e-6, 1e6), st.integers(0, 99))
def test_weights_do_not_see_unit_or_order(areas: FloatArray, unit: float, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(areas))
    assert_allclose(weights_of(unit * areas[order]), weights_of(areas)[order], 1e-9)


@given(areas_of_components, st.floats(0.0, 0.1))
def test_weights_change_no_faster_than_areas(areas: FloatArray, change: float) -> None:
    grown = areas.copy()
    grown[0] *= 1.0 + change
    difference = np.abs(weights_of(grown) - weights_of(areas)).sum()
    assert difference <= 14.0 * change + 1e-12  # s t³: slope 1 + 3 · 2, for it and for the others


def test_fragments_count_next_to_nothing_together_and_pieces_of_a_body_by_their_area() -> None:
    for count in (1, 2, 20):
        fragments = np.array([0.99, *[0.01 / count] * count])
        assert weights_of(fragments)[1:].sum() < 1e-4
    assert weights_of(np.array([0.77, 0.23]))[1] == pytest.approx(0.23, abs=0.04)
    assert weights_of(np.array([0.6, *[0.001] * 400]))[1:].sum() > 0.25


def test_equal_components_weigh_the_same() -> None:
    assert_allclose(counted_shares(np.ones(300)), 1.0 / 300.0)
    assert_allclose(counted_shares(np.ones(3000)), 1.0 / 3000.0)


def test_a_connected_mesh_is_its_own_component() -> None:
    mesh = bumpy_sphere(2)
    (found,) = described_components(mesh)
    assert found.body == 1.0
    assert found.mesh is mesh


def test_components_come_with_vertices_of_their_own_the_largest_first() -> None:
    small, large = octahedron(), scaled(octahedron(), 1.5)
    found = described_components(union(small, translated(large, (5, 0, 0))))
    assert_array_equal(found[0].mesh.vertices, large.vertices + np.array([5, 0, 0]))
    assert_array_equal(found[1].mesh.faces, small.faces)
    assert sum(part.weight for part in found) == pytest.approx(1.0)


def test_one_of_many_components_stands_for_others_of_its_size() -> None:
    many = union(*[translated(octahedron(), (3.0 * i, 0, 0)) for i in range(300)])
    found = described_components(many)
    assert len(found) == MOST_DESCRIBED
    assert sum(part.copies for part in found) == pytest.approx(300)
    assert all(part.body == pytest.approx(300) for part in found)


def test_a_small_component_is_prepared_with_fewer_vertices() -> None:
    view = default_view()
    assert view.for_share(0.25) is view
    # In proportion, at least a third: those of a fourth of a body reach as far as the body's.
    pairs = [view.for_share(weight).eigenpairs for weight in (0.2, 0.125, 0.025)]
    assert pairs == [80, 50, 34]
    sizes = [step.parameters.get("vertices") for step in view.for_share(0.025).steps]
    assert sizes == [None, 250, 1000, 500, None]
    sizes = [step.parameters.get("vertices") for step in view.for_share(0.125).steps]
    assert sizes == [None, 500, 5000, 2500, None]


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

    def fail_for_small(
        preparation: Preparation, view: View, enter: Callable[[str], None]
    ) -> Solution:
        if preparation.under(View("plain", ())).mesh.area < 1.0:
            raise InvalidMeshError("too thin")
        return solve_connected(preparation, view, enter)

    monkeypatch.setattr(solution_module, "_solve_connected", fail_for_small)
    body, speck = bumpy_sphere(2), translated(scaled(octahedron(), 0.2), (4, 0, 0))
    found = solve(union(body, speck), named_view("closed"))
    assert [part.weight for part in found.parts] == [pytest.approx(1.0)]
    with pytest.raises(InvalidMeshError, match="too thin"):
        solve(union(speck, translated(speck, (1, 0, 0))), named_view("closed"))
