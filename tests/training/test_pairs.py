"""Moments over all pairs of points, against the matrices that the paper never builds either."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.training.pairs_of_shapes import moments_of, small_shapes
from workers.diffusion.splines import SplineBasis
from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray
from workers.geometry.spectrum import Spectrum
from workers.training.moments import CRITERIA, UNITS, PairMoments, pair_moments
from workers.training.pair_statistics import (
    ShapeMoments,
    negatives_between,
    pair_statistics,
    shape_moments,
)

POINTS = 30


def random_spectrum(rng: np.random.Generator, k: int) -> Spectrum:
    """Eigenpairs of nothing: the moments are algebra."""
    eigenvalues = np.sort(rng.uniform(0.5, 90.0, size=k))
    area = float(rng.uniform(0.2, 5.0))
    return Spectrum(eigenvalues, rng.normal(size=(POINTS, k)), np.full(POINTS, area / POINTS), area)


@pytest.fixture
def shapes() -> list[tuple[Spectrum, Spectrum, FloatArray]]:
    """Three pairs X, Y with different numbers of eigenpairs, and uneven weights."""
    rng = np.random.default_rng(7)
    return [
        (random_spectrum(rng, 6), random_spectrum(rng, 5), rng.uniform(0.1, 2.0, size=POINTS))
        for _ in range(3)
    ]


def matrix_of(spectrum: Spectrum, criterion: str) -> FloatArray:
    """C of eq. (10), (s², k): one row a pair of points, in the unit of the mesh."""
    i, j = np.divmod(np.arange(POINTS**2), POINTS)
    phi = spectrum.eigenvectors
    return phi[i] * phi[j] if criterion == "kernel" else (phi[i] - phi[j]) ** 2


def in_unit(spectrum: Spectrum, unit: str) -> Spectrum:
    """The spectrum of the surface scaled until the unit is 1."""
    if unit == "none":
        return spectrum
    if unit == "area":
        return spectrum.rescaled(1.0 / np.sqrt(spectrum.area))
    return spectrum.rescaled(np.sqrt(spectrum.eigenvalues[0]))


def moments_between(pair: tuple[Spectrum, Spectrum, FloatArray], criterion: str) -> PairMoments:
    first, second, weights = pair
    return pair_moments(
        first, second, first.eigenvectors, second.eigenvectors, weights, criterion=criterion
    )


@pytest.mark.parametrize("criterion", CRITERIA)
def test_moments_are_those_over_all_pairs_of_points(
    shapes: list[tuple[Spectrum, Spectrum, FloatArray]], criterion: str
) -> None:
    first, second, weights = shapes[0]
    features = np.hstack(
        [matrix_of(in_unit(spectrum, "area"), criterion) for spectrum in (first, second)]
    )
    pairs = np.outer(weights, weights).ravel() / weights.sum() ** 2
    found = moments_between(shapes[0], criterion)
    assert_allclose(found.gram, features.T @ (pairs[:, None] * features), rtol=1e-11)
    assert_allclose(found.mean, pairs @ features, rtol=1e-10, atol=1e-13)
    squared = np.hstack(
        [matrix_of(in_unit(spectrum, "area"), "distance") for spectrum in (first, second)]
    )
    assert_allclose(found.squared_distance, pairs @ squared, rtol=1e-12)


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("unit", UNITS)
def test_statistics_are_those_of_the_explicit_matrices(
    shapes: list[tuple[Spectrum, Spectrum, FloatArray]], criterion: str, unit: str
) -> None:
    basis = SplineBasis(0.01, 1000.0, 7, 3)
    rows, weights = [], []
    for first, second, w in shapes:
        spectra = [in_unit(spectrum, unit) for spectrum in (first, second)]
        rows.append([matrix_of(s, criterion) @ basis.values(s.eigenvalues) for s in spectra])
        weights.append(np.outer(w, w).ravel() / w.sum() ** 2)
    positive, negative = np.zeros((7, 7)), np.zeros((7, 7))
    for i, (own, other) in enumerate(rows):
        positive += (own - other).T @ (weights[i][:, None] * (own - other))
        for j in range(3):
            if i != j:  # every pair of points of X_i against every one of Y_j
                for u, weight in zip(own, weights[i], strict=True):
                    difference = u - rows[j][1]
                    negative += weight * difference.T @ (weights[j][:, None] * difference)
    sums = {
        str(i): shape_moments(moments_between(pair, criterion), basis.values, unit)
        for i, pair in enumerate(shapes)
    }
    found = pair_statistics(sums)
    assert (found.n_positive, found.n_negative) == (3, 6)
    scale = np.abs(negative).max()
    assert_allclose(found.positive, positive, rtol=1e-9, atol=1e-12 * scale)
    assert_allclose(found.negative, negative, rtol=1e-9, atol=1e-12 * scale)
    assert_allclose(found.means[1], negative / 6, rtol=1e-9, atol=1e-12 * scale)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_statistics_of_a_union_are_the_sum(
    shapes: list[tuple[Spectrum, Spectrum, FloatArray]], criterion: str
) -> None:
    basis = SplineBasis(0.01, 1000.0, 5, 3)
    a, b, c = (
        shape_moments(moments_between(pair, criterion), basis.values, "area") for pair in shapes
    )
    assert (a + b).count == 2
    whole = pair_statistics({"a": a + b, "c": c})
    parts = [pair_statistics({"a": one, "c": c}) for one in (a, b)]
    union = parts[0] + parts[1]
    assert_allclose(whole.negative, union.negative, rtol=1e-12)
    assert whole.n_negative == union.n_negative == 4
    assert_allclose(whole.positive, a.positive + b.positive + c.positive, rtol=1e-12)


def test_queries_restrict_the_pairs_to_their_classes(
    shapes: list[tuple[Spectrum, Spectrum, FloatArray]],
) -> None:
    basis = SplineBasis(0.01, 1000.0, 5, 3)
    sums: dict[str, ShapeMoments] = {
        name: shape_moments(moments_between(pair, "kernel"), basis.values, "area")
        for name, pair in zip("abc", shapes, strict=True)
    }
    found = pair_statistics(sums, ["c"])
    between = [("a", "c"), ("b", "c"), ("c", "a"), ("c", "b")]
    parts = [negatives_between(sums[x], sums[y]).negative for x, y in between]
    assert_allclose(found.negative, np.sum(parts, axis=0), rtol=1e-12)
    assert_allclose(found.positive, sums["c"].positive, rtol=1e-12)
    assert (found.n_positive, found.n_negative) == (1, 4)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_shape_does_not_differ_from_itself(criterion: str) -> None:
    spectrum = small_shapes()[0]
    basis = SplineBasis(1.0, 1000.0, 8, 3)
    moments = shape_moments(moments_of(spectrum, spectrum, criterion), basis.values, "area")
    assert_allclose(moments.positive, 0.0, atol=1e-13 * np.abs(moments.second).max())


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("unit", ["area", "first-eigenvalue"])
def test_scale_changes_nothing_where_the_unit_forgets_it(criterion: str, unit: str) -> None:
    spectrum, other = small_shapes()[:1] * 2
    basis = SplineBasis(0.5, 1000.0, 8, 3)
    plain = shape_moments(moments_of(spectrum, other, criterion), basis.values, unit)
    moments = moments_of(spectrum.rescaled(37.0), other.rescaled(0.01), criterion)
    scaled = shape_moments(moments, basis.values, unit)
    size = np.abs(plain.second).max()
    assert_allclose(scaled.second, plain.second, rtol=1e-10, atol=1e-13 * size)
    assert_allclose(
        scaled.transformed_second, plain.transformed_second, rtol=1e-10, atol=1e-13 * size
    )


@pytest.mark.parametrize("criterion", CRITERIA)
def test_weights_count_as_repeated_points(criterion: str) -> None:
    rng = np.random.default_rng(3)
    first, second = random_spectrum(rng, 4), random_spectrum(rng, 4)
    repeats = rng.integers(1, 4, size=POINTS)
    weighted = moments_between((first, second, repeats.astype(np.float64)), criterion)
    repeated = pair_moments(
        first,
        second,
        np.repeat(first.eigenvectors, repeats, axis=0),
        np.repeat(second.eigenvectors, repeats, axis=0),
        np.ones(repeats.sum()),
        criterion=criterion,
    )
    assert_allclose(repeated.gram, weighted.gram, rtol=1e-11)
    assert_allclose(repeated.mean, weighted.mean, rtol=1e-10, atol=1e-13)


def test_arrays_bring_moments_back_and_are_read_only() -> None:
    spectrum = small_shapes()[0]
    moments = moments_of(spectrum, spectrum.rescaled(2.0), "distance")
    again = PairMoments.from_arrays(moments.to_arrays())
    for name, array in moments.to_arrays().items():
        assert_array_equal(again.to_arrays()[name], array)
    assert not again.gram.flags.writeable
    with pytest.raises(InvalidRequestError, match="cannot be read"):
        PairMoments.from_arrays({"criterion": np.array("kernel")})


def test_what_is_no_number_is_refused() -> None:
    spectrum = small_shapes()[0]
    points = spectrum.eigenvectors.copy()
    points[3, 4] = np.nan
    with pytest.raises(InvalidRequestError, match="no number"):
        pair_moments(spectrum, spectrum, points, points, spectrum.areas, criterion="kernel")


def test_sizes_weights_and_names_that_do_not_fit_are_refused() -> None:
    spectrum = small_shapes()[0]
    phi, areas = spectrum.eigenvectors, spectrum.areas
    with pytest.raises(InvalidRequestError, match="do not fit 40 and 40 eigenpairs"):
        pair_moments(spectrum, spectrum, phi, phi[:, :9], areas, criterion="kernel")
    with pytest.raises(InvalidRequestError, match="weights"):
        pair_moments(spectrum, spectrum, phi, phi, 0.0 * areas, criterion="kernel")
    with pytest.raises(InvalidRequestError, match="no criterion 'ratio'"):
        pair_moments(spectrum, spectrum, phi, phi, areas, criterion="ratio")
    with pytest.raises(InvalidRequestError, match="no unit 'metre'"):
        moments_of(spectrum, spectrum, "kernel").scales("metre")
