"""A coarser mesh is sound or broken, as the eigenvalues of the mesh itself would say."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.meshes import (
    bumpy_sphere,
    cylinder,
    icosphere,
    rectangle,
    scaled,
    torus,
    translated,
    union,
)
from workers.geometry.decimation import Coarser, decimate_by_error
from workers.geometry.likeness import CHECKED_EIGENVALUES, LARGEST_ERROR, compare_eigenvalues
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import first_eigenvalues

BODIES = {
    "bumpy": bumpy_sphere(5),
    "torus": torus(120, 60),
    "thin torus": torus(300, 20, tube=0.1),
    "cylinder": cylinder(90, 80),
    "sheet": rectangle(90, 80),
    "two": union(icosphere(4), translated(bumpy_sphere(4), (4, 0, 0))),
}


def of_unit_area(mesh: TriangleMesh) -> TriangleMesh:
    return scaled(mesh, 1.0 / float(np.sqrt(mesh.area)))


def coarser(mesh: TriangleMesh, target: int) -> Coarser:
    return decimate_by_error(mesh, target, 7.0, keep_border=False)


def squeezed(mesh: TriangleMesh, factor: float) -> TriangleMesh:
    """The body with a waist at z = 0: narrower there by some factor, over a tenth of its length."""
    vertices = mesh.vertices - mesh.vertices.mean(axis=0)
    height = vertices[:, 2] / np.ptp(vertices[:, 2])
    waist = 1.0 - (1.0 - factor) * np.exp(-((height / 0.05) ** 2))
    across = np.stack([waist, waist, np.ones_like(waist)], axis=1)
    return TriangleMesh(vertices * across, mesh.faces)


@pytest.mark.parametrize("target", [1000, 2500])
@pytest.mark.parametrize("name", BODIES)
def test_a_sound_simplification_has_no_fault(name: str, target: int) -> None:
    mesh = of_unit_area(BODIES[name])
    found = coarser(mesh, target)
    assert not compare_eigenvalues(mesh, found.mesh, found.to).fault


@pytest.mark.parametrize("name", ["bumpy", "torus", "cylinder"])
@pytest.mark.parametrize("factor", [0.3, 0.1, 0.02])
def test_a_narrowed_waist_is_found_where_the_eigenvalues_moved(name: str, factor: float) -> None:
    mesh = of_unit_area(BODIES[name])
    found = coarser(mesh, 2500)
    broken = squeezed(found.mesh, factor)
    assert largest_error(mesh, broken) > LARGEST_ERROR
    assert compare_eigenvalues(mesh, broken, found.to).fault


@pytest.mark.parametrize("factor", [0.3, 0.1, 0.02])
def test_a_widened_waist_is_found(factor: float) -> None:
    narrow = of_unit_area(squeezed(BODIES["bumpy"], factor))
    wide = of_unit_area(BODIES["bumpy"])  # of the same vertices and faces
    found = coarser(wide, 2500)
    assert largest_error(narrow, found.mesh) > LARGEST_ERROR
    assert compare_eigenvalues(narrow, found.mesh, found.to).fault


@pytest.mark.parametrize("neck", [0.2, 0.05, 0.02])
def test_a_dumb_bell_with_a_thin_neck_is_no_fault(neck: float) -> None:
    mesh = of_unit_area(squeezed(cylinder(100, 100, height=4.0), neck))
    found = coarser(mesh, 2500)
    assert largest_error(mesh, found.mesh) < LARGEST_ERROR
    assert not compare_eigenvalues(mesh, found.mesh, found.to).fault


def largest_error(mesh: TriangleMesh, coarse: TriangleMesh) -> float:
    """Of the first eigenvalues for unit area."""
    truth, found = (
        first_eigenvalues(one, CHECKED_EIGENVALUES) * one.area for one in (mesh, coarse)
    )
    return float(np.abs(found / truth - 1.0).max())


def test_a_scaled_mesh_is_judged_the_same() -> None:
    mesh = of_unit_area(BODIES["torus"])
    found = coarser(mesh, 1000)
    larger = scaled(mesh, 1000.0)
    assert not compare_eigenvalues(larger, scaled(found.mesh, 1000.0), found.to).fault
    assert_allclose(larger.area, 1e6)
