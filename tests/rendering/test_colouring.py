"""Laws of the colour map: lightness rises evenly, ends are ends, and what has no value is grey."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.meshes import icosphere
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.rendering.colouring import ANCHORS, WITHOUT_VALUE, finite_range, value_colours
from workers.rendering.render import render

FRONT = (0.0, 0.0, 1.0)


def lightness(colours: FloatArray) -> FloatArray:
    """L of CIELAB of sRGB colours, (n,)."""
    share = colours / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    luminance: FloatArray = linear @ np.array([0.2126, 0.7152, 0.0722])
    result: FloatArray = 116.0 * np.cbrt(luminance) - 16.0  # none is so dark that it is linear
    return result


def test_lightness_rises_evenly_from_the_lowest_value_to_the_highest() -> None:
    steps = np.diff(lightness(value_colours(np.linspace(0.0, 1.0, 13), 0.0, 1.0)))
    assert (steps > 0).all()
    assert steps.max() < 2.0 * steps.min()  # the rest of each equal step is a change of hue


def test_anchors_are_met_and_between_them_the_colours_are_linear() -> None:
    assert_allclose(value_colours(np.linspace(2.0, 4.0, 13), 2.0, 4.0), ANCHORS, atol=1e-9)
    middle = value_colours(np.array([1.0 / 24.0]), 0.0, 1.0)[0]
    assert_allclose(middle, (np.array(ANCHORS[0]) + ANCHORS[1]) / 2)


def test_what_lies_outside_has_the_end_colours_and_no_number_is_grey() -> None:
    values = np.array([-9.0, 9.0, np.nan])
    assert_array_equal(value_colours(values, 0.0, 1.0), [ANCHORS[0], ANCHORS[-1], WITHOUT_VALUE])
    assert finite_range(values) == (-9.0, 9.0)
    assert finite_range(np.array([np.nan])) == (0.0, 0.0)
    assert_array_equal(value_colours(np.array([3.0]), 3.0, 3.0), [ANCHORS[6]])


@pytest.mark.parametrize("bounds", [(1.0, 0.0), (0.0, np.inf), (np.nan, 1.0)])
def test_a_range_that_does_not_ascend_is_refused(bounds: tuple[float, float]) -> None:
    with pytest.raises(InvalidRequestError, match="expected to ascend"):
        value_colours(np.zeros(2), *bounds)


def test_a_sphere_coloured_by_height_is_dark_below_and_light_above() -> None:
    sphere = icosphere(4)
    height = sphere.vertices[:, 1].copy()
    picture = render(sphere, size=100, direction=FRONT, values=height)
    below, above = picture[90, 50, :3].astype(int), picture[10, 50, :3].astype(int)
    assert below[2] > below[1]  # violet
    assert above[1] > 2 * above[2]  # yellow
    same = render(sphere, size=100, direction=FRONT, values=height, value_range=(-1.0, 1.0))
    assert_allclose(picture.astype(int), same, atol=1)  # the sphere's range is -1 to 1
    wide = render(sphere, size=100, direction=FRONT, values=height, value_range=(-100.0, 100.0))
    one_colour = render(sphere, size=100, direction=FRONT, colour=ANCHORS[6])
    assert np.abs(wide.astype(int) - one_colour).max() <= 6


def test_a_value_for_each_vertex_is_demanded() -> None:
    with pytest.raises(InvalidRequestError, match=r"\(3,\) were given for 12 vertices"):
        render(icosphere(0), values=np.zeros(3))
