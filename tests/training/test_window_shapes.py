"""Meshes that windows are learned from: described as a search has them, and arranged."""

import numpy as np
import pytest

from tests.meshes import bumpy_sphere
from tests.retrieval.windows.shapes import PLAIN
from workers.errors import InsufficientTrainingDataError
from workers.geometry.solution import Solver
from workers.geometry.views import default_view, window_view
from workers.retrieval.builtin import shape_dna_model
from workers.retrieval.model import describe
from workers.retrieval.windows.rows import write_row
from workers.retrieval.windows.signature import (
    Signature,
    query_signature,
    stored_signature,
    window_surface,
)
from workers.training.examples import Variant
from workers.training.sources import CreatureSource, Simulation
from workers.training.window_shapes import DESCRIPTOR, Arrays, WindowShapes, described_mesh
from workers.transformations import transform

WINDOWS = window_view(working_vertices=700)
DNA = shape_dna_model(default_view(working_vertices=700))


def variant(number: int, *, of: int | None = None) -> Variant:
    """A shape, or a copy of the shape of a number."""
    change = None if of is None else Simulation("partial", 3, seed=1)
    source = CreatureSource("worm", 1, 2000)
    reference = number if of is None else of
    return Variant(number, str(number), source, "worm", False, reference, change, (), WINDOWS)


def found_of(seed: int, *, is_copy: bool) -> Arrays:
    """A sphere with bumps, or a part of it."""
    mesh = bumpy_sphere(3, seed)
    if is_copy:
        mesh = transform(mesh, "partial", 3, seed=1).mesh
    return described_mesh(mesh, DNA, windows=WINDOWS, is_copy=is_copy)


def test_a_mesh_is_described_as_an_upload_or_a_query_is() -> None:
    mesh = bumpy_sphere(3, 1)
    solver = Solver(mesh)
    vector = describe({DNA.views[0].name: solver.under(DNA.views[0])}, DNA)
    plain, shape, copy = (
        described_mesh(mesh, DNA),
        described_mesh(mesh, DNA, windows=WINDOWS),
        described_mesh(mesh, DNA, windows=WINDOWS, is_copy=True),
    )
    assert all(np.array_equal(one[DESCRIPTOR], vector) for one in (plain, shape, copy))
    assert list(plain) == [DESCRIPTOR]
    working = solver.prepared(WINDOWS)
    stored, asked = (
        window_surface(working, n_vertices=mesh.n_vertices, for_query=for_query)
        for for_query in (False, True)
    )
    assert shape["row"].tobytes() == write_row(stored_signature(stored))
    expected = Signature.from_arrays(query_signature(asked).to_arrays())
    assert np.array_equal(Signature.from_arrays(dict(copy)).numbers, expected.numbers)


def test_copies_are_arranged_with_their_shapes_whatever_is_missing() -> None:
    """Number 2 was never computed, so that its copy counts nothing."""
    variants = [variant(0), variant(1, of=0), variant(3, of=2), variant(4), variant(5, of=4)]
    seeds = (1, 1, 3, 2, 2)
    arrays = [
        found_of(seed, is_copy=one.change is not None)
        for one, seed in zip(variants, seeds, strict=True)
    ]
    shapes = WindowShapes.of(variants, arrays)
    assert shapes.bank.names == ("0", "4")
    assert shapes.bank.truth.tolist() == [0, 1]
    assert [row.tobytes() for row in shapes.rows] == [arrays[i]["row"].tobytes() for i in (0, 3)]
    for signature, place in zip(shapes.signatures, (1, 4), strict=True):
        expected = Signature.from_arrays(dict(arrays[place]))
        assert np.array_equal(signature.numbers, expected.numbers)
    known = shapes.compared(np.ones((2, 2)), PLAIN)
    assert (known.around.min(axis=2).argmin(axis=1) == shapes.bank.truth).all()
    assert known.truth.tolist() == [0, 1]
    with pytest.raises(InsufficientTrainingDataError, match="none of 2 descriptors"):
        WindowShapes.of(variants[2:4], arrays[2:4])
