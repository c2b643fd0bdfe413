"""The models that need no learning and are there from the first start.

Defaults were measured leave-one-out on 80 poses of 8 deformable shapes among 26 other objects
(``proteus benchmark run``, commit 871f040). 32 to 200 bins, evenly or unevenly spaced, and 400 to
1500 samples are level within 0.5 points of mean average precision. So is half precision of the
stored eigenvectors.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from workers.diffusion.kernels import BiharmonicKernel, CommuteTimeKernel, HeatKernel, Kernel
from workers.errors import InvalidRequestError
from workers.geometry.spectrum import SOLVER_VERSION
from workers.geometry.views import PREPARATION_VERSION, View, default_view
from workers.retrieval.channels import Channel, DistanceChannel, EigenvalueChannel, Histogram
from workers.retrieval.model import Model

DESCRIPTION_VERSION = "1"
"""Part of every model's versions: raised when the same spectrum gives another descriptor."""

HEAT_TIME = 0.15  # in 1/λ₁; docs/learning.md has it beside 0.05 and 0.3
SHORTEST_HEAT_TIME = 0.002  # in 1/λ₁; below it a hundred eigenpairs all count in full (Weyl)
LONGEST_HEAT_TIME = 20.0  # in 1/λ₁: exp(-2 · 20) = 4·10⁻¹⁸ of the first eigenpair are left
FIRST_EIGENVALUE = 6.3  # median over creatures of area 1 (commit 214c021)
SHAPE_DNA_EIGENVALUES = 20  # a choice: what the benchmarks in docs/method.md were run with
EVEN_BINS, TAIL_BINS, TAIL_FACTOR = 90, 10, 4.0  # level with others, see above


def built_in_models(*, working_vertices: int = 5000) -> tuple[Model, ...]:
    """Models heat, commute-time, biharmonic and shape-dna, in this order.

    Parameters
    ----------
    working_vertices : int
        Of their common view, see `default_view`.

    Returns
    -------
    tuple of Model
        Of one channel each.
    """
    view = default_view(working_vertices=working_vertices)
    return (
        heat_model(view),
        distance_model("commute-time", CommuteTimeKernel(), view, normalisation="area", top=4.0),
        distance_model(
            "biharmonic", BiharmonicKernel(), view, normalisation="first-eigenvalue", top=3.2
        ),
        shape_dna_model(view),
    )


def heat_model(
    view: View, *, time: float = HEAT_TIME, normalisation: str = "first-eigenvalue"
) -> Model:
    """Model of the distances of the heat kernel.

    The histogram's range follows the time. It is 3 at the default one, where the largest distances
    of common shapes are 2 to 3. Shorter times stretch it by 1/√t, as long as further eigenpairs
    come in (Weyl's law). Longer ones shrink it by exp(-λ₁t), as the first eigenfunction does.
    Where λ₁ is not known, it is by 1/√t alone.

    Parameters
    ----------
    view : View
        Under which it is described.
    time : float
        In 1/λ₁, so that scale is forgotten, or in the unit of another normalisation.
    normalisation : str
        "first-eigenvalue"; "area" for times as a share of the area; "none" for the mesh's own.

    Returns
    -------
    Model
        Of one channel.

    Raises
    ------
    InvalidRequestError
        The time is not above 0, or so long that nothing is left of the kernel.
    """
    kernel = HeatKernel(time)
    first = {"first-eigenvalue": 1.0, "area": FIRST_EIGENVALUE}.get(normalisation)
    if first is None:
        top = 3.0 * math.sqrt(HEAT_TIME / time)
    else:
        top = math.sqrt(first) * _heat_reach(first * time)
    return distance_model("heat", kernel, view, normalisation=normalisation, top=top)


def _heat_reach(time: float) -> float:
    """Range of the histogram for a time in 1/λ₁, on the surface scaled to λ₁ = 1."""
    if time > LONGEST_HEAT_TIME:
        raise InvalidRequestError(
            f"heat time is {time:g}/λ₁, expected at most {LONGEST_HEAT_TIME:g}/λ₁"
        )
    if time < HEAT_TIME:
        return 3.0 * math.sqrt(HEAT_TIME / max(time, SHORTEST_HEAT_TIME))
    return 3.0 * math.exp(HEAT_TIME - time)


def distance_model(
    method: str,
    kernel: Kernel,
    view: View,
    *,
    normalisation: str,
    top: float,
    name: str = "",
    parameters: Mapping[str, Any] | None = None,
) -> Model:
    """Model of one channel: the distribution of a kernel's distances.

    Parameters
    ----------
    method : str
        By which the kernel is found.
    kernel : Kernel
        For eigenvalues in the unit of the normalisation.
    view : View
        Under which it is described.
    normalisation : str
        The scale that is forgotten.
    top : float
        Distance up to which bins are even, see `histogram_edges`.
    name : str
        The method's where none is given.
    parameters : Mapping, optional
        Of the method; the kernel's where none are given.

    Returns
    -------
    Model
        Its distance is the L1 distance of the histograms.
    """
    channel = DistanceChannel(
        name="distances",
        view=view.name,
        kernel=kernel,
        normalisation=normalisation,
        summary=Histogram(histogram_edges(top)),
        dissimilarity="l1",
    )
    own = kernel.parameters if parameters is None else parameters
    return _single_channel_model(name or method, method, own, view, channel)


def shape_dna_model(view: View, *, eigenvalues: int = SHAPE_DNA_EIGENVALUES) -> Model:
    """Model of the logarithms of the first eigenvalues at area 1 (Reuter, Wolter, Peinecke 2005).

    Parameters
    ----------
    view : View
        Under which it is described.
    eigenvalues : int
        How many.

    Returns
    -------
    Model
        Its distance is Euclidean.
    """
    channel = EigenvalueChannel(
        name="eigenvalues",
        view=view.name,
        normalisation="area",
        numbers=tuple(range(1, eigenvalues + 1)),
        dissimilarity="l2",
    )
    parameters = {"eigenvalues": eigenvalues}
    return _single_channel_model("shape-dna", "shape-dna", parameters, view, channel)


def histogram_edges(top: float) -> tuple[float, ...]:
    """Edges of 90 even bins from 0 to ``top`` and 10 growing ones up to 4 times as far.

    The tail is for thin and nearly parted shapes, whose distances have no upper bound. Of common
    shapes next to nothing lies there.

    Parameters
    ----------
    top : float
        Above 0, in the unit of the distances.

    Returns
    -------
    (101,) tuple of float
        Ascending, to nine digits.
    """
    even = np.linspace(0.0, top, EVEN_BINS + 1)
    tail = np.geomspace(top, TAIL_FACTOR * top, TAIL_BINS + 1)[1:]
    return tuple(float(f"{edge:.9g}") for edge in np.concatenate([even, tail]))


def _single_channel_model(
    name: str, method: str, parameters: Mapping[str, Any], view: View, channel: Channel
) -> Model:
    """Return a model whose distance is the plain dissimilarity of its channel."""
    return Model(
        name=name,
        method=method,
        parameters=parameters,
        views=(view,),
        channels=(channel,),
        versions={
            "description": DESCRIPTION_VERSION,
            "preparation": PREPARATION_VERSION,
            "solver": SOLVER_VERSION,
        },
    )
