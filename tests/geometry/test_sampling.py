"""Samples: their weights measure the surface, and nothing but its shape moves them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bent_rectangle,
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    renumbered,
    rotated,
    scaled,
    tetrahedron,
    torus,
    translated,
    union,
)
from workers.errors import InvalidRequestError
from workers.geometry.arrays import IntArray
from workers.geometry.edges import component_labels, undirected_edges
from workers.geometry.mesh import TriangleMesh
from workers.geometry.sampling import SurfaceSample, sample_surface, spectral_embedding
from workers.geometry.spectrum import Spectrum, compute_spectrum

SYMMETRIC = (icosphere(3), torus(40, 16), rectangle(32, 20, 3.0, 2.0), cylinder(30, 14))
UNEVEN = (bumpy_sphere(3), bumpy_sphere(3, seed=3))
SEVERAL = union(
    icosphere(3),
    translated(icosphere(3), (4.0, 0.0, 0.0)),
    translated(scaled(rectangle(9, 7, 2.0, 1.0), 0.3), (0.0, 4.0, 0.0)),
)


def _sample(mesh: TriangleMesh, count: int) -> SurfaceSample:
    return sample_surface(mesh, compute_spectrum(mesh), count=count)


def _every_distance(mesh: TriangleMesh, spectrum: Spectrum, count: int) -> IntArray:
    """Farthest points by the distances of all vertices to each point that is taken."""

    def first_largest(values: np.ndarray) -> int:
        return int(np.flatnonzero(values >= values.max() * (1.0 - 1e-6))[0])

    embedding = spectral_embedding(spectrum)
    labels = component_labels(undirected_edges(mesh), mesh.n_vertices)
    areas = np.bincount(labels, spectrum.areas)
    taken: list[int] = []
    nearest = np.full(mesh.n_vertices, np.inf)
    for i in range(count):
        if i < len(areas):
            component = np.argsort(-areas, kind="stable")[i]
            inside = labels == component
            taken.append(first_largest(np.where(inside, (embedding**2).sum(axis=1), -1.0)))
        else:
            taken.append(first_largest(nearest))
        differences = embedding - embedding[taken[-1]]
        nearest = np.minimum(nearest, (differences**2).sum(axis=1))
        nearest[taken] = -1.0
    return np.array(taken)


def _skewed_strip(angle: float) -> TriangleMesh:
    """A strip bent by an angle, with the same uneven vertices whatever the angle: isometric."""
    strip = bent_rectangle(60, 24, 3.0, 1.0, angle=angle)
    widths = np.linspace(0.0, 1.0, 25) ** 1.3
    row = np.arange(strip.n_vertices) // 61
    vertices = strip.vertices.copy()
    vertices[:, 1] = widths[row]
    return TriangleMesh(vertices, strip.faces)


@pytest.mark.parametrize("count", [1, 2, 50, 400])
@pytest.mark.parametrize("mesh", [bumpy_sphere(3), rectangle(30, 20, 3, 2)])
def test_weights_sum_to_the_area_and_points_are_distinct(mesh: TriangleMesh, count: int) -> None:
    sample = _sample(mesh, count)
    assert sample.indices.shape == sample.weights.shape == (count,)
    assert len(np.unique(sample.indices)) == count
    assert np.all(sample.weights > 0.0)
    assert_allclose(sample.weights.sum(), mesh.area, rtol=1e-12)


def test_fewer_vertices_than_points_are_all_taken_with_their_areas() -> None:
    mesh = tetrahedron(2.0)
    sample = _sample(mesh, 800)
    assert_array_equal(sample.indices, range(4))
    assert_allclose(sample.weights, mesh.area / 4.0)


def test_bending_without_stretching_moves_no_point() -> None:
    flat, bent = _sample(_skewed_strip(0.0), 200), _sample(_skewed_strip(5.0), 200)
    assert_array_equal(bent.indices, flat.indices)
    assert_allclose(bent.weights, flat.weights, rtol=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 0.3, 1e6])
def test_rotation_and_scale_move_no_point(factor: float) -> None:
    mesh = bumpy_sphere(4)
    moved = scaled(rotated(mesh, np.random.default_rng(5)), factor)
    plain, other = _sample(mesh, 300), _sample(moved, 300)
    assert_array_equal(other.indices, plain.indices)
    assert_allclose(other.weights, plain.weights * factor**2, rtol=1e-9)


def test_numbering_moves_no_point_of_a_shape_without_symmetry() -> None:
    mesh = bumpy_sphere(4)
    shuffled, order = renumbered(mesh, np.random.default_rng(6))
    plain, other = _sample(mesh, 300), _sample(shuffled, 300)
    assert_array_equal(order[other.indices], plain.indices)
    assert_allclose(other.weights, plain.weights, rtol=1e-9)


def test_rounding_moves_no_point_of_a_symmetric_shape() -> None:
    # The sphere's vertices tie by the dozen: rounding must not choose among them.
    mesh = icosphere(3)
    moved = rotated(mesh, np.random.default_rng(7))
    assert_array_equal(_sample(moved, 12).indices, _sample(mesh, 12).indices)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    mesh=st.sampled_from((*SYMMETRIC, *UNEVEN, SEVERAL)),
    stretched=st.booleans(),
    seed=st.integers(0, 2**16),
    eigenpairs=st.sampled_from((3, 40, 100)),
    count=st.sampled_from((1, 2, 30, 250)),
)
def test_no_vertex_that_is_passed_over_would_have_changed_a_point(
    mesh: TriangleMesh, stretched: bool, seed: int, eigenpairs: int, count: int
) -> None:
    if stretched:
        factors = np.random.default_rng(seed).uniform(0.4, 2.5, 3)
        mesh = TriangleMesh(mesh.vertices * factors, mesh.faces)
    spectrum = compute_spectrum(mesh, n_eigenpairs=eigenpairs)
    sample = sample_surface(mesh, spectrum, count=count)
    assert_array_equal(sample.indices, _every_distance(mesh, spectrum, count))


def test_vertices_that_no_eigenvector_tells_apart_are_taken_by_number() -> None:
    # Once four points are taken all distances are 0, and more points are wanted.
    mesh = icosphere(1)
    values, areas = np.array([1.0, 2.0, 4.0]), np.full(42, mesh.area / 42)
    vectors = np.zeros((42, 3))
    vectors[[7, 30, 31], [0, 1, 0]] = [1.0, 1.0, -1.0]
    spectrum = Spectrum(values, vectors, areas, mesh.area)
    sample = sample_surface(mesh, spectrum, count=8)
    assert_array_equal(sample.indices, [7, 31, 30, 0, 1, 2, 3, 4])
    assert_array_equal(sample.indices, _every_distance(mesh, spectrum, 8))


def test_points_lie_evenly() -> None:
    mesh = icosphere(4)
    sample = _sample(mesh, 200)
    # 200 discs of the mean cell's area have radius 0.14; a hexagonal packing has 0.27 spacing
    points = mesh.vertices[sample.indices]
    distances = np.linalg.norm(points[:, None] - points[None], axis=2) + 9.0 * np.eye(200)
    assert distances.min() > 0.15
    covering = np.linalg.norm(mesh.vertices[:, None] - points[None], axis=2).min(axis=1)
    assert covering.max() < 0.3


def test_a_cell_is_what_lies_nearest_along_the_surface() -> None:
    # A strip folded so tightly that through space the two leaves touch.
    mesh = bent_rectangle(60, 10, 6.0, 1.0, angle=60 * np.pi / 59)
    sample = _sample(mesh, 2)
    assert_allclose(sample.weights, 3.0, rtol=0.05)


def test_a_vertex_as_near_to_two_points_is_shared_between_them() -> None:
    # Two cells on either side of the middle line of a regular grid are equal whatever the numbers.
    mesh, _ = renumbered(rectangle(20, 10, 2.0, 1.0), np.random.default_rng(9))
    sample = _sample(mesh, 2)
    assert_allclose(sample.weights, 1.0, rtol=1e-6)


def test_every_component_has_a_point() -> None:
    parts = [translated(scaled(bumpy_sphere(2), 0.5**i), (6.0 * i, 0, 0)) for i in range(6)]
    sample = _sample(union(*parts), 40)
    owners = sample.indices // parts[0].n_vertices
    assert set(owners.tolist()) == set(range(6))
    weights = np.bincount(owners, sample.weights)
    assert_allclose(weights, [part.area for part in parts], rtol=1e-12)


def test_more_components_than_points_are_shared_out_by_area() -> None:
    parts = [translated(tetrahedron(), (3.0 * i, 0, 0)) for i in range(60)]
    mesh = union(*parts)
    sample = _sample(mesh, 10)
    assert len(np.unique(sample.indices // 4)) == 10
    assert_allclose(sample.weights, mesh.area / 10.0, rtol=1e-12)


def test_embedding_does_not_depend_on_where_a_multiple_eigenvalue_is_cut() -> None:
    # 10 = 3 + 5 + 2 of the 4 equal ones: which two the solver took differs with the rotation.
    mesh = icosphere(3)
    moved = rotated(mesh, np.random.default_rng(8))
    grams = []
    for sphere in (mesh, moved):
        spectrum = compute_spectrum(sphere, n_eigenpairs=10)
        embedding = spectral_embedding(spectrum)
        grams.append(embedding @ embedding.T)
    assert_allclose(grams[1], grams[0], atol=1e-9)


def test_equal_eigenvalues_alone_still_give_an_embedding() -> None:
    spectrum = compute_spectrum(tetrahedron())
    assert np.linalg.matrix_rank(spectral_embedding(spectrum)) == 3


def test_nonsense_is_refused_by_name() -> None:
    spectrum = compute_spectrum(tetrahedron())
    with pytest.raises(InvalidRequestError, match="at least 1"):
        sample_surface(tetrahedron(), spectrum, count=0)
    with pytest.raises(InvalidRequestError, match="4 vertices, the mesh has 42"):
        sample_surface(icosphere(1), spectrum)
