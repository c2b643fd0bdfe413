"""Debris: components so small that together they are next to nothing."""

from dataclasses import dataclass

import numpy as np

from workers.geometry.arrays import IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.topology import surface_components

LARGEST_DEBRIS = 1e-4  # of the total area, each: such parts count for nothing (decision 30)
MOST_DEBRIS = 0.01  # of the total area, all together: what is left out stays below


@dataclass(frozen=True, eq=False)
class WithoutDebris:
    """What is left of a mesh without its debris.

    Attributes
    ----------
    faces : (m,) int64
        Numbers of the faces that stay, ascending.
    n_left_out : int
        Components that go.
    share : float
        Of the area that goes with them, below `MOST_DEBRIS`.
    labels : (m,) int64
        Component of each face that stays, from 0 without gaps.
    """

    faces: IntArray
    n_left_out: int
    share: float
    labels: IntArray


def without_debris(mesh: TriangleMesh) -> WithoutDebris:
    """Find the components that have less than a ten-thousandth of the area.

    If all of these together have 1 % or more of the area, they stay: they are no debris.

    Parameters
    ----------
    mesh : TriangleMesh
        Without faces that have no area.

    Returns
    -------
    WithoutDebris
        Without the debris of the mesh; what is left has none.
    """
    labels = surface_components(mesh)  # (m,)
    if labels.max(initial=0) == 0:
        return WithoutDebris(np.arange(mesh.n_faces), 0, 0.0, labels)
    areas = np.bincount(labels, weights=mesh.face_areas)  # (c,)
    total = float(areas.sum())
    gone = areas < LARGEST_DEBRIS * total  # (c,)
    if areas[gone].sum() >= MOST_DEBRIS * total:
        gone[:] = False
    faces = np.flatnonzero(~gone[labels])
    kept = (np.cumsum(~gone) - 1)[labels[faces]]  # (m,)
    return WithoutDebris(faces, int(gone.sum()), float(areas[gone].sum()) / total, kept)
