"""Figures on made-up curves and shapes: what is drawn, and that the bytes are the same twice."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from PIL import Image

from proteus.reproduction import style
from proteus.reproduction.curves import (
    Curve,
    commute_time_like,
    draw_interpolations,
    draw_learned,
    draw_scale_only,
    loglog_slope,
)
from proteus.reproduction.pictures import (
    Signature,
    common_range,
    draw_signatures,
    draw_transformations,
    histogram_overlap,
)
from tests.meshes import bumpy_sphere, icosphere, scaled
from workers.geometry.mesh import TriangleMesh

LAMBDA = np.geomspace(0.5, 500.0, 80)


def power(slope: float, factor: float = 1.0) -> Curve:
    return Curve(f"slope {slope:g}", LAMBDA, factor * LAMBDA**slope)


def signature(name: str, mesh: TriangleMesh, *, shift: float = 0.0) -> Signature:
    return Signature(name, mesh, mesh.vertices[:, 1] / np.abs(mesh.vertices).max() + shift)


def figures() -> dict[str, Figure]:
    ball, bumpy = icosphere(3), bumpy_sphere(3)
    return {
        "one": draw_interpolations(power(-1.0), power(-1.1), power(-0.9)),
        "two": draw_transformations([("null", ball), ("noise", bumpy), ("all", ball)], columns=2),
        "three": draw_scale_only(power(-1.0, 7.0), slope=-1.0),
        "four": draw_learned(power(-1.2), power(-2.0)),
        "five": draw_signatures([signature("null", ball), signature("noise", bumpy)]),
    }


def test_commute_time_lies_on_a_curve_of_its_own_slope() -> None:
    theory = commute_time_like(power(-1.0, 7.0))
    assert_allclose(theory.squared, power(-1.0, 7.0).squared)
    assert loglog_slope(theory) == pytest.approx(-1.0)
    assert loglog_slope(power(-1.15)) == pytest.approx(-1.15)


def test_commute_time_is_flat_times_lambda() -> None:
    assert_allclose(power(-1.0, 7.0).scale_free.squared, 7.0)


def test_curves_are_drawn_on_logarithmic_axes_with_names() -> None:
    with style.drawing():
        axes = draw_interpolations(power(-1.0), power(-1.1), power(-0.9)).axes[0]
        lines = axes.get_lines()
    assert [line.get_label() for line in lines] == ["slope -1", "slope -1.1", "slope -0.9"]
    assert_allclose(np.asarray(lines[1].get_ydata(), dtype=float), power(-1.1).squared)
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3


def test_a_kernel_of_zeros_is_left_out_where_it_is_zero() -> None:
    cut_off = Curve("low pass", LAMBDA, np.where(LAMBDA < 10.0, 1.0 / LAMBDA, 0.0))
    with style.drawing():
        figure = draw_learned(cut_off, cut_off)
        shown = np.asarray(figure.axes[0].get_lines()[1].get_ydata(), dtype=float)
        assert figure.axes[0].get_ylim()[0] > 0
    assert np.isnan(shown[LAMBDA >= 10.0]).all()
    assert np.isfinite(shown[LAMBDA < 10.0]).all()


def test_files_are_the_same_twice_and_svg_is_well_formed(tmp_path: Path) -> None:
    for run in ("first", "second"):
        with style.drawing():
            for name, figure in figures().items():
                png, svg = style.save_figure(figure, tmp_path / run, name)
                with Image.open(png) as image:
                    assert image.size[0] > 100
                assert ElementTree.fromstring(svg.read_text()).tag.endswith("svg")
    first = {path.name: path.read_bytes() for path in (tmp_path / "first").iterdir()}
    second = {path.name: path.read_bytes() for path in (tmp_path / "second").iterdir()}
    assert len(first) == 10
    assert first == second


def test_drawing_leaves_the_persons_own_settings_alone() -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    with style.drawing():
        assert matplotlib.rcParams["svg.hashsalt"] == "proteus"
    assert dict(matplotlib.rcParams) == before


def test_vertex_areas_sum_to_the_area() -> None:
    mesh = bumpy_sphere(2)
    assert signature("null", mesh).areas.sum() == pytest.approx(mesh.area)


def test_histograms_of_the_same_function_overlap_whole_and_of_others_less() -> None:
    mesh = bumpy_sphere(3)
    one = signature("null", mesh)
    assert histogram_overlap(one, one) == pytest.approx(1.0)
    assert histogram_overlap(one, signature("scale", scaled(mesh, 3.0))) == pytest.approx(1.0)
    assert histogram_overlap(one, signature("other", mesh, shift=9.0)) < 0.1
    low, high = common_range([one])
    assert one.values.min() <= low < high <= one.values.max()
