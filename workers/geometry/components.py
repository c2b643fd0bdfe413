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
FRAGMENT = 0.1  # share of the area around which a part turns from a fragment into body
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
    body : float
        Area of the body that it belongs to, over its own: 1 of a body with next to no fragments.
    """

    mesh: TriangleMesh
    weight: float
    copies: float
    body: float


def described_components(mesh: TriangleMesh) -> tuple[Component, ...]:
    """Choose the components of a surface by which it is described.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.

    Returns
    -------
    tuple of Component
        The largest first, at most 32, and the mesh itself where it is connected. Of more
        components, sorted by area, the middle one of each run stands for the run. Runs have equal
        sums of the square roots of the weights, so that heavy components stand for themselves.
    """
    labels = surface_components(mesh)  # (m,)
    if labels.max(initial=0) == 0 < len(labels):
        return (Component(mesh, 1.0, 1.0, 1.0),)
    areas: FloatArray = np.bincount(labels, weights=mesh.face_areas).astype(np.float64)  # (c,)
    counted = counted_shares(areas)
    weights, shares = counted / counted.sum(), areas / areas.sum()
    order = np.argsort(-areas, kind="stable")
    parts = []
    for run in _runs(order, weights):
        weight = float(weights[run].sum())
        if weight >= LEAST_WEIGHT:
            middle = run[len(run) // 2]
            copies = float(areas[run].sum() / areas[middle])
            body = float(counted.sum() / shares[middle])
            parts.append(Component(_cut_out(mesh, labels == middle), weight, copies, body))
    return tuple(parts)


def counted_shares(areas: FloatArray) -> FloatArray:
    """How much of the area of each component counts as body.

    Of a component of share s the part t³ / (t³ + c³) counts, c = 0.1. Here t is the share of all
    that is about its size or smaller: Σ s_j s_i² / (s_i² + s_j²). So pieces of a body that was cut
    count by their areas. Fragments of a share t far below c count about t⁴ / c³. The distance of
    the model `proteus` grows with the fourth root of a difference. So fragments shift it in
    proportion to t.

    Parameters
    ----------
    areas : (c,) float64
        Of the components, above 0.

    Returns
    -------
    (c,) float64
        In units of the total area; of a body beside next to nothing it is the body's share.
    """
    shares = areas / areas.sum()
    order = np.argsort(-shares, kind="stable")
    runs = np.array_split(shares[order], min(len(shares), FINEST_RUNS))
    lengths = [len(run) for run in runs]
    totals = np.array([run.sum() for run in runs])  # (r,)
    squares = (totals / lengths) ** 2  # (r,) of the mean share
    smaller = (squares[:, None] / (squares[:, None] + squares)) @ totals  # (r,) t
    factors = smaller**3 / (smaller**3 + FRAGMENT**3)  # (r,)
    counted = np.empty(len(shares))
    counted[order] = shares[order] * np.repeat(factors / factors.max(), lengths)
    return counted


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
