"""What a mesh gives to the learning of windows, and such meshes arranged as shapes and copies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.cleaning import clean
from workers.geometry.mesh import TriangleMesh
from workers.geometry.solution import Solver
from workers.geometry.views import View
from workers.retrieval.model import Model, describe
from workers.retrieval.windows.candidates import least
from workers.retrieval.windows.closely import NEAREST
from workers.retrieval.windows.evidence import Evidence, WindowQuery
from workers.retrieval.windows.rows import write_row
from workers.retrieval.windows.signature import (
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.retrieval.windows.whitening import Whitening
from workers.training.bank_shapes import BankShapes
from workers.training.copies import arrange_copies
from workers.training.examples import Variant
from workers.training.window_trust import WindowQueries

Arrays: TypeAlias = Mapping[str, NDArray[Any]]

DESCRIPTOR = "descriptor"
"""Name of the array that every variant has."""

_ROW = "row"


def described_mesh(
    mesh: TriangleMesh, model: Model, *, windows: View | None = None, is_copy: bool = False
) -> Arrays:
    """Descriptor of a mesh and, if they are wanted, its windows.

    Parameters
    ----------
    mesh : TriangleMesh
        Not cleaned yet.
    model : Model
        Under which it is described.
    windows : View, optional
        Under which windows are taken.
    is_copy : bool
        Whether it is searched with: then it has the signature of a query, else a row.

    Returns
    -------
    mapping of str to array
        `WindowShapes.of` reads it.

    Raises
    ------
    ProteusError
        It cannot be solved, described or prepared.
    """
    mesh = clean(mesh).mesh
    solver = Solver(mesh)
    vector = describe({view.name: solver.under(view) for view in model.views}, model)
    found: dict[str, NDArray[Any]] = {DESCRIPTOR: vector}
    if windows is None:
        return found
    surface = window_surface(
        solver.prepared(windows), n_vertices=mesh.n_vertices, for_query=is_copy
    )
    if is_copy:
        return {**found, **query_signature(surface).to_arrays()}
    return {**found, _ROW: np.frombuffer(write_row(stored_signature(surface)), dtype=np.uint8)}


@dataclass(frozen=True, eq=False)
class WindowShapes:
    """Shapes with their rows, and copies with the signatures that they are searched with.

    Attributes
    ----------
    bank : BankShapes
        Descriptors of g shapes and q copies.
    rows : (g, bytes) uint8
        As `write_row` writes them.
    signatures : tuple of q Signature
        Of the copies.
    """

    bank: BankShapes
    rows: NDArray[np.uint8]
    signatures: tuple[Signature, ...]

    @classmethod
    def of(cls, variants: Sequence[Variant], arrays: Sequence[Arrays]) -> "WindowShapes":
        """Arrange variants; copies of a shape that is not there are left out.

        Parameters
        ----------
        variants : sequence of Variant
            Shapes, and copies of them.
        arrays : sequence of mapping
            What `described_mesh` found of each.

        Returns
        -------
        WindowShapes

        Raises
        ------
        InsufficientTrainingDataError
            No copy is left.
        """
        pairs = list(zip(variants, arrays, strict=True))
        there = {one.number for one in variants if one.change is None}
        copies = [a for one, a in pairs if one.change is not None and one.reference in there]
        descriptors = [np.asarray(a[DESCRIPTOR], dtype=np.float32) for a in arrays]
        return cls(
            arrange_copies(variants, descriptors),
            np.array([a[_ROW] for one, a in pairs if one.change is None], dtype=np.uint8),
            tuple(Signature.from_arrays(dict(a)) for a in copies),
        )

    def compared(self, distances: FloatArray, whitening: Whitening) -> WindowQueries:
        """Compare every copy with its candidates, as a search does.

        Parameters
        ----------
        distances : (q, g) float64
            The bank's; infinite to shapes that are not compared.
        whitening : Whitening
            How windows are compared.

        Returns
        -------
        WindowQueries
            Of all copies.
        """
        known = [
            (one, near, self._evidence(one, near, whitening))
            for one, near in zip(self.signatures, distances, strict=True)
        ]
        return WindowQueries.of(known, self.bank.truth.tolist(), self.bank.transformations)

    def fetch(self, rows: IntArray, n_bytes: int) -> NDArray[np.uint8]:
        """Beginnings of rows, as `WindowQuery.evidence` reads them.

        Parameters
        ----------
        rows : (m,) int64
            Places of shapes.
        n_bytes : int
            Of each; 0 for all.

        Returns
        -------
        (m, n_bytes) uint8
        """
        found: NDArray[np.uint8] = self.rows[rows, : n_bytes or None]
        return found

    def _evidence(self, query: Signature, near: FloatArray, whitening: Whitening) -> Evidence:
        there: IntArray = np.flatnonzero(np.isfinite(near))
        nearest = there[least(near[there], NEAREST)]
        return WindowQuery(query, whitening).evidence(nearest, there, self.fetch)
