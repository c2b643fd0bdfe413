"""AMF: how constellations place their objects."""

import numpy as np
from numpy.testing import assert_allclose

from tests.formats.amf_files import amf, thing
from tests.formats.kinds import BODY
from workers.geometry.formats import parse


def test_an_instance_is_turned_about_x_then_y_then_z_and_then_moved() -> None:
    values = "<deltax>1</deltax><deltay>2</deltay><deltaz>3</deltaz><rx>90</rx><rz>90</rz>"
    group = f'<constellation id="9"><instance objectid="1">{values}</instance></constellation>'
    x, y, z = BODY.vertices.T
    # About x: (x, -z, y); about z: (z, x, y).
    expected = np.stack([1 + z, 2 + x, 3 + y], axis=1)
    parsed = parse(amf(thing() + group))
    assert (parsed.format, parsed.up) == ("amf", "z")
    assert_allclose(parsed.mesh.vertices, expected, atol=1e-9)


def test_a_mirrored_instance_stays_turned_outward() -> None:
    group = (
        '<constellation id="9"><instance objectid="1"><mirrorx>-1</mirrorx></instance>'
        "</constellation>"
    )
    mesh = parse(amf(thing() + group)).mesh
    corners = mesh.vertices[mesh.faces]
    assert np.linalg.det(corners).sum() > 0
