"""The working mesh keeps what makes the shape, and copies of a mesh get the same one."""

import fast_simplification
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import (
    bent_rectangle,
    box,
    bumpy_sphere,
    cylinder,
    icosphere,
    renumbered,
    rotated,
    scaled,
    subdivided,
    torus,
    translated,
    union,
)
from workers.geometry import simplification
from workers.geometry.arrays import FloatArray
from workers.geometry.canonical import canonical_frame
from workers.geometry.cleaning import clean
from workers.geometry.decimation import Coarser, collapsed, decimate_by_error
from workers.geometry.likeness import Likeness
from workers.geometry.mesh import TriangleMesh
from workers.geometry.simplification import TAKEN, simplify
from workers.geometry.spectrum import first_eigenvalues
from workers.geometry.topology import boundary_loops, count_components, euler_characteristic


def normalised_eigenvalues(mesh: TriangleMesh) -> FloatArray:
    return first_eigenvalues(mesh, 20) * mesh.area


@pytest.mark.parametrize(
    "mesh",
    [
        bumpy_sphere(4),
        torus(70, 40),
        bent_rectangle(60, 40),
        cylinder(60, 40),
        union(icosphere(4), translated(torus(60, 20), (4, 0, 0))),
    ],
    ids=["bumpy", "torus", "bent", "cylinder", "two"],
)
def test_what_makes_the_shape_is_kept(mesh: TriangleMesh) -> None:
    simplified = simplify(mesh, vertices=800)
    coarse = simplified.mesh
    assert 0.97 * 800 <= coarse.n_vertices <= 1.25 * 800
    assert simplified.checked == ()
    assert count_components(coarse) == count_components(mesh)
    assert euler_characteristic(coarse) == euler_characteristic(mesh)
    assert len(boundary_loops(coarse)) == len(boundary_loops(mesh))
    assert coarse.area == pytest.approx(mesh.area, rel=0.02)
    first = first_eigenvalues(coarse, 10) / first_eigenvalues(mesh, 10)
    assert_allclose(first, 1.0, atol=0.1)  # what the check lets pass
    assert clean(coarse).repairs == ()


@pytest.mark.parametrize("name", ["bumpy", "sphere", "torus", "cylinder"])
def test_copies_get_the_same_working_mesh(name: str) -> None:
    meshes = {
        "bumpy": bumpy_sphere(4),
        "sphere": icosphere(4),
        "torus": torus(60, 40),
        "cylinder": cylinder(50, 40),
    }
    mesh = meshes[name]
    rng = np.random.default_rng(2)
    expected = normalised_eigenvalues(simplify(mesh, vertices=1000).mesh)
    for factor in (0.001, 1.0, 1000.0):
        copy, _ = renumbered(scaled(rotated(mesh, rng), factor), rng)
        found = normalised_eigenvalues(simplify(copy, vertices=1000).mesh)
        assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.slow
def test_copies_of_a_large_mesh_get_the_same_working_mesh() -> None:
    mesh = bumpy_sphere(5)
    rng = np.random.default_rng(4)
    copy, _ = renumbered(scaled(rotated(mesh, rng), 37.0), rng)
    first, second = (simplify(m, vertices=5000).mesh for m in (mesh, copy))
    assert_allclose(normalised_eigenvalues(first), normalised_eigenvalues(second), rtol=1e-9)


def test_the_working_mesh_lies_where_the_mesh_was() -> None:
    mesh = translated(scaled(bumpy_sphere(4), 50.0), (1000.0, 2000.0, -500.0))
    coarse = simplify(mesh, vertices=700).mesh
    for corner in (np.min, np.max):
        assert_allclose(corner(coarse.vertices, axis=0), corner(mesh.vertices, axis=0), atol=1.0)
    volume = np.einsum("ij,ij->", coarse.face_normals, coarse.vertices[coarse.faces[:, 0]] - 1000)
    assert volume > 0  # still wound outward


def test_a_small_mesh_is_returned_as_it_is() -> None:
    mesh = icosphere(2)
    assert simplify(mesh, vertices=162).mesh is mesh


def dumbbell(n: int = 40) -> TriangleMesh:
    """Two boxes of surface joined by a thin tube: the first eigenvalue hangs on the tube."""
    tube = cylinder(n, 4 * n, radius=1.0, height=4.0)
    z = tube.vertices[:, 2]
    neck = 1.0 - 0.93 * np.exp(-(((z - 2.0) / 0.5) ** 4))
    profile = tube.vertices * np.stack([neck, neck, np.ones_like(neck)], axis=1)
    return TriangleMesh(profile, tube.faces)


