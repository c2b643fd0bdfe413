"""Readers of science's formats beside meshio and nibabel, and the boundary of volumes."""

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.formats.kinds import BODY
from tests.formats.vtk_builders import TETRAHEDRA, WITH_MIDDLE, Xml, binary_body, points, text
from workers.errors import InvalidMeshError, ProteusError, UploadTooLargeError
from workers.geometry.formats import MeshLimits, parse
from workers.geometry.formats.msh.elements import NODES
from workers.geometry.formats.rows.records import counted_polygons, record_starts
from workers.geometry.formats.surfaces.cells import (
    Cells,
    cells_of_one_type,
    join_cells,
    surface_of_cells,
)
from workers.geometry.formats.text.tokens import Polygons
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import boundary_loops

LIMITS = MeshLimits()
freesurfer: Any = importlib.import_module("nibabel.freesurfer")  # its functions have no types
gifti: Any = importlib.import_module("nibabel.gifti")
BY_MESHIO: tuple[tuple[str, str, dict[str, object]], ...] = (
    ("a.vtk", "vtk42", {"binary": True}),
    ("a.vtk", "vtk42", {"binary": False}),
    ("a.vtk", "vtk51", {"binary": True}),
    ("a.vtk", "vtk51", {"binary": False}),
    ("a.vtu", "vtu", {"binary": False}),
    ("a.vtu", "vtu", {"compression": None}),
    ("a.vtu", "vtu", {"compression": "zlib"}),
    ("a.vtu", "vtu", {"compression": "lzma", "header_type": "UInt64"}),
    ("a.msh", "gmsh22", {"binary": True}),
    ("a.msh", "gmsh22", {"binary": False}),
    ("a.msh", "gmsh", {"binary": True}),
    ("a.msh", "gmsh", {"binary": False}),
    ("a.mesh", "medit", {}),
)


@pytest.fixture(params=BY_MESHIO, ids=lambda one: f"{one[1]}, {one[2]}")
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[meshio.Mesh], bytes]:
    """What meshio makes of a mesh in one of its formats."""
    name, format, options = request.param
    path: Path = tmp_path / name

    def write(mesh: meshio.Mesh) -> bytes:
        try:
            mesh.write(path, file_format=format, **options)
        except meshio.WriteError as error:
            pytest.skip(f"meshio does not write it: {error}")
        return path.read_bytes()

    return write


def test_what_meshio_writes_is_read(written: Callable[[meshio.Mesh], bytes]) -> None:
    mesh = parse(written(meshio.Mesh(BODY.vertices, [("triangle", BODY.faces)]))).mesh
    assert_allclose(mesh.vertices, BODY.vertices, rtol=1e-9, atol=1e-9)  # digits of a text
    assert_array_equal(mesh.faces, BODY.faces)


def test_volumes_of_meshio_have_their_boundary(written: Callable[[meshio.Mesh], bytes]) -> None:
    parsed = parse(written(meshio.Mesh(WITH_MIDDLE, [("tetra", TETRAHEDRA)])))
    assert parsed.mesh.area == pytest.approx(BODY.area, rel=1e-6)
    assert parsed.mesh.n_faces == BODY.n_faces
    assert any("boundary surface" in sentence for sentence in parsed.found)


def test_quads_beside_triangles_of_meshio(written: Callable[[meshio.Mesh], bytes]) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0.0]])
    cells = [("quad", np.array([[0, 1, 2, 3]])), ("triangle", np.array([[1, 4, 2]]))]
    assert parse(written(meshio.Mesh(vertices, cells))).mesh.area == pytest.approx(1.5)


