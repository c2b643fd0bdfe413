"""The channels that a bank is chosen from: local kernels at many times, each in several units."""

from collections.abc import Iterator, Sequence

import numpy as np

from workers.diffusion.bands import MexicanHatKernel, WaveKernel
from workers.diffusion.kernels import BiharmonicKernel, HeatKernel, Kernel
from workers.geometry.spectrum import SOLVER_VERSION
from workers.geometry.views import PREPARATION_VERSION, View
from workers.retrieval.builtin import DESCRIPTION_VERSION
from workers.retrieval.channels import (
    AreaChannel,
    Channel,
    EigenvalueChannel,
    KernelChannel,
    LogDiagonalChannel,
    PointsChannel,
    Quantiles,
)
from workers.retrieval.model import Model
from workers.retrieval.roughness import RoughnessLimits

QUANTILE_LEVELS = (
    *(0.005, 0.02, 0.05, 0.1, 0.17, 0.25, 0.34, 0.45),
    *(0.55, 0.66, 0.75, 0.83, 0.9, 0.95, 0.98, 0.995),
)
"""Denser towards the tails, which tell much about a shape."""

# Candidates are broad on purpose: `elimination` chooses among them (docs/method.md).
RELATIVE_TIMES = (0.02, 0.05, 0.15, 0.4, 1.0, 4.0)  # in 1/λ₁
AREA_TIMES = (0.00025, 0.0005, 0.001, 0.002, 0.004, 0.01, 0.03)  # of a surface of area 1
HAT_TIMES = (0.00025, 0.0005, 0.001, 0.002, 0.004, 0.008, 0.03)
RELATIVE_ENERGIES = (0.0, 1.0, 2.0, 3.0, 4.0)  # in ln λ/λ₁
AREA_ENERGIES = (3.0, 4.0, 5.0, 6.0, 6.7, 7.4)  # in ln λ at area 1
# 100 eigenpairs allow for t = 0.0005 and e = 6.7, and 200 for half that time and 7.4 (decision 15).
LEAST_DAMPING = 0.62  # tλ of a time at the spectrum's end: shorter times are cut off
HIGHEST_ENERGY = 0.7  # λ of a wave's middle at most, as a share of that end
LEADING_EIGENVALUES = 15
POINTS_TIME = 0.0005  # of a surface of area 1
POINTS_TIMES = (1.0, 1.69, 2.856, 4.827, 8.157, 13.786, 23.298)  # a factor 1.69 apart
POINTS_SAMPLES = 64  # 128 points are level (decision 9)
ROUGH = (0.35, 0.7)
"""Clean shapes are below the first, those with noise as large as an edge above the second.

Measured by ``python -m benchmarks.model_study``; limits of 0.3 and 0.5 to 0.4 and 0.7 are level
(decision 16).
"""


def candidate_model(views: Sequence[View], *, power: float) -> Model:
    """Model of every candidate that each view resolves, all of weight 1 and scale 1.

    A bank's descriptor is made of columns of this model's. Where there is a smoothed view, the
    others have limits of roughness.

    Parameters
    ----------
    views : sequence of View
        At least one.
    power : float
        p of the fusion Σ w (D/s)^p.

    Returns
    -------
    Model
        Each view's channels, then the area of the first view, then roughness.
    """
    channels = [
        channel
        for view in views
        for channel in _of_view(view.name)
        if is_resolved(channel, view.eigenpairs)
    ]
    return Model(
        name="candidates",
        method="bank",
        parameters={},
        views=tuple(views),
        channels=(*channels, _area(views[0].name)),
        roughness_limits=tuple(_roughness_limits(views)),
        fusion_power=power,
        versions={
            "description": DESCRIPTION_VERSION,
            "preparation": PREPARATION_VERSION,
            "solver": SOLVER_VERSION,
        },
    )


def is_resolved(channel: Channel, eigenpairs: int) -> bool:
    """Whether so many eigenpairs reach as far as a channel's kernel needs, by Weyl's law.

    Kernels in units of 1/λ₁ are all coarse enough.

    Parameters
    ----------
    channel : Channel
        Any.
    eigenpairs : int
        Of its view.

    Returns
    -------
    bool
        λ of the last of them is about 4π · eigenpairs at area 1.
    """
    if channel.normalisation != "area" or not isinstance(channel, KernelChannel):
        return True
    end = 4.0 * np.pi * eigenpairs
    match channel.kernel:
        case HeatKernel(time=time) | MexicanHatKernel(time=time):
            return time * end >= LEAST_DAMPING
        case WaveKernel(energy=energy):
            return bool(np.exp(energy) <= HIGHEST_ENERGY * end)
    return True


def _of_view(view: str) -> Iterator[Channel]:
    """Candidates under one view; "relative" stands for λ/λ₁, "even" for a centre of 0."""
    relative, area = "first-eigenvalue", "area"
    yield _signature(view, "biharmonic even", BiharmonicKernel(), area, "log-mean")
    for time in RELATIVE_TIMES:
        heat = HeatKernel(time)
        yield _signature(view, f"heat {time:g}/λ₁ even", heat, relative, "log-mean")
        yield _signature(view, f"heat {time:g}/λ₁", heat, relative, "none")
    for time in AREA_TIMES:
        heat = HeatKernel(time)
        yield _signature(view, f"heat {time:g} even", heat, area, "log-mean")
        yield _signature(view, f"heat {time:g}", heat, area, "none")
    for time in HAT_TIMES:
        hat = MexicanHatKernel(time)
        yield _signature(view, f"hat {time:g} even", hat, area, "log-mean")
    for energy in RELATIVE_ENERGIES:
        wave = WaveKernel(energy)
        yield _signature(view, f"wave {energy:g} λ/λ₁ even", wave, relative, "log-mean")
        yield _signature(view, f"wave {energy:g} λ/λ₁", wave, relative, "mean")
    for energy in AREA_ENERGIES:
        wave = WaveKernel(energy)
        yield _signature(view, f"wave {energy:g} even", wave, area, "log-mean")
        yield _signature(view, f"wave {energy:g}", wave, area, "mean")
    yield EigenvalueChannel(
        name=f"{view}: eigenvalues",
        view=view,
        normalisation="first-eigenvalue",
        numbers=tuple(range(2, LEADING_EIGENVALUES + 1)),
    )
    yield PointsChannel(
        name=f"{view}: points",
        view=view,
        kernel=HeatKernel(POINTS_TIME),
        normalisation="area",
        time_factors=POINTS_TIMES,
        samples=POINTS_SAMPLES,
    )


def _signature(view: str, name: str, kernel: Kernel, normalisation: str, centre: str) -> Channel:
    """Quantiles of ln k(x,x) over the whole surface."""
    return LogDiagonalChannel(
        name=f"{view}: {name}",
        view=view,
        kernel=kernel,
        normalisation=normalisation,
        summary=Quantiles(QUANTILE_LEVELS),
        centre=centre,
    )


def _area(view: str) -> Channel:
    """The one channel that sees scale."""
    return AreaChannel(name=f"{view}: area", view=view)


def _roughness_limits(views: Sequence[View]) -> Iterator[RoughnessLimits]:
    """Of views that noise can ruin, where there is one that it cannot."""
    if any(view.is_smoothed for view in views):
        for view in views:
            if not view.is_smoothed:
                yield RoughnessLimits(view.name, *ROUGH)
