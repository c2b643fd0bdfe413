"""From a scan's distances to those of all evidence: parts find their wholes, in any order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.retrieval.windows.shapes import EVEN, PLAIN, asked, asked_bumpy, stored, stored_bumpy
from workers.creatures import TRAINING_SPECIES, make_creature
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray, IntArray
from workers.geometry.views import window_view
from workers.retrieval.windows import candidates, closely, evidence
from workers.retrieval.windows.closely import AUTO, PART, PART_BOUNDARY, WHOLE, compare_closely
from workers.retrieval.windows.evidence import WindowQuery
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.rows import PREFIX_BYTES, ROW_BYTES, write_row
from workers.retrieval.windows.signature import LOST, Signature
from workers.retrieval.windows.trust import NOT_VERIFIED
from workers.transformations import transform

SPECIES = TRAINING_SPECIES[::2]
MATCHING = WindowMatching(window_view(), PLAIN, EVEN)
DISTRUSTING = replace(EVEN, distance=(-3.0, 0, 0, 0), windows=(8.0, 0, 0, 0))
WITHOUT_DISTANCE = replace(MATCHING, trust=DISTRUSTING)


@dataclass(frozen=True)
class Gallery:
    """Rows of shapes; of each read it is noted how many rows and bytes were asked for."""

    rows: NDArray[np.uint8]
    has_one: NDArray[np.bool_]
    reads: list[tuple[int, int]]

    @classmethod
    def of(cls, rows: Sequence[bytes], has_one: Sequence[bool] | None = None) -> "Gallery":
        matrix = np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(-1, ROW_BYTES)
        known = np.ones(len(rows), np.bool_) if has_one is None else np.array(has_one, np.bool_)
        return cls(matrix, known, [])

    def rows_of(self, places: IntArray) -> IntArray:
        return np.where(self.has_one[places], places, -1)

    def fetch(self, places: IntArray, n_bytes: int) -> NDArray[np.uint8]:
        self.reads.append((len(places), n_bytes))
        found: NDArray[np.uint8] = self.rows[places, : n_bytes or None]
        return found

    def ask(
        self,
        query: Signature,
        distances: FloatArray,
        *,
        match: str = AUTO,
        matching: WindowMatching = MATCHING,
        nearer: Callable[[IntArray], FloatArray] | None = None,
    ) -> tuple[FloatArray, int]:
        return compare_closely(
            query, matching, distances, self.rows_of, self.fetch, match=match, nearer=nearer
        )


@lru_cache(maxsize=1)
def zoo() -> tuple[bytes, ...]:
    """Rows of 11 creatures, another species each, and of ten spheres with bumps."""
    meshes = [make_creature(one, seed=1, vertices=2000).rest for one in SPECIES]
    shapes = [stored(mesh) for mesh in meshes] + [stored_bumpy(n) for n in range(10)]
    return tuple(write_row(shape) for shape in shapes)


@lru_cache(maxsize=1)
def balls() -> tuple[bytes, ...]:
    """Rows of nine spheres with bumps."""
    return tuple(write_row(stored_bumpy(n)) for n in range(9))


@pytest.mark.parametrize("species", ["cow", "scorpion"])
def test_a_part_finds_its_whole_first_though_distances_say_nothing(species: str) -> None:
    """Posed and cut to about the half of the surface; distances are random."""
    creature = make_creature(species, seed=1, vertices=2000)
    cut = transform(creature.posed(3), "partial", 3, seed=2).mesh
    assert cut.area < 0.8 * creature.rest.area
    own = SPECIES.index(species)
    random = np.random.default_rng(7).uniform(0.0, 1.0, len(zoo()))
    random[own] = random.max()
    found, count = Gallery.of(zoo()).ask(asked(cut), random, matching=WITHOUT_DISTANCE)
    assert count == len(zoo()) == 21
    assert found.argmin() == own


def test_the_scale_of_a_part_is_that_of_its_area() -> None:
    """Both have the area 1: a part of half of it is √2 times as large as on the whole."""
    creature = make_creature("cow", seed=1, vertices=2000)
    cut = transform(creature.rest, "partial", 3, seed=2).mesh
    share = np.sqrt(cut.area / creature.rest.area)
    gallery = Gallery.of(zoo())
    all_places = np.arange(len(zoo()))
    known = WindowQuery(asked(cut), PLAIN).evidence(all_places, all_places, gallery.fetch)
    own = SPECIES.index("cow")
    assert known.scales[own] == pytest.approx(share, rel=0.05)  # ways by near points are longer
    assert known.log_consistency.argmax() == own
    assert (known.all_around + known.facing).min(axis=1).argmin() == own


def test_the_scale_is_that_of_the_hypothesis_and_what_fits_the_distances() -> None:
    gallery, one = Gallery.of(balls()), np.array([1])
    query = asked_bumpy(1)
    shrunk = replace(query, mutual=query.mutual / np.float32(1.03))
    scales = [
        WindowQuery(asked_as, PLAIN).evidence(one, one, gallery.fetch).scales[0]
        for asked_as in (query, shrunk)
    ]
    assert scales[0] == pytest.approx(1.0, abs=0.005)
    assert scales[1] == pytest.approx(1.03 * scales[0], abs=0.005)


def test_points_of_which_no_window_counts_are_not_what_is_verified() -> None:
    """As on a sheet, whose first points lie on its rim: here the first 80 of 128 are lost."""
    query = asked_bumpy(1)
    lost = query.reaches.copy()
    lost[:, :80] = LOST
    gallery, places = Gallery.of(balls()), np.arange(9)
    query = replace(query, reaches=lost)
    found = WindowQuery(query, PLAIN).evidence(places, places, gallery.fetch)
    assert found.log_consistency.argmax() == 1
    assert found.log_consistency[1] > -0.5
    order = np.random.default_rng(0).permutation(80)  # of those that do not count
    order = np.concatenate([np.arange(80, 128), order])
    again = replace(
        query,
        numbers=query.numbers[:, order],
        reaches=query.reaches[:, order],
        areas=query.areas[order],
        mutual=query.mutual[np.ix_(order, order)],
    )
    same = WindowQuery(again, PLAIN).evidence(places, places, gallery.fetch)
    assert_allclose(same.all_around, found.all_around, rtol=1e-6)


def test_a_shape_finds_itself_first_and_almost_at_no_distance() -> None:
    far = np.full(9, 0.5)
    found, count = Gallery.of(balls()).ask(asked_bumpy(4), far)
    assert count == 9
    assert found.argmin() == 4
    weights = EVEN.weights(asked_bumpy(4))
    least = weights.fused(np.array([0.5]), np.array([0.0]), np.array([0.0]))[0]
    assert least < found[4] < least + 0.2


def test_the_order_of_the_gallery_does_not_matter_to_the_last_bit() -> None:
    rng = np.random.default_rng(3)
    distances = rng.uniform(0.2, 0.6, 21)
    query = asked_bumpy(1)
    rows = [*balls(), *zoo()[:12]]
    expected, count = Gallery.of(rows).ask(query, distances)
    for _ in range(3):
        order = rng.permutation(21)
        found, again = Gallery.of([rows[i] for i in order]).ask(query, distances[order])
        assert_array_equal(found, expected[order])
        assert again == count


def test_signatures_may_be_stored_in_another_order_than_shapes_are_searched() -> None:
    """And there may be more of them than candidates."""
    query, distances = asked_bumpy(1), np.linspace(0.2, 0.6, 9)
    expected, _ = Gallery.of(balls(), [True] * 7 + [False] * 2).ask(query, distances)
    order = np.random.default_rng(5).permutation(12)
    stored_at = np.argsort(order)
    other = Gallery.of([(*balls(), *zoo()[:3])[i] for i in order])
    found, count = compare_closely(
        query,
        MATCHING,
        distances,
        lambda places: np.where(places < 7, stored_at[places], -1),
        other.fetch,
    )
    assert count == 7
    assert_array_equal(found, expected)


def test_twins_have_the_same_distance_though_only_few_are_verified(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those level with the last one count, too: neither place nor number decides."""
    monkeypatch.setattr(closely, "NEAREST", 1)
    monkeypatch.setattr(candidates, "CANDIDATES", 2)
    monkeypatch.setattr(evidence, "VERIFIED", 2)
    rng = np.random.default_rng(4)
    rows = [*balls()[:5], *[balls()[1]] * 4]
    distances = np.array([0.1, *[0.4] * 8])
    expected, count = Gallery.of(rows).ask(asked_bumpy(1), distances)
    assert count == 6  # the nearest and five twins
    assert len(set(expected[[1, 5, 6, 7, 8]].tolist())) == 1
    order = rng.permutation(9)
    found, _ = Gallery.of([rows[i] for i in order]).ask(asked_bumpy(1), distances[order])
    assert_array_equal(found, expected[order])