def test_what_nibabel_writes_as_freesurfer_is_read(tmp_path: Path) -> None:
    path = tmp_path / "lh.pial"
    volume = {
        **{"head": np.array([2, 0, 20]), "valid": "1  # volume info valid", "filename": "a.mgz"},
        **{"volume": np.array([256, 256, 256]), "voxelsize": np.ones(3)},
        **{"xras": [-1, 0, 0], "yras": [0, 0, -1], "zras": [0, 1, 0], "cras": [0, 0, 0]},
    }
    freesurfer.write_geometry(path, BODY.vertices, BODY.faces, volume_info=volume)
    parsed = parse(path.read_bytes(), filename="lh.pial")
    assert_array_equal(parsed.mesh.faces, BODY.faces)
    assert_allclose(parsed.mesh.vertices, BODY.vertices.astype(np.float32))
    assert parsed.found == ("the geometry of the scan",)
    assert parsed.up == "z"


def test_old_quads_are_cut_as_nibabel_cuts_them(tmp_path: Path) -> None:
    from tests.formats.freesurfer_files import old_quads

    path = tmp_path / "rh.white"
    path.write_bytes(old_quads())
    vertices, faces = freesurfer.read_geometry(path)
    mesh = parse(old_quads()).mesh
    assert_allclose(mesh.vertices, vertices)
    assert_array_equal(mesh.faces, faces)


@pytest.mark.parametrize("encoding", ["ASCII", "B64BIN", "B64GZ"])
def test_what_nibabel_writes_as_gifti_is_read(encoding: str) -> None:
    image = gifti.GiftiImage()
    for intent, values in (("POINTSET", BODY.vertices), ("TRIANGLE", BODY.faces)):
        kind = np.float32 if intent == "POINTSET" else np.int32
        image.add_gifti_data_array(
            gifti.GiftiDataArray(
                values.astype(kind), f"NIFTI_INTENT_{intent}", encoding=f"GIFTI_ENCODING_{encoding}"
            )
        )
    mesh = parse(image.to_bytes(), filename="lh.pial.surf.gii").mesh
    assert_allclose(mesh.vertices, BODY.vertices, rtol=1e-5, atol=1e-5)  # six digits in the text
    assert_array_equal(mesh.faces, BODY.faces)


def test_gmshs_types_have_as_many_nodes_as_meshio_says() -> None:
    from meshio._common import num_nodes_per_cell
    from meshio.gmsh.common import _gmsh_to_meshio_type

    ours = {type: count for types in NODES.values() for type, count in types.items()}
    for type, name in _gmsh_to_meshio_type.items():
        assert ours[type] == num_nodes_per_cell[name]


def surface(vertices: object, *cells: Cells) -> TriangleMesh:
    return surface_of_cells(np.asarray(vertices, dtype=float), join_cells(list(cells)), LIMITS).mesh


def signed_volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


CUBE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
PRISM = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
VOLUMES = {
    "tetrahedron": (10, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], 1 / 6),
    "voxel": (11, [CUBE[i] for i in (0, 1, 3, 2, 4, 5, 7, 6)], 1.0),
    "hexahedron": (12, CUBE, 1.0),
    "wedge": (13, PRISM, 1 / 2),
    "wedge the other way round": (13, [PRISM[i] for i in (0, 2, 1, 3, 5, 4)], 1 / 2),
    "pyramid": (14, [*CUBE[:4], [0.5, 0.5, 1]], 1 / 3),
    "quadratic tetrahedron": (24, [*np.eye(4)[:, :3], *np.ones((6, 3))], 1 / 6),
}


@pytest.mark.parametrize(("cell_type", "corners", "volume"), VOLUMES.values(), ids=VOLUMES)
def test_the_boundary_of_a_cell_is_closed_and_looks_outwards(
    cell_type: int, corners: list[list[float]], volume: float
) -> None:
    mesh = surface(corners, cells_of_one_type(cell_type, np.arange(len(corners))[None]))
    assert signed_volume(mesh) == pytest.approx(volume)
    assert len(boundary_loops(mesh)) == 0


def test_a_face_between_two_kinds_of_cells_is_no_boundary() -> None:
    vertices = [*CUBE, [0.5, 0.5, 2]]
    cube, roof = np.arange(8)[None], np.array([[4, 5, 6, 7, 8]])
    mesh = surface(vertices, cells_of_one_type(12, cube), cells_of_one_type(14, roof))
    assert signed_volume(mesh) == pytest.approx(4 / 3)
    assert mesh.n_faces == 5 * 2 + 4


