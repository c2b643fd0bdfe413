"""COLLADA: transforms in closed form, and what hostile files cost."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.formats.dae_files import BODY_NODE, NESTED, dae, geometry, triangles
from tests.formats.kinds import BODY
from workers.errors import ProteusError
from workers.geometry.arrays import FloatArray
from workers.geometry.formats import parse


def placed_by(transform: str) -> FloatArray:
    """Vertices of the body under one transform."""
    scene = BODY_NODE.replace("<instance", transform + "<instance")
    return parse(dae(geometry(triangles()), scene)).mesh.vertices


def test_transforms_multiply_in_their_order() -> None:
    x, y, z = BODY.vertices.T
    inner = np.stack([z + 5, x + 6, y + 7], axis=1)
    turned = np.stack([-inner[:, 1], inner[:, 0], inner[:, 2]], axis=1)
    found = parse(dae(geometry(triangles()), NESTED)).mesh.vertices
    assert_allclose(found, turned + np.array([1, 2, 3]), atol=1e-9)


def test_each_transform_is_what_its_closed_form_says() -> None:
    x, y, z = BODY.vertices.T
    for transform, expected in (
        ("<translate>1 2 3</translate>", [x + 1, y + 2, z + 3]),
        ("<scale>2 3 4</scale>", [2 * x, 3 * y, 4 * z]),
        ("<rotate>2 0 0 90</rotate>", [x, -z, y]),
        ("<rotate>0 0 0 90</rotate>", [x, y, z]),
        # From (0, 0, 5) towards the origin with y up: moved back along z alone.
        ("<lookat>0 0 5 0 0 0 0 1 0</lookat>", [x, y, z + 5]),
        # From (5, 0, 0): its own z axis is the world's x.
        ("<lookat>5 0 0 0 0 0 0 1 0</lookat>", [z + 5, y, -x]),
        ("<skew>45 1 0 0 0 1 0</skew>", [x + y, y, z]),
    ):
        assert_allclose(placed_by(transform), np.stack(expected, axis=1), atol=1e-9)


def test_the_file_says_which_axis_is_up() -> None:
    for up, axis in (("Y_UP", "y"), ("Z_UP", "z"), ("X_UP", "y")):
        parsed = parse(dae(geometry(triangles()), up=up))
        assert (parsed.format, parsed.up) == ("dae", axis)
    x, y, z = BODY.vertices.T
    assert_allclose(parsed.mesh.vertices, np.stack([-y, x, z], axis=1))


def test_a_mirrored_node_stays_turned_outward() -> None:
    scene = BODY_NODE.replace("<instance", "<scale>-1 1 1</scale><instance")
    mesh = parse(dae(geometry(triangles()), scene)).mesh
    assert np.linalg.det(mesh.vertices[mesh.faces]).sum() > 0


@pytest.mark.parametrize(
    "change",
    [
        ("<p>0 ", "<p>-1 "),
        ("<p>0 ", "<p>99999999999999999999 "),
        ("<p>", "<p>x "),
        ("#body-positions", "#nothing"),
        ("#body-points", "#nothing"),
        ('offset="0"', 'offset="999999999"'),
        ("</float_array>", " x</float_array>"),
        ("<COLLADA", "<!DOCTYPE COLLADA [<!ENTITY a 'b'>]><COLLADA"),
        ("</mesh>", ""),
        ("<instance_geometry", "<translate>1 2</translate><instance_geometry"),
    ],
)
def test_damage_is_refused_with_its_reason(change: tuple[str, str]) -> None:
    data = dae(geometry(triangles())).decode()
    assert change[0] in data or change[0] == "<p>0 "
    first = str(BODY.faces[0, 0])
    damaged = data.replace(change[0].replace("<p>0", f"<p>{first}"), change[1])
    with pytest.raises(ProteusError):
        parse(damaged.encode())


def test_very_wide_circles_of_nodes_are_refused_at_once() -> None:
    refers = '<instance_node url="#n"/>' * 50_000
    with pytest.raises(ProteusError, match="circle"):
        parse(dae(geometry(triangles()), f'<node id="n">{refers}</node>'))


def test_very_deep_nodes_are_read() -> None:
    deep = "<node>" * 20_000 + '<instance_geometry url="#body"/>' + "</node>" * 20_000
    assert parse(dae(geometry(triangles()), deep)).mesh.n_faces == BODY.n_faces
