"""A channel: one number vector of a shape, and how two of them are compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workers.diffusion.distances import diagonal_signature, pairwise_diffusion_distances
from workers.diffusion.distributions import (
    product_measure,
    value_distribution,
    weighted_mean,
    weighted_quantiles,
)
from workers.diffusion.kernels import HeatKernel, Kernel, kernel_from_json, kernel_to_json
from workers.errors import InvalidRequestError, KernelDomainError, SpectrumError
from workers.geometry.arrays import Float32Array, FloatArray, IntArray
from workers.geometry.sampling import SAMPLES
from workers.geometry.smoothing import roughness
from workers.geometry.solution import Solution
from workers.geometry.spectrum import Spectrum
from workers.retrieval.dissimilarity import UNFOUND, find_dissimilarity
from workers.retrieval.points import point_signatures

DISTANCES = "distance-distribution"
DIAGONAL = "diagonal-distribution"
LOG_DIAGONAL = "log-diagonal-distribution"
POINTS = "log-diagonal-points"
EIGENVALUES = "eigenvalues"
AREA = "area"
ROUGHNESS = "roughness"
FEATURES = (DISTANCES, DIAGONAL, LOG_DIAGONAL, POINTS, EIGENVALUES, AREA, ROUGHNESS)
WITHOUT_KERNEL = frozenset({EIGENVALUES, AREA, ROUGHNESS})
NORMALISATIONS = ("none", "area", "first-eigenvalue", "mean")
CENTRES = ("none", "mean", "log-mean")
LOG_FLOOR = 1e-9  # below what any kernel leaves at a vertex of a surface of area 1


@dataclass(frozen=True)
class Channel:
    """What is taken of a spectrum, in which unit, and how it is compared.

    Attributes
    ----------
    name : str
        Unique within its model.
    view : str
        Name of the model's view whose working mesh is described.
    kernel : Kernel or None
        None for eigenvalues, which need none.
    feature : str
        "distance-distribution": of diffusion distances between sampled points, eq. (6);
        "diagonal-distribution": of k(x,x) at all vertices; "log-diagonal-distribution": of
        ln k(x,x); "log-diagonal-points": of ln k(x,x) at sampled points, and at several times;
        "eigenvalues": their logarithms; "area": the logarithm of the surface's area; "roughness":
        of the working mesh, which is not compared: it says what a query's view is worth.
    normalisation : str
        The scale that is forgotten: "none"; "area" and "first-eigenvalue" scale the surface until
        that is 1; "mean" divides distances, values or eigenvalues by their mean.
    centre : str
        What is subtracted from ln k(x,x): "none"; "mean", the logarithm of the mean of k(x,x);
        "log-mean", the mean of ln k(x,x). "none" for all other features.
    edges : tuple of float or None
        Bounds of a histogram's bins, fixed with the model; the outermost bins take what is beyond.
    levels : tuple of float or None
        Instead of edges: levels in (0, 1) of quantiles; for eigenvalues the numbers of those that
        are taken, 1 being the first nonzero one; for points multiples of the heat kernel's time;
        for roughness the one up to which its view counts in full, and the one from which on it
        does not count.
    dissimilarity : str
        By which two such vectors are compared unless a query asks for another.
    scale, weight : float
        The dissimilarity D counts as weight · (D / scale)^power in the model's distance.
    samples : int
        Points between which distances are taken.
    """

    name: str
    view: str
    kernel: Kernel | None
    feature: str
    normalisation: str
    edges: tuple[float, ...] | None = None
    levels: tuple[float, ...] | None = None
    dissimilarity: str = "l1"
    scale: float = 1.0
    weight: float = 1.0
    samples: int = SAMPLES
    centre: str = "none"

    def __post_init__(self) -> None:
        """Check that the parts fit together."""
        if self.feature not in FEATURES:
            raise _unknown(self.name, "feature", self.feature, FEATURES)
        if self.normalisation not in NORMALISATIONS:
            raise _unknown(self.name, "normalisation", self.normalisation, NORMALISATIONS)
        if self.centre not in CENTRES:
            raise _unknown(self.name, "centre", self.centre, CENTRES)
        if self.centre != "none" and self.feature not in {LOG_DIAGONAL, POINTS}:
            raise self._invalid("only ln k(x,x) has a centre")
        if self.feature == POINTS and not isinstance(self.kernel, HeatKernel):
            raise self._invalid("points have a heat kernel")
        if (self.kernel is None) != (self.feature in WITHOUT_KERNEL):
            raise self._invalid(
                "eigenvalues, area and roughness take no kernel, everything else needs one"
            )
        if (self.edges is None) == (self.levels is None):
            raise self._invalid("expected either edges or levels")
        if self.edges is not None:
            if self.feature in {*WITHOUT_KERNEL, POINTS}:
                raise self._invalid(
                    "points, eigenvalues, area and roughness have levels and no edges"
                )
            if len(self.edges) < 2 or not np.all(np.diff(self.edges) > 0.0):
                raise self._invalid("edges must ascend and be at least 2")
        if self.levels is not None and not self._levels_fit(self.levels):
            raise self._invalid(
                "levels must be numbers between 0 and 1, from 1 on for eigenvalues, above 0 for "
                "points, two that ascend for roughness"
            )
        positive = self.scale > 0.0 and self.weight >= 0.0 and self.samples >= 1
        if not (positive and np.isfinite(self.scale) and np.isfinite(self.weight)):
            raise self._invalid("expected scale > 0, weight >= 0 and at least 1 sample")
        if self.is_of_points != (self.dissimilarity == UNFOUND):
            raise self._invalid(f"points, and nothing else, are compared by {UNFOUND!r}")
        if not self.is_of_points:
            find_dissimilarity(self.dissimilarity, distribution=self.is_distribution)

    @property
    def is_of_points(self) -> bool:
        """True where only the nearest candidates are compared, by points of the query."""
        return self.feature == POINTS

    @property
    def is_of_roughness(self) -> bool:
        """True where nothing is compared, but a query's number says what its view is worth."""
        return self.feature == ROUGHNESS

    @property
    def is_distribution(self) -> bool:
        """True for probabilities a bin, False for quantiles and eigenvalues."""
        return self.edges is not None

    @property
    def dimension(self) -> int:
        """Numbers in the vector."""
        return len(self.widths) * (self.samples if self.is_of_points else 1)

    @property
    def widths(self) -> FloatArray:
        """Widths of the bins, (d,); 1 where there are none."""
        if self.is_of_roughness:
            return np.ones(1)
        if self.edges is not None:
            return np.diff(np.asarray(self.edges, dtype=np.float64))
        return np.ones(len(self.levels or ()))

    def to_json(self) -> dict[str, Any]:
        """As the API shows it."""
        axis = {"edges": self.edges} if self.edges is not None else {"levels": self.levels}
        return {
            "name": self.name,
            "view": self.view,
            "kernel": None if self.kernel is None else kernel_to_json(self.kernel),
            "feature": self.feature,
            "normalisation": self.normalisation,
            **{key: list(values or ()) for key, values in axis.items()},
            "dissimilarity": self.dissimilarity,
            "scale": self.scale,
            "weight": self.weight,
            "samples": self.samples,
            "centre": self.centre,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Channel":
        """Return the channel that `to_json` wrote; InvalidRequestError if it is none."""
        try:
            kernel, edges, levels = (value.get(key) for key in ("kernel", "edges", "levels"))
            return cls(
                name=str(value["name"]),
                view=str(value["view"]),
                kernel=None if kernel is None else kernel_from_json(kernel),
                feature=str(value["feature"]),
                normalisation=str(value["normalisation"]),
                edges=None if edges is None else tuple(float(edge) for edge in edges),
                levels=None if levels is None else tuple(float(level) for level in levels),
                dissimilarity=str(value["dissimilarity"]),
                scale=float(value["scale"]),
                weight=float(value["weight"]),
                samples=int(value.get("samples", SAMPLES)),
                centre=str(value.get("centre", "none")),
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InvalidRequestError(f"the channel cannot be read: {error!r}") from error

    def _levels_fit(self, levels: tuple[float, ...]) -> bool:
        """Whether levels are what the feature needs."""
        if self.feature == AREA:
            return levels == (1.0,)
        if self.feature == ROUGHNESS:
            return len(levels) == 2 and 0.0 <= levels[0] < levels[1] < np.inf
        if self.feature == POINTS:
            return len(levels) > 0 and all(level > 0.0 for level in levels)
        if self.feature == EIGENVALUES:
            return len(levels) > 0 and all(level >= 1 and level % 1 == 0 for level in levels)
        return len(levels) > 0 and all(0.0 < level < 1.0 for level in levels)

    def _invalid(self, what: str) -> InvalidRequestError:
        return InvalidRequestError(f"channel {self.name!r}: {what}")


def describe_channel(solution: Solution, channel: Channel) -> Float32Array:
    """Vector of a shape under a channel.

    Parameters
    ----------
    solution : Solution
        Of the shape under the channel's view.
    channel : Channel

    Returns
    -------
    (channel.dimension,) float32: probabilities of the bins, quantiles, or ln λ.

    Raises
    ------
    SpectrumError
        There are fewer eigenpairs than the channel needs.
    KernelDomainError
        The kernel is not finite, or negative, on the spectrum, or vanishes on it.
    """
    needed = int(max(channel.levels or (1,))) if channel.feature == EIGENVALUES else 1
    if solution.spectrum.n_eigenpairs < needed:
        raise SpectrumError(
            f"channel {channel.name!r} needs {needed} eigenvalues, but the spectrum of this mesh "
            f"with {solution.mesh.n_vertices} vertices has {solution.spectrum.n_eigenpairs}"
        )
    if channel.feature == AREA:
        logarithm: Float32Array = np.log([solution.spectrum.area]).astype(np.float32)
        return logarithm
    if channel.is_of_roughness:
        return np.array([roughness(solution.mesh)], dtype=np.float32)
    spectrum = normalised_spectrum(solution.spectrum, channel.normalisation)
    if channel.kernel is None:
        return _log_eigenvalues(spectrum, channel)
    if channel.is_of_points:
        return _points(solution, spectrum, channel)
    if channel.feature == LOG_DIAGONAL:
        values = _log_diagonal(spectrum, channel.kernel, channel.centre)  # (n,)
        return _distribution_vector(values, spectrum.areas, channel)
    if channel.feature == DIAGONAL:
        values = diagonal_signature(spectrum, channel.kernel)  # (n,)
        return _distribution_vector(values, spectrum.areas, channel)
    sample = solution.sample(channel.samples)
    distances = pairwise_diffusion_distances(spectrum, channel.kernel, sample.indices)
    return _distribution_vector(*product_measure(distances, sample.weights), channel)


def normalised_spectrum(spectrum: Spectrum, normalisation: str) -> Spectrum:
    """Scale the surface to area 1 or to λ₁ = 1; "none" and "mean" leave it as it is."""
    if normalisation == "area":
        return spectrum.rescaled(1.0 / np.sqrt(spectrum.area))
    if normalisation == "first-eigenvalue":
        return spectrum.rescaled(float(np.sqrt(spectrum.eigenvalues[0])))
    return spectrum


def _log_eigenvalues(spectrum: Spectrum, channel: Channel) -> Float32Array:
    """Logarithms of the channel's eigenvalues: ShapeDNA (Reuter, Wolter, Peinecke 2005)."""
    numbers: IntArray = np.array(channel.levels, dtype=np.int64) - 1
    eigenvalues = spectrum.eigenvalues[numbers]  # (d,)
    if channel.normalisation == "mean":
        eigenvalues = eigenvalues / eigenvalues.mean()
    return np.log(eigenvalues).astype(np.float32)


def _points(solution: Solution, spectrum: Spectrum, channel: Channel) -> Float32Array:
    """Return ln k(x,x) at farthest points and at multiples of the kernel's time."""
    kernels = [HeatKernel(level * channel.kernel.time) for level in channel.levels or ()]  # type: ignore[union-attr]
    logarithms = np.stack([_log_diagonal(spectrum, kernel, channel.centre) for kernel in kernels])
    indices = solution.farthest_points(channel.samples)
    return point_signatures(logarithms, indices, channel.samples).astype(np.float32)


def _log_diagonal(spectrum: Spectrum, kernel: Kernel, centre: str) -> FloatArray:
    """Return ln k(x,x) at every vertex, (n,), without its centre; k is floored for unit area."""
    values = diagonal_signature(spectrum, kernel)  # (n,)
    logarithms = np.log(values + LOG_FLOOR / spectrum.area)
    if centre == "mean":
        mean = weighted_mean(values, spectrum.areas)
        logarithms -= np.log(mean + LOG_FLOOR / spectrum.area)
    elif centre == "log-mean":
        logarithms -= weighted_mean(logarithms, spectrum.areas)
    centred: FloatArray = logarithms
    return centred


def _distribution_vector(values: FloatArray, weights: FloatArray, channel: Channel) -> Float32Array:
    """Histogram or quantiles of (n,) values."""
    if channel.normalisation == "mean":
        mean = weighted_mean(values, weights)
        if not mean > 0.0:
            raise KernelDomainError(f"channel {channel.name!r}: the kernel vanishes on the shape")
        values = values / mean
    if channel.levels is not None:
        levels = np.asarray(channel.levels, dtype=np.float64)
        return weighted_quantiles(values, weights, levels).astype(np.float32)
    edges = np.asarray(channel.edges, dtype=np.float64)
    return value_distribution(values, weights, edges).masses.astype(np.float32)


def _unknown(channel: str, what: str, found: str, expected: tuple[str, ...]) -> InvalidRequestError:
    return InvalidRequestError(
        f"channel {channel!r}: there is no {what} {found!r}; there are {', '.join(expected)}"
    )
