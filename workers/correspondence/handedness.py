"""What tells left from right: fields that change their sign in a mirror.

Two functions f and g that depend on the surface's own distances alone have n · (∇f × ∇g): a number
at each point whose sign is another in a mirror (after Ren et al. 2018, who preserve the orientation
of a map with such fields). Here f and g are the logarithm of the heat kernel k_t(x,x) at two times.
"""

import numpy as np

from workers.correspondence.surface import Surface, summed
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.normals import unit_vectors

# Chosen on creatures of the training species: the correlation of the fields at points that
# correspond in two poses is 0.6 to 0.95.
TIMES = ((0.003, 0.01), (0.01, 0.03), (0.03, 0.1))
LOCAL_TIMES = TIMES[:2]
"""Those that a boundary far away does not change."""
SPREADS = (0.002, 0.008)
_MOST = 3.0  # standard deviations
_FAINT = 0.05  # where less is left of a field, the shape is its own mirror image in all places


def handedness(surface: Surface, scale: float, *, is_local: bool) -> FloatArray:
    """Fields that change their sign in a mirror.

    Parameters
    ----------
    surface : Surface
        Of area 1.
    scale : float
        Lengths on it, times this, are lengths in the unit of the times.
    is_local : bool
        Whether only what lies near a point counts, as where a part is compared with a whole.

    Returns
    -------
    (n, 6) or (n, 4) float64
        At every vertex; their size is compressed by a square root.
    """
    slopes = _Slopes(surface)
    found = []
    for times in LOCAL_TIMES if is_local else TIMES:
        first, second = (slopes.of(_log_heat_kernel(surface, time / scale**2)) for time in times)
        turns = np.einsum("mi,mi->m", np.cross(first, second), slopes.normals) / scale**2
        shares = np.repeat(turns * slopes.areas / 3.0, 3)
        amounts = summed(surface.mesh.faces.ravel(), shares, surface.mesh.n_vertices)
        found += [surface.averaged(amounts, spread / scale**2) for spread in SPREADS]
    fields = np.stack(found, axis=1)  # (n, c)
    compressed: FloatArray = np.sign(fields) * np.sqrt(np.abs(fields))
    return compressed


def alike_in_size(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Both surfaces' fields in units of the second's standard deviations, without outliers.

    Parameters
    ----------
    first : (n, c) float64
        Fields of one surface.
    second : (m, c) float64
        The same of the other.

    Returns
    -------
    (n, c) and (m, c) float64
        Within -3 and 3.
    """
    size = np.maximum(np.sqrt((second**2).mean(axis=0)), _FAINT)
    return np.clip(first / size, -_MOST, _MOST), np.clip(second / size, -_MOST, _MOST)


def orientation(source: Surface, target: Surface, images: IntArray) -> float:
    """How far a map keeps the orientation.

    Parameters
    ----------
    source : Surface
        Of n vertices.
    target : Surface
        Where they are mapped to.
    images : (n,) int64
        Vertex of the target for each vertex of the source.

    Returns
    -------
    float
        Area of faces that keep theirs less that of faces that reverse it, over that of both; -1 to
        1. Faces whose corners are mapped to less than three vertices are left out.
    """
    corners = images[source.mesh.faces]  # (m, 3)
    a, b, c = (target.mesh.vertices[corners[:, i]] for i in range(3))
    normals = target.normals[corners].sum(axis=1)
    turns = np.sign(np.einsum("mi,mi->m", np.cross(b - a, c - a), normals))
    areas = source.mesh.face_areas
    return float((areas * turns).sum() / max(float((areas * np.abs(turns)).sum()), 1e-30))


class _Slopes:
    """Gradients of functions that are linear on each face."""

    def __init__(self, surface: Surface) -> None:
        mesh = surface.mesh
        corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
        self.faces = mesh.faces
        self.areas = mesh.face_areas
        self.normals = unit_vectors(mesh.face_normals)
        opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]  # (m, 3, 3)
        doubled = np.maximum(2.0 * self.areas, np.finfo(np.float64).tiny)
        self.rises = np.cross(self.normals[:, None], opposite) / doubled[:, None, None]

    def of(self, values: FloatArray) -> FloatArray:
        """Gradient on each face (m, 3) of values at the vertices (n,)."""
        slopes: FloatArray = np.einsum("mc,mci->mi", values[self.faces], self.rises)
        return slopes


def _log_heat_kernel(surface: Surface, time: float) -> FloatArray:
    """Logarithm of k_t(x,x) at every vertex, (n,)."""
    spectrum = surface.spectrum
    kernel = np.square(spectrum.eigenvectors) @ np.exp(-time * spectrum.eigenvalues)
    logarithm: FloatArray = np.log(np.maximum(kernel, 0.0) + 1.0 / spectrum.area)
    return logarithm
