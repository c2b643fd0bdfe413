"""Laws of the renderer: areas and shading in closed form, and what it must not see or mind."""

import io
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from tests.meshes import box, icosphere, renumbered, scaled, single_triangle, translated, union
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.normals import angle_weighted_normals
from workers.rendering.rasterising import distinct
from workers.rendering.render import Picture, _corner_normals, contact_sheet, encode_png, render

FRONT = (0.0, 0.0, 1.0)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def coverage(picture: Picture) -> float:
    """Share of the picture that the shape covers."""
    return float(picture[:, :, 3].mean() / 255.0)


def rectangle_facing(width: float, height: float, depth: float = 0.0) -> TriangleMesh:
    """Rectangle in the plane z = depth around the origin, two triangles."""
    corners = [[x * width / 2, y * height / 2, depth] for y in (-1, 1) for x in (-1, 1)]
    return TriangleMesh(np.array(corners), np.array([[0, 1, 3], [0, 3, 2]]))


def test_a_sphere_is_a_disc_that_fills_the_frame_but_for_the_margin() -> None:
    picture = render(icosphere(4), size=200)
    diameter = 1.0 - 2 * 0.06
    assert_allclose(coverage(picture), np.pi / 4 * diameter**2, rtol=0.01)  # pixels on the rim
    rows, columns = np.nonzero(picture[:, :, 3] == 255)
    inside = np.hypot(rows + 0.5 - 100, columns + 0.5 - 100)
    assert inside.max() <= 100 * diameter


def test_a_sphere_is_brightest_towards_the_light_above_on_the_left() -> None:
    light = render(icosphere(4), size=100).astype(float)[:, :, :3].sum(axis=2)
    row, column = np.unravel_index(light.argmax(), light.shape)
    assert 15 < row < 45
    assert 15 < column < 50
    towards_light = [light[30, 35], light[50, 50], light[70, 65], light[82, 73]]
    assert all(bright > dark for bright, dark in pairwise(towards_light))


def test_shading_changes_smoothly_across_the_faces_of_a_sphere() -> None:
    light = render(icosphere(3), size=200).astype(float)[70:130, 70:130, 0]
    assert np.abs(np.diff(light, axis=1)).max() <= 4.0  # a faceted sphere jumps by 10 and more


def test_the_faces_of_a_box_are_flat_in_colour() -> None:
    picture = render(box(), size=200)
    solid = picture[picture[:, :, 3] == 255][:, :3]
    _, counts = np.unique(solid, axis=0, return_counts=True)
    assert np.sort(counts)[-3:].sum() > 0.97 * len(solid)  # three faces are seen, three colours


def test_the_area_of_a_rectangle_is_exact_for_any_triangulation() -> None:
    picture = render(rectangle_facing(2.0, 1.0), size=100, direction=FRONT)
    assert_allclose(coverage(picture), 0.88**2 / 2, atol=0.88 / 100)  # half a pixel at each rim
    assert (picture[40:60, 20:80, 3] == 255).all()  # no crack along the diagonal


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_of_two_surfaces_is_seen(order: tuple[int, int]) -> None:
    tilted = np.array([[-1.0, -1, 0.5], [1, -1, 0.5], [0, 1, 1.5]])
    parts = [rectangle_facing(4.0, 4.0), TriangleMesh(tilted, np.array([[0, 1, 2]]))]
    both = render(union(*(parts[i] for i in order)), size=80, direction=FRONT)
    wall = render(parts[0], size=80, direction=FRONT)
    behind = render(union(*(parts[i] for i in order)), size=80, direction=(0.0, 0.0, -1.0))
    assert not np.array_equal(both[40, 40], wall[40, 40])
    assert_array_equal(behind[40, 40], wall[40, 40])  # both sides of a sheet are lit


