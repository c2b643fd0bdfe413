"""A working mesh with what is computed of it once: its spectrum, and points that stand for it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from workers.geometry.arrays import IntArray
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import View, prepare
from workers.geometry.sampling import SAMPLES, SurfaceSample, sample_surface
from workers.geometry.spectrum import Spectrum, compute_spectrum


@dataclass(frozen=True, eq=False)
class Solution:
    """All that descriptors are made from.

    Attributes
    ----------
    mesh : TriangleMesh
        The working mesh of a view.
    spectrum : Spectrum
        Of this mesh, in its own unit.
    samples : Mapping
        What `sample_surface` gave, by the number of points, as far as it was asked for.
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    samples: Mapping[int, SurfaceSample] = field(default_factory=dict)
    _drawn: dict[int, SurfaceSample] = field(default_factory=dict, init=False, repr=False)

    def sample(self, count: int = SAMPLES) -> SurfaceSample:
        """Points that stand for the surface, computed where they are not there yet.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        SurfaceSample
            The same one each time.
        """
        if count in self.samples:
            return self.samples[count]
        if count not in self._drawn:
            self._drawn[count] = sample_surface(self.mesh, self.spectrum, count=count)
        return self._drawn[count]

    def farthest_points(self, count: int) -> IntArray:
        """Vertices of a sample: the first ones of any larger one.

        Parameters
        ----------
        count : int
            How many; all n vertices where there are fewer.

        Returns
        -------
        (count,) int64
            Vertex indices, in the order in which they were taken.
        """
        if count < self.mesh.n_vertices:
            for drawn in self.samples.values():
                if len(drawn.indices) >= count:
                    return drawn.indices[:count]
        return self.sample(count).indices


def solve(mesh: TriangleMesh, view: View) -> Solution:
    """Prepare a cleaned mesh as a view says, and compute its spectrum; no sample is taken yet.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    view : View
        How the mesh is prepared, and how many eigenpairs are computed.

    Returns
    -------
    Solution
        Of the working mesh.

    Raises
    ------
    SpectrumError
        The eigenpairs could not be certified.
    """
    working = prepare(mesh, view).mesh
    return Solution(working, compute_spectrum(working, n_eigenpairs=view.eigenpairs))