def test_what_is_known_of_a_candidate_does_not_depend_on_the_others() -> None:
    query = WindowQuery(asked_bumpy(1), PLAIN)
    gallery = Gallery.of(balls())
    together = query.evidence(np.arange(9), np.arange(9), gallery.fetch)
    for place in range(9):
        alone = query.evidence(np.array([place]), np.empty(0, np.int64), gallery.fetch)
        assert alone.places.tolist() == [place]
        assert_array_equal(alone.all_around[0], together.all_around[place])
        assert_array_equal(alone.facing[0], together.facing[place])
        assert alone.log_consistency[0] == together.log_consistency[place]
        assert alone.scales[0] == together.scales[place]


def test_an_empty_gallery_and_one_without_signatures_are_searched_all_the_same() -> None:
    query = asked_bumpy(1)
    found, count = Gallery.of([]).ask(query, np.empty(0))
    assert (len(found), count) == (0, 0)
    distances = np.array([0.3, 0.1, 0.2])
    nobody = Gallery.of(balls()[:3], [False] * 3)
    found, count = nobody.ask(query, distances)
    assert count == 0
    assert nobody.reads == []
    assert_array_equal(np.argsort(found), np.argsort(distances))
    assert_array_equal(found, EVEN.weights(query).from_distance(distances))
    found, _ = nobody.ask(query, np.zeros(3))
    assert_array_equal(found, 0.0)  # an equal shape stays equal