def test_the_picture_does_not_know_units_or_place() -> None:
    creature = union(icosphere(3), translated(icosphere(2, 0.5), (1.2, 0.4, 0.1)))
    plain = render(creature, size=64).astype(int)
    for factor in (1e-9, 1e-3, 1e6):
        moved = translated(scaled(creature, factor), (3 * factor, -7 * factor, factor))
        difference = np.abs(render(moved, size=64).astype(int) - plain)
        assert (difference > 2).mean() < 1e-3  # a pixel on the rim may tip over in rounding


def test_the_picture_does_not_know_numbering_or_winding(rng: np.random.Generator) -> None:
    mesh = union(icosphere(2), translated(box(), (0.5, 0.5, 0.5)))
    plain = render(mesh, size=64).astype(int)
    for other in (renumbered(mesh, rng)[0], TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])):
        difference = np.abs(render(other, size=64).astype(int) - plain)
        assert (difference > 2).mean() < 2e-3


def test_the_camera_stands_still_while_a_shape_moves() -> None:
    pole, ball = translated(box(0.2, 4.0, 0.2), (-0.1, 0.0, -0.1)), icosphere(2, 0.5)
    for side in (1.0, -1.0):
        picture = render(union(pole, translated(ball, (2.0 * side, 2.0, 0.0))), size=80)
        columns = picture[:, :, 3].astype(float).sum(axis=0)
        pole_column = columns.argmax()
        assert (pole_column < 40) == (side > 0)  # the ball, on the other side of the frame


def test_a_file_with_z_up_looks_as_its_copy_with_y_up() -> None:
    mesh = union(icosphere(2), translated(box(0.5, 2.0, 0.7), (0.2, 0.3, 0.4)))
    x, y, z = mesh.vertices.T
    z_up = TriangleMesh(np.stack([x, -z, y], axis=1), mesh.faces)
    assert_array_equal(render(z_up, size=64, up="z"), render(mesh, size=64))


def test_up_is_up_also_from_a_direction_of_ones_own() -> None:
    tall = translated(box(0.2, 3.0, 0.2), (0.0, 0.0, 0.0))
    topped = union(tall, translated(icosphere(2, 0.6), (0.1, 3.0, 0.1)))
    for direction in ((1.0, 0.0, 0.0), (-1.0, 0.3, 2.0)):
        alpha = render(topped, size=60, direction=direction)[:, :, 3].astype(int)
        assert alpha[:30].sum() > 1.5 * alpha[30:].sum()
    assert coverage(render(topped, size=60, direction=(0.0, 1.0, 0.0))) > 0.5  # straight from above


def test_a_background_replaces_transparency() -> None:
    clear = render(icosphere(3), size=64)
    white = render(icosphere(3), size=64, background=(255, 255, 255))
    assert clear.shape == (64, 64, 4)
    assert white.shape == (64, 64, 3)
    assert_array_equal(white[0, 0], [255, 255, 255])
    assert_array_equal(clear[0, 0], [0, 0, 0, 0])
    inside = clear[:, :, 3] == 255
    assert_array_equal(white[inside], clear[inside][:, :3])


@pytest.mark.parametrize(
    "vertices",
    [np.zeros((0, 3)), np.zeros((3, 3)), np.full((3, 3), np.nan), np.diag([1.0, 2.0, np.inf])],
    ids=["empty", "a point", "nan", "infinite"],
)
def test_what_has_no_surface_gives_a_blank_picture(vertices: FloatArray) -> None:
    faces = np.arange(len(vertices)).reshape(-1, 3)
    picture = render(TriangleMesh(vertices, faces), size=32)
    assert picture.shape == (32, 32, 4)
    assert not picture.any()


def test_faces_without_area_or_number_do_not_hide_the_others() -> None:
    triangle = single_triangle()
    vertices = np.concatenate([triangle.vertices, [[np.nan, 0, 0], [0.5, 0.5, 0]]])
    broken = TriangleMesh(vertices, np.array([[0, 0, 1], [0, 1, 2], [0, 1, 3], [1, 4, 2]]))
    plain = render(triangle, size=64, direction=FRONT)
    drawn = render(broken, size=64, direction=FRONT)
    assert_allclose(coverage(drawn), coverage(plain), atol=0.003)


