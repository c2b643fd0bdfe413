"""Laws of the operator, the spectrum and the steps of preparation, on random surfaces."""

from functools import partial

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    torus,
    union,
)
from workers.geometry.closing import close_loops, double
from workers.geometry.laplacian import mesh_laplacian
from workers.geometry.mesh import TriangleMesh
from workers.geometry.refinement import refine
from workers.geometry.smoothing import fair, roughness, smooth
from workers.geometry.spectrum import compute_spectrum
from workers.geometry.topology import boundary_loops, euler_characteristic

LAWS = settings(max_examples=12, deadline=None, derandomize=True)
SEEDS = st.integers(0, 2**16)
CLOSED = (icosphere(2), torus(12, 8), bumpy_sphere(2))
OPEN = (cylinder(10, 6), rectangle(9, 7, 2.0, 1.0))
TWO = union(bumpy_sphere(2), scaled(icosphere(1), 0.3))


@st.composite
def surfaces(draw: st.DrawFn, *bases: TriangleMesh) -> TriangleMesh:
    """One of the bases, stretched, its vertices moved at random: nothing about it is symmetric."""
    mesh = draw(st.sampled_from(bases or (*CLOSED, *OPEN, TWO)))
    rng = np.random.default_rng(draw(SEEDS))
    stretch = rng.uniform(0.5, 2.0, 3)
    shift = 0.01 * rng.normal(size=mesh.vertices.shape)
    return TriangleMesh((mesh.vertices + shift) * stretch, mesh.faces)


@given(surfaces())
@LAWS
def test_rows_of_the_stiffness_sum_to_zero_and_it_is_symmetric(mesh: TriangleMesh) -> None:
    laplacian = mesh_laplacian(mesh)
    stiffness = laplacian.stiffness.toarray()
    assert_array_equal(stiffness, stiffness.T)
    assert_allclose(stiffness.sum(axis=1), 0.0, atol=1e-12 * np.abs(stiffness).max())
    assert_allclose(laplacian.areas.sum(), mesh.area, rtol=1e-12)


@given(surfaces())
@LAWS
def test_the_coordinates_have_twice_the_area_as_energy(mesh: TriangleMesh) -> None:
    # The gradients of x, y and z on a face are the axes seen along it: squared, they sum to 2.
    stiffness = mesh_laplacian(mesh).stiffness
    energy = np.einsum("ni,ni->", mesh.vertices, stiffness @ mesh.vertices)
    assert_allclose(energy, 2.0 * mesh.area, rtol=1e-10)


@given(surfaces(), SEEDS, st.floats(-4.0, 4.0))
@LAWS
def test_a_copy_has_the_spectrum_over_the_square_of_its_scale(
    mesh: TriangleMesh, seed: int, exponent: float
) -> None:
    rng = np.random.default_rng(seed)
    factor = 10.0**exponent
    copy, order = renumbered(scaled(rotated(mesh, rng), factor), rng)
    plain, other = (compute_spectrum(one, n_eigenpairs=12) for one in (mesh, copy))
    assert_allclose(other.eigenvalues * factor**2, plain.eigenvalues, rtol=1e-8)
    assert_allclose(other.areas, plain.areas[order] * factor**2, rtol=1e-9)
    assert_allclose(other.area, plain.area * factor**2, rtol=1e-9)
    assert_allclose(plain.rescaled(factor).eigenvalues, other.eigenvalues, rtol=1e-8)
    # Below a gap, Σ φ² does not depend on which basis of an eigenspace a solver took.
    known = int(np.argmax(np.diff(plain.eigenvalues) / plain.eigenvalues[1:])) + 1
    ours, theirs = ((one.eigenvectors[:, :known] ** 2).sum(axis=1) for one in (plain, other))
    assert_allclose(theirs * factor**2, ours[order], atol=1e-6 * ours.max())


@given(surfaces(), st.integers(1, 40))
@LAWS
def test_eigenvectors_are_orthonormal_by_area(mesh: TriangleMesh, count: int) -> None:
    spectrum = compute_spectrum(mesh, n_eigenpairs=count)
    weighted = spectrum.areas[:, None] * spectrum.eigenvectors
    gram = spectrum.eigenvectors.T @ weighted
    assert_allclose(gram, np.eye(spectrum.n_eigenpairs), atol=1e-9)
    assert (spectrum.eigenvalues > 0).all()
    assert (np.diff(spectrum.eigenvalues) >= 0).all()
    image = mesh_laplacian(mesh).stiffness @ spectrum.eigenvectors
    assert_allclose(image, weighted * spectrum.eigenvalues, atol=1e-7 * np.abs(image).max())


@given(surfaces(), st.integers(1, 1500))
@LAWS
def test_refinement_keeps_the_surface(mesh: TriangleMesh, vertices: int) -> None:
    fine = refine(mesh, vertices=vertices)
    assert fine.n_vertices >= vertices
    assert_allclose(fine.area, mesh.area, rtol=1e-12)
    assert euler_characteristic(fine) == euler_characteristic(mesh)
    assert len(boundary_loops(fine)) == len(boundary_loops(mesh))
    assert_array_equal(fine.vertices[: mesh.n_vertices], mesh.vertices)


@given(surfaces(*CLOSED), st.floats(0.0, 1e6))
@LAWS
def test_what_is_closed_stays_as_it_is(mesh: TriangleMesh, longest: float) -> None:
    assert close_loops(mesh, longest=longest) is mesh
    assert double(mesh, longest=longest) is mesh


@given(surfaces(*OPEN))
@LAWS
def test_closing_all_loops_leaves_none_and_keeps_the_surface(mesh: TriangleMesh) -> None:
    closed = close_loops(mesh, longest=np.inf)
    assert boundary_loops(closed) == []
    assert_array_equal(closed.vertices[: mesh.n_vertices], mesh.vertices)
    assert_array_equal(closed.faces[: mesh.n_faces], mesh.faces)
    assert close_loops(closed, longest=np.inf) is closed


@given(surfaces(), SEEDS, st.floats(-3.0, 3.0))
@LAWS
def test_smoothing_does_not_see_rotation_and_scale(
    mesh: TriangleMesh, seed: int, exponent: float
) -> None:
    def moved(one: TriangleMesh) -> TriangleMesh:
        return scaled(rotated(one, np.random.default_rng(seed)), 10.0**exponent)

    for flow in (partial(fair, time=1e-3), partial(smooth, time=1e-3, steps=2)):
        expected = moved(flow(mesh)).vertices
        assert_allclose(flow(moved(mesh)).vertices, expected, atol=1e-9 * np.abs(expected).max())
    assert_allclose(roughness(moved(mesh)), roughness(mesh), atol=1e-9)
