"""Laws of dense correspondence: copies, mirrors, poses, parts, pieces, and shapes of few faces."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bumpy_sphere,
    icosahedron,
    icosphere,
    octahedron,
    renumbered,
    rotated,
    scaled,
    single_triangle,
    tetrahedron,
    translated,
    union,
)
from workers.correspondence import Correspondence
from workers.correspondence import correspond as correspond_by
from workers.creatures import Creature, make_creature
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.geodesics import distances_from, surface_graph
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solution
from workers.geometry.spectrum import compute_spectrum
from workers.storage.shipped_models import shipped_whitening
from workers.transformations import transform
from workers.transformations.transformed import TransformedMesh

BITS = {"scale", "mirrored", "coverage"}
FIELDS = ("faces", "barycentric", "confidence", "stretch", "bending", "covered")


def correspond(
    first: Solution, second: Solution, *, mirrored: bool | None = None
) -> Correspondence:
    return correspond_by(first, second, shipped_whitening(), mirrored=mirrored)


def solved(mesh: TriangleMesh, pairs: int = 100) -> Solution:
    return Solution(mesh, compute_spectrum(mesh, n_eigenpairs=pairs))


def places(found: Correspondence, mesh: TriangleMesh) -> FloatArray:
    """Where the points lie."""
    corners = mesh.vertices[mesh.faces[found.faces]]
    points: FloatArray = np.einsum("nc,nci->ni", found.barycentric, corners)
    return points


def errors(found: Correspondence, mesh: TriangleMesh, truth: IntArray) -> FloatArray:
    """Distances along the surface from the truth, in √A, of every tenth vertex."""
    some = np.arange(0, len(truth), 10)
    corners = mesh.faces[found.faces[some]]
    nearest = corners[np.arange(len(some)), found.barycentric[some].argmax(axis=1)]
    apart = distances_from(surface_graph(mesh), truth[some], np.inf)
    along: FloatArray = apart[np.arange(len(some)), nearest] / np.sqrt(mesh.area)
    return along


@cache
def bumpy() -> Solution:
    return solved(bumpy_sphere())


@cache
def cat() -> Creature:
    return make_creature("cat", seed=5, vertices=2500)


@cache
def cat_at_rest() -> Solution:
    return solved(cat().rest)


@cache
def cat_posed() -> Solution:
    return solved(cat().posed(3))


@cache
def part_of_cat() -> TransformedMesh:
    return transform(cat().rest, "partial", 3, seed=1)


def test_a_shape_corresponds_to_itself() -> None:
    found = correspond(bumpy(), bumpy())
    assert_allclose(places(found, bumpy().mesh), bumpy().mesh.vertices, atol=1e-5)
    assert_allclose(found.scale, 1.0, rtol=1e-9)
    assert found.coverage == pytest.approx(1.0)
    assert found.mirrored is False
    assert_allclose(found.stretch, 0.0, atol=1e-4)
    assert_allclose(found.bending, 0.0, atol=1e-4)
    assert found.confidence.min() > 0.9


def test_the_scale_of_a_rotated_and_scaled_copy_is_its_factor() -> None:
    rng = np.random.default_rng(1)
    copy = scaled(rotated(bumpy().mesh, rng), 3.0)
    found = correspond(bumpy(), solved(copy))
    assert_allclose(places(found, copy), copy.vertices, atol=1e-4)
    assert_allclose(found.scale, 3.0, rtol=1e-9)
    assert_allclose(found.stretch, 0.0, atol=1e-4)
    assert_allclose(found.bending, 0.0, atol=1e-4)


def test_the_numbering_of_the_second_shape_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    copy, order = renumbered(bumpy().mesh, rng)
    found = correspond(bumpy(), solved(copy))
    assert_allclose(places(found, copy), bumpy().mesh.vertices, atol=1e-4)
    assert len(order) == copy.n_vertices


def test_a_mirrored_copy_of_a_shape_without_symmetry_is_mirrored() -> None:
    mesh = bumpy().mesh
    mirror = TriangleMesh(mesh.vertices * [-1.0, 1.0, 1.0], mesh.faces[:, ::-1])
    found = correspond(bumpy(), solved(mirror))
    assert found.mirrored is True
    assert_allclose(places(found, mirror), mirror.vertices, atol=1e-4)
    assert_allclose(found.stretch, 0.0, atol=1e-4)


def test_a_symmetric_shape_does_not_tell_whether_it_is_mirrored() -> None:
    found = correspond(solved(icosphere(3)), solved(icosphere(3, 2.0)))
    assert found.mirrored is None
    assert found.coverage == pytest.approx(1.0)
    assert_allclose(found.scale, 2.0, rtol=1e-6)
    assert np.abs(found.stretch).mean() < 0.05
    assert np.abs(found.bending).max() < 1e-3


def test_a_pose_keeps_left_and_right_apart() -> None:
    truth = np.arange(cat().rest.n_vertices, dtype=np.int64)
    found = correspond(cat_at_rest(), cat_posed())
    off = errors(found, cat_posed().mesh, truth)
    assert off.mean() < 0.03  # 0.14 if left and right were exchanged
    assert (off < 0.05).mean() > 0.8
    assert found.mirrored is not True
    assert found.coverage > 0.85
    assert_allclose(found.scale, 1.0, rtol=0.05)


def test_confidence_is_lower_where_the_map_is_wrong() -> None:
    truth = np.arange(cat().rest.n_vertices, dtype=np.int64)
    found = correspond(cat_at_rest(), cat_posed())
    wrong = errors(found, cat_posed().mesh, truth) > 0.05
    confidence = found.confidence[::10]
    assert confidence[wrong].mean() < confidence[~wrong].mean() - 0.1


def test_a_part_finds_its_place_in_a_pose_of_the_whole() -> None:
    part = part_of_cat()
    found = correspond(solved(part.mesh), cat_posed())
    off = errors(found, cat_posed().mesh, part.origin)
    assert off.mean() < 0.05
    assert (off < 0.05).mean() > 0.7
    assert_allclose(found.scale, 1.0, rtol=0.1)
    share = part.mesh.area / cat().rest.area
    assert found.coverage == pytest.approx(share, abs=0.12)


def test_what_a_part_lacks_has_no_confidence() -> None:
    part = part_of_cat()
    found = correspond(cat_posed(), solved(part.mesh))
    has = np.zeros(cat().rest.n_vertices, dtype=np.bool_)
    has[part.origin] = True
    assert found.confidence[has].mean() > 0.6
    assert found.confidence[~has].mean() < 0.2
    assert found.coverage > 0.85


def test_pieces_are_matched_whatever_their_order() -> None:
    large, small = bumpy_sphere(seed=1), scaled(bumpy_sphere(seed=2), 0.6)
    first = union(large, translated(small, (5.0, 0.0, 0.0)))
    second = union(translated(small, (5.0, 3.0, 0.0)), large)
    found = correspond(solved(first), solved(second))
    n = large.n_vertices
    truth = np.concatenate([second.vertices[n:], second.vertices[:n]])
    assert_allclose(places(found, second), truth, atol=1e-3)


def test_a_piece_without_a_counterpart_has_no_confidence() -> None:
    large, small = bumpy_sphere(seed=1), scaled(bumpy_sphere(seed=2), 0.6)
    first = union(large, translated(small, (5.0, 0.0, 0.0)))
    found = correspond(solved(first), solved(large))
    n = large.n_vertices
    assert found.confidence[:n].mean() > 0.9
    assert found.confidence[n:].mean() < 0.1
    assert_allclose(found.scale, 1.0, rtol=0.02)
    assert found.coverage == pytest.approx(1.0)


def test_unlike_shapes_have_little_confidence() -> None:
    other = solved(make_creature("starfish", seed=1, vertices=2500).rest)
    found = correspond(cat_at_rest(), other)
    assert found.confidence.mean() < 0.3


SMALL = {
    "a triangle": single_triangle(),
    "a tetrahedron": tetrahedron(),
    "an octahedron": octahedron(),
    "an icosahedron": icosahedron(),
    "eighty faces": icosphere(1),
    "two triangles": union(single_triangle(), translated(single_triangle(), (3.0, 0.0, 0.0))),
    "thirty balls": union(*(translated(octahedron(), (3.0 * i, 0.0, 0.0)) for i in range(30))),
    "a bumpy ball": bumpy_sphere(),
}


@pytest.mark.parametrize("first", SMALL)
@pytest.mark.parametrize("second", SMALL)
def test_every_pair_has_an_answer_in_range(first: str, second: str) -> None:
    one, other = SMALL[first], SMALL[second]
    found = correspond(solved(one), solved(other))
    assert found.faces.shape == (one.n_vertices,)
    assert found.faces.min() >= 0
    assert found.faces.max() < other.n_faces
    assert found.barycentric.min() >= 0.0
    assert_allclose(found.barycentric.sum(axis=1), 1.0)
    assert ((found.confidence >= 0.0) & (found.confidence <= 1.0)).all()
    assert 0.0 <= found.coverage <= 1.0
    assert np.isfinite(found.scale)
    assert found.scale > 0.0
    assert np.isfinite(found.stretch).all()
    assert np.isfinite(found.bending).all()
    assert set(np.unique(found.covered)) <= {0.0, 1.0}


def test_the_same_pair_has_the_same_bits() -> None:
    one, other = (correspond(cat_at_rest(), cat_posed()) for _ in range(2))
    for name in FIELDS:
        assert_array_equal(getattr(one, name), getattr(other, name))
    assert {name: getattr(one, name) for name in BITS} == {n: getattr(other, n) for n in BITS}


def test_the_orientation_can_be_asked_for() -> None:
    truth = np.arange(cat().rest.n_vertices, dtype=np.int64)
    mirrored = correspond(cat_at_rest(), cat_posed(), mirrored=True)
    assert mirrored.mirrored is True
    assert errors(mirrored, cat_posed().mesh, truth).mean() > 0.08
