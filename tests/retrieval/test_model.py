"""Models: parts of a descriptor, JSON, and what does not fit together."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from workers.diffusion.kernels import CommuteTimeKernel, HeatKernel, TabulatedKernel
from workers.errors import InvalidRequestError
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.geometry.views import default_view, open_view
from workers.retrieval.channels import (
    DiagonalChannel,
    DistanceChannel,
    EigenvalueChannel,
    Histogram,
    Quantiles,
)
from workers.retrieval.kernel_curves import kernel_curves
from workers.retrieval.model import Model, describe
from workers.retrieval.roughness import RoughnessLimits

EDGES = Histogram(tuple(np.linspace(0.0, 4.0, 21).tolist()))
COMMUTE = DistanceChannel(
    name="commute", view="closed", kernel=CommuteTimeKernel(), summary=EDGES, samples=90
)
CHANNELS = (
    COMMUTE,
    DiagonalChannel(
        name="heat",
        view="closed",
        kernel=HeatKernel(0.2),
        normalisation="area",
        summary=Quantiles((0.1, 0.9)),
        weight=2.0,
    ),
    EigenvalueChannel(
        name="dna", view="open", normalisation="area", numbers=(1, 2, 3), dissimilarity="l2"
    ),
)
MODEL = Model(
    name="three",
    method="bank",
    parameters={"n": 3},
    views=(default_view(), open_view()),
    channels=CHANNELS,
    fusion_power=0.25,
    versions={"solver": "1"},
)


def test_a_descriptor_is_its_channels_one_after_the_other(bumpy: Solution) -> None:
    descriptor = describe({"closed": bumpy, "open": bumpy}, MODEL)
    assert descriptor.shape == (MODEL.dimension,) == (25,)
    assert descriptor.dtype == np.float32
    assert not descriptor.flags.writeable
    assert list(MODEL.slices.values()) == [slice(0, 20), slice(20, 22), slice(22, 25)]
    for channel in CHANNELS:
        expected = channel.describe(bumpy)
        assert_array_equal(descriptor[MODEL.slices[channel.name]], expected)


def test_each_channel_sees_its_own_view(bumpy: Solution) -> None:
    spectrum = bumpy.spectrum
    stretched = Spectrum(
        spectrum.eigenvalues * np.linspace(1.0, 2.0, 60),
        spectrum.eigenvectors,
        spectrum.areas,
        spectrum.area,
    )
    plain = describe({"closed": bumpy, "open": bumpy}, MODEL)
    other = describe({"closed": bumpy, "open": replace(bumpy, spectrum=stretched)}, MODEL)
    assert_array_equal(other[:22], plain[:22])
    assert np.all(other[23:] != plain[23:])


def test_the_same_arguments_give_the_same_bytes(bumpy: Solution) -> None:
    prepared = {"closed": bumpy, "open": bumpy}
    assert describe(prepared, MODEL).tobytes() == describe(prepared, MODEL).tobytes()


def test_a_missing_view_is_named(bumpy: Solution) -> None:
    with pytest.raises(InvalidRequestError, match="needs the view 'open'"):
        describe({"closed": bumpy}, MODEL)


def test_json_brings_a_model_back() -> None:
    again = Model.from_json(json.loads(json.dumps(MODEL.to_json())))
    assert again == MODEL
    assert [view.key for view in again.views] == [view.key for view in MODEL.views]


def test_roughness_is_stored_among_the_channels_and_stands_behind_them() -> None:
    limited = replace(MODEL, roughness_limits=(RoughnessLimits("open", 0.1, 0.5),))
    content = limited.to_json()
    assert Model.from_json(json.loads(json.dumps(content))) == limited
    assert [one["feature"] for one in content["channels"]][-1] == "roughness"
    assert limited.slices["open: roughness"] == slice(25, 26)
    assert limited.dimension == 26
    content["channels"] = content["channels"][::-1]
    with pytest.raises(InvalidRequestError, match="behind them all"):
        Model.from_json(content)


@pytest.mark.parametrize(
    "key", ["name", "method", "parameters", "views", "channels", "fusion", "versions"]
)
def test_json_with_a_part_missing_is_refused(key: str) -> None:
    content = MODEL.to_json()
    del content[key]
    with pytest.raises(InvalidRequestError, match="cannot be read"):
        Model.from_json(content)


def test_channels_need_different_names() -> None:
    with pytest.raises(InvalidRequestError, match="names different"):
        replace(MODEL, channels=(CHANNELS[0], CHANNELS[0]))
    with pytest.raises(InvalidRequestError, match="at least one"):
        replace(MODEL, channels=())


def test_channels_need_their_views() -> None:
    with pytest.raises(InvalidRequestError, match="no view 'open'"):
        replace(MODEL, views=(default_view(),))


@pytest.mark.parametrize("power", [0.0, -1.0, float("nan"), float("inf")])
def test_the_power_is_positive(power: float) -> None:
    with pytest.raises(InvalidRequestError, match="power"):
        replace(MODEL, fusion_power=power)


def test_curves_show_every_kernel() -> None:
    table = TabulatedKernel(np.array([0.5, 2.0, 70.0]), np.array([3.0, 1.0, 0.0]))
    channels = (*CHANNELS, replace(COMMUTE, name="table", kernel=table))
    commute, heat, tabulated = kernel_curves(replace(MODEL, channels=channels))
    assert [commute.name, heat.name, tabulated.name] == ["commute", "heat", "table"]
    assert heat.kind == "heat"
    assert heat.parameters == {"time": 0.2}
    assert_array_equal(commute.squared_transfer, 1.0 / commute.eigenvalues)
    assert_array_equal(tabulated.eigenvalues, table.eigenvalues)
    assert_array_equal(tabulated.squared_transfer, table.values)
