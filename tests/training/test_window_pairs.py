"""Windows of corresponding points: alike where nothing changed, left out where all was cut off."""

from functools import lru_cache

import numpy as np
import pytest

from tests.meshes import bumpy_sphere, renumbered, rotated
from workers.creatures import Creature, make_creature
from workers.errors import InvalidMeshError
from workers.geometry.mesh import TriangleMesh
from workers.geometry.views import View, window_view
from workers.retrieval.windows.signature import KINDS, LOST, STORED_POINTS, WHOLE
from workers.retrieval.windows.whitening import learn_whitening
from workers.training import window_pairs as module
from workers.training.sources import CreatureSource, StoredSource, load_creature
from workers.training.window_pairs import (
    COPIES,
    WindowPairs,
    creature_pairs,
    fine_vertices,
    mesh_pairs,
    paired_points,
    window_pairs,
)
from workers.transformations import transform

AS_IT_IS = View("plain", ())
SMALL = window_view(working_vertices=700)


@lru_cache(maxsize=1)
def cow() -> Creature:
    return make_creature("cow", seed=1, vertices=2000)


def test_a_copy_that_is_the_same_has_no_differences() -> None:
    mesh = bumpy_sphere(3, 1)
    found = window_pairs(mesh, mesh, np.arange(mesh.n_vertices), AS_IT_IS)
    assert found.differences.shape == (STORED_POINTS, KINDS, 7)
    assert not found.differences.any()
    assert (found.one == WHOLE).all()
    assert (found.other == WHOLE).all()


def test_points_correspond_by_their_origin_whatever_the_place_and_number() -> None:
    """A copy may lie anywhere and have its vertices in any order."""
    rng = np.random.default_rng(1)
    mesh = bumpy_sphere(3, 1)
    copy, order = renumbered(rotated(mesh, rng), rng)
    found = window_pairs(mesh, copy, order, AS_IT_IS)
    assert len(found.differences) == STORED_POINTS
    assert np.abs(found.differences).max() < 1e-4
    shuffled = window_pairs(mesh, copy, rng.permutation(order), AS_IT_IS)
    assert np.abs(shuffled.differences).mean() > 0.01


def test_a_posed_copy_that_is_meshed_otherwise_differs_a_little() -> None:
    creature = cow()
    posed = creature.posed(3)
    origin = np.arange(posed.n_vertices)
    same = window_pairs(creature.rest, posed, origin, SMALL)
    wrong = window_pairs(creature.rest, posed, origin[::-1].copy(), SMALL)
    assert len(same.differences) > 0.75 * STORED_POINTS  # other vertices lie a little aside
    own, other = (np.median(np.abs(one.differences), axis=0) for one in (same, wrong))
    assert (own < 0.7 * other).mean() > 0.9
    assert (own > 0.0).all()


def test_points_that_were_cut_off_are_left_out() -> None:
    """And windows that the cut reaches are known as cut or lost."""
    mesh = bumpy_sphere(3, 2)
    cut = transform(mesh, "partial", 3, seed=2)
    found = window_pairs(mesh, cut.mesh, cut.origin, AS_IT_IS)
    share = cut.mesh.n_vertices / mesh.n_vertices
    assert len(found.differences) == pytest.approx(share * STORED_POINTS, rel=0.1)
    assert (found.one == WHOLE).all()
    assert (found.other != WHOLE).any()
    whole = found.other == WHOLE
    lost = found.other == LOST
    assert np.abs(found.differences[whole]).max() < 0.03  # a mean, and paths around the cut
    assert np.abs(found.differences[lost]).max() > 0.3


def test_a_copy_of_which_nothing_corresponds_has_no_pairs() -> None:
    mesh = bumpy_sphere(2, 1)
    nowhere = np.empty(0, dtype=np.int64)
    found = window_pairs(mesh, mesh, nowhere, AS_IT_IS)
    assert found.differences.shape == (0, KINDS, 7)
    assert found.one.shape == found.other.shape == (0, KINDS)


def test_pairs_of_a_creature_teach_a_whitening() -> None:
    """The same for the same draws."""
    one, other = (creature_pairs(cow(), SMALL, rng=np.random.default_rng(1)) for _ in range(2))
    assert np.array_equal(one.differences, other.differences)
    assert 0.3 * len(COPIES) * STORED_POINTS < len(one.differences)
    assert len(one.differences) < len(COPIES) * STORED_POINTS
    whitening = learn_whitening(one.differences, one.one, one.other)
    assert np.isfinite(whitening.whole).all()
    spread = np.std(one.differences[:, 0] @ whitening.whole[0], axis=0)
    assert (spread > 0.5).all()


@pytest.mark.parametrize("subdivisions", [2, 4, 5])  # 162, 2,562 and 10,242 vertices
def test_a_mesh_without_poses_is_bent_whatever_size_it_has(subdivisions: int) -> None:
    mesh = bumpy_sphere(subdivisions, 1)
    one, other = (mesh_pairs(mesh, SMALL, rng=np.random.default_rng(1)) for _ in range(2))
    assert np.array_equal(one.differences, other.differences)
    assert 0.3 * len(COPIES) * STORED_POINTS < len(one.differences)
    assert np.median(np.abs(one.differences)) > 1e-3  # meshed otherwise, even where nothing moved


def test_shapes_are_finer_than_their_working_meshes() -> None:
    assert fine_vertices(window_view()) == 14_000
    assert fine_vertices(window_view(working_vertices=100)) == 2_000
    assert fine_vertices(window_view(working_vertices=10_000)) == 20_000


def test_the_source_decides_what_is_drawn() -> None:
    creature = CreatureSource("cow", 1, 2000, uneven=True)
    even = CreatureSource("cow", 1, fine_vertices(SMALL))
    mesh = load_creature(creature).rest
    one, same = (paired_points(source, mesh, SMALL) for source in (creature, creature))
    assert np.array_equal(one.differences, same.differences)
    rng = np.random.default_rng(5)
    assert len(one.differences) == pytest.approx(
        len(creature_pairs(load_creature(even), SMALL, rng=rng).differences), rel=0.1
    )
    stored, other = (
        paired_points(StoredSource(digest * 64, "cow.off"), mesh, SMALL) for digest in "ab"
    )
    assert len(stored.differences) > 0.3 * len(COPIES) * STORED_POINTS
    assert not np.array_equal(stored.differences[:100], other.differences[:100])


def test_a_copy_that_leaves_no_mesh_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail_one(shape: TriangleMesh, copy: TriangleMesh, *rest: object) -> WindowPairs:
        if copy.area < 0.5 * shape.area:  # of the strength 5
            raise InvalidMeshError("it is too thin")
        return window_pairs(shape, copy, *rest)  # type: ignore[arg-type]

    every = creature_pairs(cow(), SMALL, rng=np.random.default_rng(1))
    monkeypatch.setattr(module, "window_pairs", fail_one)
    fewer = creature_pairs(cow(), SMALL, rng=np.random.default_rng(1))
    assert 0 < len(fewer.differences) < len(every.differences)
    assert np.array_equal(every.differences[: len(fewer.differences)], fewer.differences)


def test_pairs_of_none_are_none() -> None:
    none = WindowPairs.joined([])
    assert none.differences.shape == (0, KINDS, 7)
    pairs = creature_pairs(cow(), SMALL, rng=np.random.default_rng(1))
    again = WindowPairs.from_arrays({**pairs.to_arrays(), "descriptor": np.zeros(3)})
    both = WindowPairs.joined([again, none])
    assert np.array_equal(both.differences, pairs.differences)
    assert np.array_equal(both.other, pairs.other)
