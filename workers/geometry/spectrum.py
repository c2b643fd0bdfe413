"""The Laplace-Beltrami spectrum of a mesh, of one component or several."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray, read_only
from workers.geometry.eigensolver import smallest_eigenpairs
from workers.geometry.laplacian import Laplacian, mesh_laplacian
from workers.geometry.mesh import TriangleMesh

SOLVER_VERSION = "3"
"""Part of every key under which a spectrum is stored: raised when results change."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Nonzero eigenpairs of W φ = λ A φ in the mesh's own unit; arrays are read-only.

    Attributes
    ----------
    eigenvalues : (k,) float64
        Ascending, positive, in 1/area; every zero (one a component) is dropped.
    eigenvectors : (n, k) float64
        Area-orthonormal: ``eigenvectors.T @ (areas * eigenvectors) = I``; in 1/length.
    areas : (n,) float64
        Lumped area of each vertex.
    area : float
        Surface area, the sum of ``areas``.
    """

    eigenvalues: FloatArray
    eigenvectors: FloatArray
    areas: FloatArray
    area: float

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("eigenvalues", "eigenvectors", "areas"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def n_eigenpairs(self) -> int:
        """Number of eigenpairs, k."""
        return len(self.eigenvalues)

    def rescaled(self, length_factor: float) -> "Spectrum":
        """The spectrum of the surface with all lengths multiplied by a factor.

        Parameters
        ----------
        length_factor : float
            s > 0: λ becomes λ/s², φ becomes φ/s, areas become s² times as large.

        Returns
        -------
        Spectrum
            Of the scaled surface.

        Raises
        ------
        InvalidRequestError
            The factor is not a number above 0.
        """
        if not (np.isfinite(length_factor) and length_factor > 0.0):
            raise InvalidRequestError(f"length factor is {length_factor}, expected a number > 0")
        return Spectrum(
            eigenvalues=self.eigenvalues / length_factor**2,
            eigenvectors=self.eigenvectors / length_factor,
            areas=self.areas * length_factor**2,
            area=self.area * length_factor**2,
        )


def compute_spectrum(mesh: TriangleMesh, *, n_eigenpairs: int = 100) -> Spectrum:
    """Smallest nonzero eigenpairs of the Laplace-Beltrami operator, eqs. (8), (9).

    Components are solved apart, so that equal ones cannot hide each other's eigenvalues. Then they
    are merged: the result is the k smallest of the union, each component certified up to there.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean: no zero-area face, no unreferenced vertex; any unit, open or closed.
    n_eigenpairs : int
        k >= 1; all there are (n minus the number of components) where that is fewer.

    Returns
    -------
    Spectrum

    Raises
    ------
    InvalidMeshError
        A face has no area, a number is not finite, or a vertex belongs to no face.
    SpectrumError
        A component's eigenpairs could not be certified.
    """
    if n_eigenpairs < 1:
        raise InvalidRequestError(f"{n_eigenpairs} eigenpairs asked for, expected at least 1")
    laplacian = mesh_laplacian(mesh)
    return laplacian_spectrum(laplacian, n_eigenpairs=n_eigenpairs)


def laplacian_spectrum(laplacian: Laplacian, *, n_eigenpairs: int) -> Spectrum:
    """`compute_spectrum` of an operator; its components are those of the stiffness matrix.

    Parameters
    ----------
    laplacian : Laplacian
        W and A of eq. (8).
    n_eigenpairs : int
        k >= 1; all there are where that is fewer.

    Returns
    -------
    Spectrum
        k nonzero eigenpairs.

    Raises
    ------
    SpectrumError
        A component's eigenpairs could not be certified.
    """
    areas = laplacian.areas
    parts = [_Component(laplacian, vertices) for vertices in _components(laplacian.stiffness)]
    available = len(areas) - len(parts)
    count = min(n_eigenpairs, available)
    if count == 0:
        return Spectrum(np.empty(0), np.empty((len(areas), 0)), areas, float(areas.sum()))
    if len(parts) == 1:
        parts[0].grow(count)
        return Spectrum(parts[0].eigenvalues, parts[0].eigenvectors, areas, float(areas.sum()))
    _grow_until_merged(parts, count, float(areas.sum()))
    values = np.concatenate([part.eigenvalues for part in parts])
    owners = np.repeat(np.arange(len(parts)), [len(part.eigenvalues) for part in parts])
    columns = np.concatenate([np.arange(len(part.eigenvalues)) for part in parts])
    eigenvectors = np.zeros((len(areas), count))
    chosen = np.argsort(values, kind="stable")[:count]  # (k,)
    for i, part in enumerate(parts):
        mine = np.flatnonzero(owners[chosen] == i)
        eigenvectors[np.ix_(part.vertices, mine)] = part.eigenvectors[:, columns[chosen[mine]]]
    return Spectrum(values[chosen], eigenvectors, areas, float(areas.sum()))


def first_eigenvalues(mesh: TriangleMesh, count: int) -> FloatArray:
    """The smallest nonzero eigenvalues.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    count : int
        How many; fewer where there are fewer.

    Returns
    -------
    (count,) float64
        Ascending, in 1/area.
    """
    return compute_spectrum(mesh, n_eigenpairs=count).eigenvalues


def eigenfunction(spectrum: Spectrum, number: int) -> FloatArray:
    """One eigenfunction, with the sign that the mesh decides and not the solver.

    It is positive at the first vertex where it is at least half as large as anywhere. The largest
    value itself would not do: a symmetric surface has it twice, with both signs.

    Parameters
    ----------
    spectrum : Spectrum
        k nonzero eigenpairs at n vertices.
    number : int
        1 for the first nonzero eigenvalue.

    Returns
    -------
    (n,) float64
        In 1/length of the mesh's unit.

    Raises
    ------
    InvalidRequestError
        There is none of this number.
    """
    count = spectrum.n_eigenpairs
    if not 1 <= number <= count:
        raise InvalidRequestError(
            f"there is no eigenfunction {number}: this mesh has {count} of them, from 1 on"
        )
    values = spectrum.eigenvectors[:, number - 1]
    sizes = np.abs(values)
    first = np.argmax(sizes >= 0.5 * sizes.max())
    signed: FloatArray = values * np.sign(values[first])
    return signed


class _Component:
    """One connected component and what is known of its spectrum so far."""

    def __init__(self, laplacian: Laplacian, vertices: IntArray) -> None:
        """Cut the component out of the operator."""
        self.vertices = vertices
        self.areas = laplacian.areas[vertices]
        self.area = float(self.areas.sum())
        self.stiffness = sparse.csc_array(laplacian.stiffness[vertices][:, vertices])
        self.eigenvalues: FloatArray = np.empty(0)
        self.eigenvectors: FloatArray = np.empty((len(vertices), 0))

    @property
    def available(self) -> int:
        """Number of nonzero eigenvalues there are."""
        return len(self.vertices) - 1

    def grow(self, count: int) -> None:
        """Compute the ``count`` smallest eigenpairs."""
        self.eigenvalues, self.eigenvectors = smallest_eigenpairs(self.stiffness, self.areas, count)


def _components(stiffness: sparse.csc_array) -> list[IntArray]:
    """Vertices of each connected component, ordered by their first vertex."""
    count, labels = connected_components(stiffness, directed=False)
    if count == 1:
        return [np.arange(len(labels))]
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.cumsum(np.bincount(labels))[:-1])


def _grow_until_merged(parts: list[_Component], count: int, area: float) -> None:
    """Solve each component until none can hide one of the ``count`` smallest of the union.

    Weyl's law allots by area; a component that does not reach past the merged k-th eigenvalue is
    solved again for more.
    """
    for part in parts:
        share = int(np.ceil(1.05 * count * part.area / area)) + 2
        part.grow(min(share, count, part.available))
    while True:
        values = np.sort(np.concatenate([part.eigenvalues for part in parts]))
        limit = values[count - 1] if len(values) >= count else np.inf
        short = [
            part
            for part in parts
            if len(part.eigenvalues) < min(count, part.available) and part.eigenvalues[-1] < limit
        ]
        if not short:
            return
        for part in short:
            have = len(part.eigenvalues)
            reach = min(limit / part.eigenvalues[-1], 4.0)
            part.grow(min(int(np.ceil(1.1 * have * reach)) + 2, count, part.available))
