"""The models that need no learning and are there from the first start.

Defaults were measured leave-one-out on 80 poses of 8 deformable shapes among 26 other objects:
32 to 200 bins, evenly or unevenly spaced, and 400 to 1500 samples are level within 0.5 points of
mean average precision; so is half precision of the stored eigenvectors.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from workers.diffusion.kernels import BiharmonicKernel, CommuteTimeKernel, HeatKernel, Kernel
from workers.errors import InvalidRequestError
from workers.geometry.preparation import PREPARATION_VERSION, View, default_view
from workers.geometry.spectrum import SOLVER_VERSION
from workers.retrieval.channels import Channel, DistanceChannel, EigenvalueChannel, Histogram
from workers.retrieval.model import Model

DESCRIPTION_VERSION = "1"
"""Part of every model's versions: raised when the same spectrum gives another descriptor."""

HEAT_TIME = 0.15  # in 1/λ₁; the best single kernel found (SCIENCE.md, section 3)
SHORTEST_HEAT_TIME = 0.002  # below it a hundred eigenpairs all count in full
LONGEST_HEAT_TIME = 20.0
FIRST_EIGENVALUE = 6.3  # of a creature of area 1, in the median
SHAPE_DNA_EIGENVALUES = 20
EVEN_BINS, TAIL_BINS, TAIL_FACTOR = 90, 10, 4.0


def built_in_models(*, working_vertices: int = 5000) -> tuple[Model, ...]:
    """Models heat, commute-time, biharmonic and shape-dna, in this order.

    Parameters
    ----------
    working_vertices : int
        Of their common view, see `default_view`.
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
    view: View,
    *,
    name: str = "heat",
    time: float = HEAT_TIME,
    normalisation: str = "first-eigenvalue",
) -> Model:
    """Distances of the heat kernel at a time in units of 1/λ₁, so that scale is forgotten.

    Or at a time in units of the area, or of the mesh's own area, as the normalisation says.
    The histogram's range follows the time: 3 at the default one, where the largest distances of
    common shapes are 2 to 3; shorter times stretch it by 1/√t, as long as further eigenpairs come
    in (Weyl's law), longer ones shrink it by exp(-λ₁t), as the first eigenfunction does. Where λ₁
    is not known, it is by 1/√t alone.

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
    return distance_model("heat", kernel, view, normalisation=normalisation, top=top, name=name)


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
    kernel : Kernel
        For eigenvalues in the unit of the normalisation.
    view : View
    normalisation : str
        The scale that is forgotten.
    top : float
        Distance up to which bins are even, see `histogram_edges`.
    name : str
        The method's where none is given.
    parameters : Mapping, optional
        Of the method; the kernel's where none are given.
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


def shape_dna_model(
    view: View, *, name: str = "shape-dna", eigenvalues: int = SHAPE_DNA_EIGENVALUES
) -> Model:
    """Logarithms of the first eigenvalues at area 1 (Reuter, Wolter, Peinecke 2005)."""
    channel = EigenvalueChannel(
        name="eigenvalues",
        view=view.name,
        normalisation="area",
        numbers=tuple(range(1, eigenvalues + 1)),
        dissimilarity="l2",
    )
    parameters = {"eigenvalues": eigenvalues}
    return _single_channel_model(name, "shape-dna", parameters, view, channel)


def histogram_edges(top: float) -> tuple[float, ...]:
    """Edges of 90 even bins from 0 to ``top`` and 10 growing ones up to 4 times as far.

    The tail is for thin and nearly parted shapes, whose distances have no upper bound; of the
    common ones next to nothing lies there.
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