def test_a_hexahedron_with_corners_twice_fits_its_neighbour() -> None:
    vertices = [*CUBE, [2, 0, 0], [2, 0, 1]]
    wedge = np.array([[1, 8, 2, 2, 5, 9, 6, 6]])  # against the cube's side x = 1
    mesh = surface(vertices, cells_of_one_type(12, np.vstack([np.arange(8), wedge])))
    assert signed_volume(mesh) == pytest.approx(1.5)


def test_surface_cells_away_from_the_volumes_stay() -> None:
    vertices = [*CUBE, [5, 0, 0], [6, 0, 0], [5, 1, 0]]
    plate, side = np.array([[8, 9, 10]]), np.array([[0, 1, 2, 3]])
    cells = cells_of_one_type(12, np.arange(8)[None]), cells_of_one_type(5, plate)
    mesh = surface(vertices, *cells, cells_of_one_type(9, side))
    assert mesh.area == pytest.approx(6.5)


def test_quadratic_polygons_are_read_by_their_corners() -> None:
    middles = [[0.5, 0, 0], [1, 0.5, 0], [0.5, 1, 0], [0, 0.5, 0]]
    cell = cells_of_one_type(36, np.arange(8)[None])
    assert surface([*CUBE[:4], *middles], cell).area == pytest.approx(1.0)


def test_cells_and_types_of_different_numbers_are_refused() -> None:
    file = text("DATASET UNSTRUCTURED_GRID\n" + points(), "CELLS 1 4\n3 0 1 2", "CELL_TYPES 2\n5 5")
    with pytest.raises(InvalidMeshError, match="1 cells, but 2 types"):
        parse(file)


@given(st.lists(st.lists(st.integers(0, 9), max_size=5), max_size=40), st.integers(0, 40))
def test_counted_polygons_are_those_written(rows: list[list[int]], limit: int) -> None:
    values = np.array([number for row in rows for number in (len(row), *row)], dtype=np.int64)
    polygons, end = counted_polygons(values, limit)
    assert polygons.counts.tolist() == [len(row) for row in rows[:limit]]
    assert polygons.corners.tolist() == [number for row in rows[:limit] for number in row]
    assert end == sum(len(row) + 1 for row in rows[:limit])


def test_records_go_on_from_one_piece_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workers.geometry.formats.rows.records.LOOKED_AT_ONCE", 4)
    starts, end = record_starts(np.full(23, 5), 99)
    assert (starts.tolist(), end) == ([0, 5, 10, 15, 20], 25)


def test_counts_over_the_limits_are_refused_before_reading() -> None:
    small = MeshLimits(vertices=100)
    with pytest.raises(UploadTooLargeError, match="642 vertices"):
        parse(binary_body(), limits=small)
    with pytest.raises(UploadTooLargeError, match="10,000 vertices"):
        parse(binary_body().replace(b"POINTS 642 ", b"POINTS 10000 "), limits=small)


def test_arrays_named_again_and_again_are_unpacked_only_so_often() -> None:
    one = Xml("appended", compressor="vtkZLibDataCompressor")
    piece = one.piece(one.points(), one.polys())
    file = one.file("PolyData", *[piece] * 50)
    with pytest.raises(UploadTooLargeError, match="unpacks to more than"):
        parse(file, limits=MeshLimits(unpacked=1 << 20))


@pytest.mark.parametrize("size", [2**31, 2**62, -5])
def test_sizes_in_front_of_an_array_are_checked(size: int) -> None:
    file = Xml("appended", header="UInt64").body()
    damaged = file.replace(
        (24 * BODY.n_vertices).to_bytes(8, "little"), size.to_bytes(8, "little", signed=True), 1
    )
    with pytest.raises(ProteusError):
        parse(damaged)


def test_no_polygons_are_no_polygons() -> None:
    none = np.zeros(0, dtype=np.int64)
    with pytest.raises(InvalidMeshError, match="points but no faces"):
        surface(CUBE, Cells(none, Polygons(none, none)))