def test_a_shape_without_a_signature_has_its_distance_alone() -> None:
    has_one = [True, False] * 4 + [True]
    distances = np.linspace(0.2, 0.6, 9)
    all_found, _ = Gallery.of(balls()).ask(asked_bumpy(2), distances)
    found, count = Gallery.of(balls(), has_one).ask(asked_bumpy(2), distances)
    assert count == 5
    assert_array_equal(found[::2], all_found[::2])
    assert_array_equal(found[1::2], EVEN.weights(asked_bumpy(2)).from_distance(distances[1::2]))


def test_a_whole_is_compared_at_its_own_scale_and_a_part_trusted_as_one() -> None:
    gallery, distances = Gallery.of(balls()), np.linspace(0.2, 0.6, 9)
    trust = replace(EVEN, distance=(3.0, -4.0, 0.0, 0.0))
    matching = replace(MATCHING, trust=trust)
    query = asked_bumpy(1)
    own_scale = replace(query, numbers=query.numbers[:1], reaches=query.reaches[:1])
    longer = replace(query, boundary=PART_BOUNDARY)
    cut_off = replace(query, boundary=5.0)
    for asked_as, match, same_as in (
        (query, WHOLE, own_scale),
        (query, PART, longer),
        (cut_off, PART, cut_off),
        (longer, WHOLE, replace(own_scale, boundary=PART_BOUNDARY)),
    ):
        found, count = gallery.ask(asked_as, distances, match=match, matching=matching)
        expected, _ = gallery.ask(same_as, distances, matching=matching)
        assert_array_equal(found, expected)
        assert count == 9
    as_it_is, _ = gallery.ask(query, distances, matching=matching)
    as_part, _ = gallery.ask(query, distances, match=PART, matching=matching)
    assert not np.array_equal(as_it_is, as_part)