def test_a_broken_connection_is_found_and_redone_finer() -> None:
    mesh = dumbbell()

    def cutting(
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        coarse = decimate_by_error(
            mesh, target, aggressiveness, keep_border=keep_border, shaken=shaken
        )
        if target > 1500:
            return coarse
        made = coarse.mesh
        slit = np.abs(made.vertices[made.faces].mean(axis=1) @ axis - middle) > 0.06
        return Coarser(TriangleMesh(made.vertices, made.faces[slit]), coarse.to)

    frame = canonical_frame(mesh)
    axis = frame.axes @ np.array([0.0, 0.0, 1.0])
    middle = float(frame.enter(np.array([[0.0, 0.0, 2.0]]))[0] @ axis)
    simplified = simplify(mesh, vertices=1000, decimate=cutting)
    assert simplified.mesh.n_vertices == pytest.approx(2000, rel=0.05)
    assert any("components instead of 1" in note for note in simplified.checked)


def test_eigenvalues_that_moved_are_found() -> None:
    mesh = dumbbell()

    def strangling(
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        coarse = decimate_by_error(
            mesh, target, aggressiveness, keep_border=keep_border, shaken=shaken
        )
        if target > 1500:
            return coarse
        made = coarse.mesh
        height = made.vertices @ axis - middle
        across = made.vertices - np.outer(made.vertices @ axis, axis)
        thin = np.where(np.abs(height) < 0.05, 0.2, 1.0)[:, None]
        return Coarser(TriangleMesh(made.vertices + (thin - 1.0) * across, made.faces), coarse.to)

    frame = canonical_frame(mesh)
    axis = frame.axes @ np.array([0.0, 0.0, 1.0])
    middle = float(frame.enter(np.array([[0.0, 0.0, 2.0]]))[0] @ axis)
    simplified = simplify(mesh, vertices=1000, decimate=strangling)
    assert simplified.mesh.n_vertices == pytest.approx(2000, rel=0.05)
    assert any("eigenvalue 1 is" in note for note in simplified.checked)


def test_the_original_is_kept_where_nothing_passes() -> None:
    mesh = subdivided(icosphere(3))
    none = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    nothing = Coarser(none, np.full(mesh.n_vertices, -1))
    simplified = simplify(mesh, vertices=1000, decimate=lambda *_, **__: nothing)
    assert simplified.mesh is mesh
    assert simplified.checked[-1] == "kept all 2,562 vertices"


def spiky(mesh: TriangleMesh, n_handles: int) -> TriangleMesh:
    """The body with pairs of faces joined by short tubes: so many handles."""
    rng = np.random.default_rng(3)
    chosen = rng.choice(mesh.n_faces, size=(n_handles, 2), replace=False)
    tubes = []
    for one, other in mesh.faces[chosen].tolist():
        for i in range(3):
            a, b = one[i], one[(i + 1) % 3]
            c, d = other[-i], other[-i - 1]
            tubes += [[a, b, c], [b, d, c]]
    rest = np.delete(mesh.faces, chosen.ravel(), axis=0)
    return TriangleMesh(mesh.vertices, np.concatenate([rest, np.array(tubes)]))


def test_a_thousand_handles_do_not_make_the_working_mesh_large() -> None:
    mesh = clean(spiky(bumpy_sphere(5), 400)).mesh
    simplified = simplify(mesh, vertices=1000)
    assert simplified.mesh.n_vertices <= 1.25 * 4000
    assert simplified.checked != ()


def test_a_fine_mesh_of_which_no_level_passes_is_not_kept() -> None:
    mesh = bumpy_sphere(5)

    def shrinking(
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        coarse = decimate_by_error(
            mesh, target, aggressiveness, keep_border=keep_border, shaken=shaken
        )
        return Coarser(scaled(coarse.mesh, 0.9), coarse.to)

    simplified = simplify(mesh, vertices=1000, decimate=shrinking)
    assert 0.97 * 4000 <= simplified.mesh.n_vertices <= 1.25 * 4000
    assert simplified.checked[-1].endswith("taken all the same: the mesh itself is too large")


def test_a_shard_that_comes_off_is_dropped() -> None:
    mesh = bumpy_sphere(4)

    def splintering(
        mesh: TriangleMesh,
        target: int,
        aggressiveness: float,
        *,
        keep_border: bool,
        shaken: bool = False,
    ) -> Coarser:
        coarse = decimate_by_error(
            mesh, target, aggressiveness, keep_border=keep_border, shaken=shaken
        )
        shard = translated(scaled(icosphere(0), 0.001), (1.0, 0.0, 0.0))
        return Coarser(union(coarse.mesh, shard), coarse.to)

    simplified = simplify(mesh, vertices=1000, decimate=splintering)
    assert simplified.checked == ()
    assert count_components(simplified.mesh) == 1


def test_a_little_too_many_vertices_are_left() -> None:
    mesh = bumpy_sphere(4)
    assert simplify(mesh, vertices=2400).mesh is mesh
    assert simplify(mesh, vertices=2300).mesh.n_vertices == pytest.approx(2300, rel=0.03)


def test_a_vertex_of_too_many_faces_is_not_given_to_the_simplifier() -> None:
    n = 20_001
    angles = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)
    around = np.arange(n)
    faces = np.stack([np.full(n, n), around, (around + 1) % n], axis=1)
    cone = TriangleMesh(np.concatenate([rim, [[0.0, 0.0, 1.0]]]), faces)
    simplified = simplify(cone, vertices=1000)
    assert simplified.mesh is cone
    assert simplified.checked == ("not simplified: a vertex has too many faces",)


def test_a_part_so_small_that_rounding_flattens_it_does_no_harm() -> None:
    sphere = bumpy_sphere(4)
    part = sphere.vertices[:, 2] > 0.95 * sphere.vertices[:, 2].max()
    centre = sphere.vertices[part].mean(axis=0)
    shrunk = centre + 1e-8 * (sphere.vertices - centre)
    mesh = TriangleMesh(np.where(part[:, None], shrunk, sphere.vertices), sphere.faces)
    assert part.sum() > 20
    assert simplify(mesh, vertices=1200).mesh.n_vertices < 1500


@pytest.mark.parametrize("mesh", [bumpy_sphere(4), torus(60, 20)], ids=["bumpy", "torus"])
def test_vertices_are_followed_through_collapses_as_a_replay_follows_them(
    mesh: TriangleMesh,
) -> None:
    corners = mesh.faces.astype(np.int32)
    *_, collapses = fast_simplification.simplify(
        mesh.vertices.copy(), corners, target_count=mesh.n_faces // 4, return_collapses=True
    )
    *_, expected = fast_simplification.replay_simplification(
        mesh.vertices.copy(), corners, collapses
    )
    assert_array_equal(collapsed(collapses, mesh.n_vertices), expected)


def test_a_rough_level_has_the_vertices_of_the_simplifier_and_traces_none() -> None:
    mesh = bumpy_sphere(4)
    rough = decimate_by_error(mesh, 800, 7.0, keep_border=False, rough=True)
    assert rough.mesh.n_faces == pytest.approx(mesh.n_faces * 800 / mesh.n_vertices, abs=1)
    assert euler_characteristic(rough.mesh) == euler_characteristic(mesh)
    assert len(rough.to) == 0


def test_a_flat_body_comes_down_to_the_vertices_asked_for() -> None:
    """On its flat sides errors are rounding: unless vertices are moved, 6,052 are left."""
    simplified = simplify(subdivided(box(1.0, 0.7, 0.3), 6), vertices=5000)
    assert 4500 < simplified.mesh.n_vertices < 5500
    assert simplified.checked == ()


@pytest.mark.parametrize(
    ("errors", "taken"), [((0.70, 0.69, 0.68), 1000), ((0.70, 0.30, 0.28), 2000), ((3, 2, 1), 4000)]
)
def test_where_no_level_is_sound_the_coarsest_is_taken_unless_a_finer_one_is_better(
    errors: tuple[float, ...], taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = iter(errors)

    def compared(*_: object) -> Likeness:
        return Likeness(next(left), "eigenvalue 1 is off")

    monkeypatch.setattr(simplification, "compare_eigenvalues", compared)
    simplified = simplify(bumpy_sphere(6), vertices=1000)  # too large to be kept
    assert simplified.mesh.n_vertices == pytest.approx(taken, rel=0.05)
    assert TAKEN in simplified.checked[-1]