def test_a_mesh_that_covers_the_picture_thousands_of_times_is_still_drawn() -> None:
    sheets = np.concatenate([rectangle_facing(1, 1, z).vertices for z in np.linspace(0, 1e-3, 400)])
    faces = rectangle_facing(1, 1).faces
    many = TriangleMesh(sheets, np.concatenate([faces + 4 * i for i in range(400)]))
    picture = render(many, size=256, direction=FRONT)  # more pixels than the budget
    assert_allclose(coverage(picture), 0.88**2, atol=0.02)


def test_what_cannot_be_drawn_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="0 pixels"):
        render(icosphere(1), size=0)
    with pytest.raises(InvalidRequestError, match="direction"):
        render(icosphere(1), direction=(0.0, 0.0, 0.0))
    with pytest.raises(InvalidRequestError, match="direction"):
        render(icosphere(1), direction=(0.0, 1.0))


def test_a_contact_sheet_holds_every_picture_in_reading_order() -> None:
    colours = [(200, 0, 0), (0, 200, 0), (0, 0, 200)]
    tiles = [np.full((40, 30, 3), colour, dtype=np.uint8) for colour in colours]
    sheet = contact_sheet(tiles, columns=2)
    assert sheet.shape == (80, 60, 3)
    assert_array_equal(sheet[:40, :30], tiles[0])
    assert_array_equal(sheet[:40, 30:], tiles[1])
    assert_array_equal(sheet[40:, :30], tiles[2])
    assert (sheet[40:, 30:] == 255).all()
    labelled = contact_sheet(tiles, columns=2, labels=["a", "b", "c"])
    assert labelled.shape[0] > 80
    assert labelled[41:54, 5:25].min() < 128  # the label under the first picture


def test_a_contact_sheet_refuses_what_does_not_fit() -> None:
    tile = np.zeros((4, 4, 3), dtype=np.uint8)
    with pytest.raises(InvalidRequestError, match="images and columns"):
        contact_sheet([], columns=2)
    with pytest.raises(InvalidRequestError, match="1 labels were given for 2 images"):
        contact_sheet([tile, tile], columns=2, labels=["a"])


def test_a_png_holds_the_picture_and_a_palette_makes_it_smaller() -> None:
    picture = render(icosphere(3), size=128)
    data = encode_png(picture)
    assert_array_equal(np.asarray(Image.open(io.BytesIO(data))), picture)
    sheet = contact_sheet([picture] * 4, columns=2)
    small = encode_png(sheet, palette=64)
    assert len(small) < 0.7 * len(encode_png(sheet))
    again = np.asarray(Image.open(io.BytesIO(small)).convert("RGB")).astype(int)
    assert np.abs(again - sheet).mean() < 4


def test_the_same_mesh_gives_the_same_bytes() -> None:
    assert encode_png(render(icosphere(2))) == encode_png(render(icosphere(2)))


def test_numbers_are_found_once_and_in_order() -> None:
    numbers = np.array([7, 2, 7, 0, 2])
    found, place = distinct(numbers, 9)
    assert found.tolist() == [0, 2, 7]
    assert_array_equal(found[place], numbers)


def test_normals_of_the_faces_drawn_are_those_of_the_whole_mesh() -> None:
    mesh = icosphere(3)
    drawn = np.array([5, 700, 5, 12])
    smooth = angle_weighted_normals(mesh)[mesh.faces[drawn]]  # a sphere has no crease
    away = mesh.face_normals[drawn, 2] < 0
    assert_array_equal(_corner_normals(mesh, drawn), np.where(away[:, None, None], -smooth, smooth))