def test_the_nearest_and_those_with_like_windows_are_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two by distance and two by windows; only beginnings of rows are read of the others."""
    monkeypatch.setattr(closely, "NEAREST", 2)
    monkeypatch.setattr(candidates, "CANDIDATES", 2)
    monkeypatch.setattr(evidence, "VERIFIED", 1)
    distances = np.array([0.5, 0.6, 0.7, 0.1, 0.9, 0.2, 0.4, 0.9, 0.8])
    gallery = Gallery.of(balls())
    found, count = gallery.ask(asked_bumpy(7), distances)
    assert 2 <= count <= 4
    by_distance_alone = EVEN.weights(asked_bumpy(7)).fused(
        distances, np.full(9, np.inf), np.full(9, NOT_VERIFIED)
    )
    compared = np.flatnonzero(found != by_distance_alone)
    assert {3, 5, 7} <= set(compared.tolist())
    assert len(compared) == count
    assert gallery.reads == [(9, PREFIX_BYTES), (count, 0), (1, 0)]


def test_of_many_those_that_are_best_at_a_glance_are_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(candidates, "LOOKED_AT", 3)
    monkeypatch.setattr(closely, "NEAREST", 1)
    monkeypatch.setattr(candidates, "CANDIDATES", 1)
    distances = np.array([0.1, *([0.5] * 8)])
    gallery = Gallery.of(balls())
    found, count = gallery.ask(asked_bumpy(7), distances, matching=WITHOUT_DISTANCE)
    assert found.argmin() == 7
    assert gallery.reads[:2] == [(9, PREFIX_BYTES), (4, PREFIX_BYTES)]
    assert count == 2


def test_a_candidate_beyond_the_nearest_has_its_own_distance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A scan takes what is not among the nearest for farther than it is."""
    monkeypatch.setattr(closely, "NEAREST", 2)
    monkeypatch.setattr(candidates, "CANDIDATES", 2)
    scanned = np.array([0.1, 0.2, *([5.0] * 7)])
    own = np.linspace(0.1, 0.9, 9)
    asked_for: list[list[int]] = []

    def nearer(places: IntArray) -> FloatArray:
        asked_for.append(places.tolist())
        return own[places]

    gallery = Gallery.of(balls())
    found, count = gallery.ask(asked_bumpy(7), scanned, nearer=nearer)
    (places,) = asked_for
    assert places == sorted(places)
    assert {0, 1, 7} <= set(places)
    assert len(places) == count
    before, _ = gallery.ask(asked_bumpy(7), np.where(np.isin(np.arange(9), places), own, scanned))
    assert_array_equal(found, before)


def test_only_the_nearest_thousands_are_glanced_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those level with the last of them, too: the order of a gallery does not matter."""
    monkeypatch.setattr(closely, "MOST_GLANCED_AT", 3)
    distances = np.array([0.5, 0.1, 0.2, 0.2, 0.2, 0.9, 0.9, 0.9, 0.9])
    gallery = Gallery.of(balls())
    _, count = gallery.ask(asked_bumpy(7), distances)
    assert gallery.reads[0] == (4, PREFIX_BYTES)
    assert count == 4


def test_a_query_of_which_nothing_counts_is_ranked_by_distance() -> None:
    query = asked_bumpy(1)
    blind = replace(query, reaches=np.full_like(query.reaches, LOST))
    distances = np.linspace(0.6, 0.2, 9)
    found, _ = Gallery.of(balls()).ask(blind, distances)
    assert_array_equal(np.argsort(found), np.argsort(distances))
    nearest_alone = Gallery.of(balls())
    known = WindowQuery(blind, PLAIN).evidence(np.array([3]), np.arange(9), nearest_alone.fetch)
    assert known.places.tolist() == [3]


@pytest.mark.parametrize("facing", [-800.0, 0.0, 800.0])
def test_the_share_of_windows_that_face_the_same_way_may_be_all_or_none(facing: float) -> None:
    trust = replace(EVEN, facing=(facing, 0.0))
    gallery = Gallery.of(balls())
    found, _ = gallery.ask(asked_bumpy(1), np.full(9, 0.5), matching=replace(MATCHING, trust=trust))
    assert np.isfinite(found).all()
    assert found.argmin() == 1


def test_a_matching_goes_through_json_and_anything_else_is_refused() -> None:
    matching = replace(MATCHING, impostor_quantiles=(0.1, 0.25))
    value = matching.to_json()
    found = WindowMatching.from_json(value)
    assert found.to_json() == value
    assert (found.view, found.trust, found.version) == (matching.view, EVEN, matching.version)
    assert found.impostor_quantiles == (0.1, 0.25)
    assert_allclose(found.whitening.whole, PLAIN.whole)
    changes: list[Callable[[dict[str, object]], object]] = [
        lambda v: v.pop("view"),
        lambda v: v.update(view={"name": "windows"}),
        lambda v: v.update(whitening=None),
        lambda v: v.update(trust={}),
        lambda v: v.update(impostor_quantiles=["far"]),
        lambda v: v.pop("version"),
    ]
    for change in changes:
        wrong = matching.to_json()
        change(wrong)
        with pytest.raises(InvalidRequestError):
            WindowMatching.from_json(wrong)
