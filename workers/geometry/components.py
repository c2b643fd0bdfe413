"""The connected parts of a surface, and how much each of them counts.

A figure with two loose eyeballs is nearly the figure without them, and a heap of a hundred equal
parts is no single part. So every component is described by itself, and the descriptions are
averaged with weights that change smoothly with the components' areas (decision 30).
"""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import surface_components

MOST_DESCRIBED = 32  # components that are solved; one stands for many if there are more
LEAST_WEIGHT = 1e-12  # what counts less is not solved: a thousandth in the distance of `proteus`
FINEST_RUNS = 1024  # more components than these are weighed in runs of nearly equal areas


@dataclass(frozen=True, eq=False)
class Component:
    """A connected part of a surface that stands for itself and for parts of about its size.

    Attributes
    ----------
    mesh : TriangleMesh
        Connected by edges; vertices and faces in the order of the whole.
    weight : float
        How much it counts, with all that it stands for; the weights of a surface sum to 1.
    copies : float
        Area of all that it stands for, over its own.
    """

    mesh: TriangleMesh
    weight: float
    copies: float


@dataclass(frozen=True, eq=False)
class Components:
    """The connected parts of a surface that are described.

    Attributes
    ----------
    parts : tuple of Component
        The largest first.
    equal_parts : float
        1 / Σ weight² over all components: as many equal ones would have the same.
    """

    parts: tuple[Component, ...]
    equal_parts: float


def described_components(mesh: TriangleMesh) -> Components:
    """Choose the components of a surface by which it is described.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.

    Returns
    -------
    Components
        At most 32, and the mesh itself where it is connected. Of more components, sorted by area,
        the middle one of each run stands for the run. Runs have equal sums of the square roots of
        the weights, so that heavy components stand for themselves.
    """
    labels = surface_components(mesh)  # (m,)
    areas: FloatArray = np.bincount(labels, weights=mesh.face_areas).astype(np.float64)  # (c,)
    if len(areas) == 1:
        return Components((Component(mesh, 1.0, 1.0),), 1.0)
    weights = component_weights(areas)
    order = np.argsort(-areas, kind="stable")
    parts = []
    for run in _runs(order, weights):
        weight = float(weights[run].sum())
        if weight >= LEAST_WEIGHT:
            middle = run[len(run) // 2]
            copies = float(areas[run].sum() / areas[middle])
            parts.append(Component(_cut_out(mesh, labels == middle), weight, copies))
    return Components(tuple(parts), float(1.0 / (weights**2).sum()))


def component_weights(areas: FloatArray) -> FloatArray:
    """How much components count in the description of their surface.

    A component of share s counts s t³. Here t is the share of all that is about its size or
    smaller: Σ s_j s_i² / (s_i² + s_j²). So fragments that make up the share t together have the
    weight t⁴, and shift the distance of the model `proteus`, which grows with the fourth root of a
    difference, in proportion to t. Components of equal areas have equal weights.

    Parameters
    ----------
    areas : (c,) float64
        Of the components, above 0.

    Returns
    -------
    (c,) float64
        They sum to 1.
    """
    shares = areas / areas.sum()
    order = np.argsort(-shares, kind="stable")
    runs = np.array_split(shares[order], min(len(shares), FINEST_RUNS))
    totals = np.array([run.sum() for run in runs])  # (r,)
    squares = (totals / np.array([len(run) for run in runs])) ** 2  # (r,) of the mean share
    smaller = (squares[:, None] / (squares[:, None] + squares)) @ totals  # (r,) t
    factors = np.repeat(smaller**3, [len(run) for run in runs])  # (c,)
    weights = np.empty(len(shares))
    weights[order] = shares[order] * factors
    normalised: FloatArray = weights / weights.sum()
    return normalised


def _runs(order: IntArray, weights: FloatArray) -> list[IntArray]:
    """Components in this order, cut into at most `MOST_DESCRIBED` runs."""
    roots = np.sqrt(weights[order])
    middles = np.cumsum(roots) - 0.5 * roots
    place = np.floor(MOST_DESCRIBED * middles / roots.sum())
    return np.split(order, np.flatnonzero(np.diff(place)) + 1)


def _cut_out(mesh: TriangleMesh, wanted: np.ndarray) -> TriangleMesh:
    """The faces that are wanted, (m,) bool, with vertices of their own."""
    faces = mesh.faces[wanted]
    used, corners = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices[used], corners.reshape(faces.shape))
