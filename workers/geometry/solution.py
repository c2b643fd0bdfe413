"""A working mesh with what is computed of it once: its spectrum, and points that stand for it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from workers.errors import InvalidMeshError, SpectrumError
from workers.geometry.arrays import IntArray
from workers.geometry.components import Component, described_components
from workers.geometry.mesh import TriangleMesh
from workers.geometry.preparation import Preparation
from workers.geometry.sampling import SAMPLES, SurfaceSample, sample_surface
from workers.geometry.simplification import TAKEN, simplify
from workers.geometry.spectrum import Spectrum, compute_spectrum
from workers.geometry.views import View

MOST_COARSER = 3  # times that a working mesh is halved where its spectrum cannot be certified
MOST_LOST = 0.5  # of the weight, before a surface of several parts counts as too thin


@dataclass(frozen=True, eq=False)
class Part:
    """One component of a surface of several, with what it stands for.

    Attributes
    ----------
    solution : Solution
        Of this component alone; it has no parts itself.
    weight : float
        How much it counts; the weights of a surface sum to 1.
    copies : float
        Area of all components that it stands for, over its own.
    body : float
        Area of the body that it belongs to, over its own.
    """

    solution: "Solution"
    weight: float
    copies: float
    body: float


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
    parts : tuple of Part
        The components that are described, where there are several; none of a connected surface.
    notes : tuple of str
        What is out of the ordinary in how it was made.
    """

    mesh: TriangleMesh
    spectrum: Spectrum
    samples: Mapping[int, SurfaceSample] = field(default_factory=dict)
    parts: tuple[Part, ...] = ()
    notes: tuple[str, ...] = ()
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
        Of the working mesh. Components are prepared and solved apart. Those that the view leaves
        nothing of are left out, as long as they count for less than half.

    Raises
    ------
    InvalidMeshError
        The shape is too thin for the view.
    SpectrumError
        The eigenpairs could not be certified.
    """
    return Solver(mesh).under(view)


class Solver:
    """Solutions of one cleaned mesh: what its views have in common is done once.

    Parameters
    ----------
    mesh : TriangleMesh
        Clean.
    enter : callable, optional
        Is told the name of each step before it begins: "simplifying" or "spectrum".
    """

    def __init__(self, mesh: TriangleMesh, enter: Callable[[str], None] | None = None) -> None:
        """Nothing is done yet."""
        self._mesh = mesh
        self._enter = enter or _tell_nobody

    @cached_property
    def _components(self) -> list[tuple[Component, Preparation]]:
        """The components that are described, each with what is prepared of it."""
        components = described_components(self._mesh)
        return [(component, Preparation(component.mesh)) for component in components]

    def prepared(self, view: View) -> TriangleMesh:
        """Prepare the mesh as a view says, without a spectrum.

        Parameters
        ----------
        view : View
            How the mesh is prepared.

        Returns
        -------
        TriangleMesh
            The working meshes of all components that the view leaves anything of.

        Raises
        ------
        InvalidMeshError, SpectrumError
            It leaves none.
        """
        self._enter("simplifying")
        if len(self._components) == 1:
            return self._components[0][1].under(view).mesh
        meshes, error = list[TriangleMesh](), None
        for component, preparation in self._components:
            try:
                meshes.append(preparation.under(view.for_share(component.weight)).mesh)
            except (InvalidMeshError, SpectrumError) as caught:
                error = error or caught
        if error and not meshes:
            raise error
        return _joined(meshes)

    def under(self, view: View) -> Solution:
        """Solve the mesh under a view; see `solve`.

        Parameters
        ----------
        view : View
            How the mesh is prepared, and how many eigenpairs are computed.

        Returns
        -------
        Solution
            The same as if no other view had been solved before.
        """
        if len(self._components) == 1:
            return _solve_connected(self._components[0][1], view, self._enter)
        parts: list[Part] = []
        lost, error = 0.0, None
        for component, preparation in self._components:
            own = view.for_share(component.weight)
            try:
                solution = _solve_connected(preparation, own, self._enter)
            except (InvalidMeshError, SpectrumError) as caught:
                lost, error = lost + component.weight, error or caught
            else:
                parts.append(Part(solution, component.weight, component.copies, component.body))
        if error and lost >= MOST_LOST:
            raise error
        found = [replace(part, weight=part.weight / (1.0 - lost)) for part in parts]
        return united(found)


def _joined(meshes: Sequence[TriangleMesh]) -> TriangleMesh:
    """One mesh of several, their vertices one after the other."""
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return TriangleMesh(np.concatenate([m.vertices for m in meshes]), np.concatenate(faces))


def united(parts: Sequence[Part]) -> Solution:
    """The solution of a surface of several components.

    Parameters
    ----------
    parts : sequence of Part
        Its components, at least one.

    Returns
    -------
    Solution
        Its mesh has the parts' meshes one after the other. Its spectrum has the smallest
        eigenvalues of all, as many as the part with the most of them.
    """
    meshes = [part.solution.mesh for part in parts]
    spectra = [part.solution.spectrum for part in parts]
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    mesh = _joined(meshes)
    values = np.concatenate([spectrum.eigenvalues for spectrum in spectra])
    owners = np.repeat(np.arange(len(spectra)), [s.n_eigenpairs for s in spectra])
    columns = np.concatenate([np.arange(s.n_eigenpairs) for s in spectra])
    count = max(spectrum.n_eigenpairs for spectrum in spectra)
    chosen = np.argsort(values, kind="stable")[:count]  # (k,)
    eigenvectors = np.zeros((mesh.n_vertices, count))
    for i, spectrum in enumerate(spectra):
        mine = np.flatnonzero(owners[chosen] == i)
        rows = slice(starts[i], starts[i + 1])
        eigenvectors[rows, mine] = spectrum.eigenvectors[:, columns[chosen[mine]]]
    areas = np.concatenate([spectrum.areas for spectrum in spectra])
    spectrum = Spectrum(values[chosen], eigenvectors, areas, float(areas.sum()))
    notes = dict.fromkeys(note for part in parts for note in part.solution.notes)
    return Solution(mesh, spectrum, parts=tuple(parts), notes=tuple(notes))


def _tell_nobody(_step: str) -> None:
    """Steps are of no interest."""


def _solve_connected(
    preparation: Preparation, view: View, enter: Callable[[str], None] = _tell_nobody
) -> Solution:
    """Solution of one component; where it cannot be certified, of a coarser working mesh."""
    enter("simplifying")
    prepared = preparation.under(view)
    working = prepared.mesh
    notes = tuple(note for note in prepared.notes if TAKEN in note)
    enter("spectrum")
    for tried in range(MOST_COARSER + 1):
        try:
            spectrum = compute_spectrum(working, n_eigenpairs=view.eigenpairs)
        except SpectrumError:
            coarser = simplify(working, vertices=working.n_vertices // 2).mesh
            if tried == MOST_COARSER or coarser.n_vertices == working.n_vertices:
                raise
            working = coarser
        else:
            if tried:
                notes = (*notes, _coarser(prepared.mesh, working))
            return Solution(working, spectrum, notes=notes)
    raise AssertionError("the last try returns or raises")


def _coarser(prepared: TriangleMesh, solved: TriangleMesh) -> str:
    """What is said of a mesh that was solved instead of a finer one."""
    return (
        f"solved with {solved.n_vertices:,} vertices instead of {prepared.n_vertices:,}, whose "
        "eigenpairs could not be certified"
    )
