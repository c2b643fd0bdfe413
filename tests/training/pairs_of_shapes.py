"""Pairs of shapes to learn from: closed forms, scaled copies, and noise that is seeded."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from tests.meshes import bumpy_sphere, cylinder, icosphere, torus
from workers.geometry.mesh import TriangleMesh
from workers.geometry.spectrum import Spectrum, compute_spectrum
from workers.training.moments import PairMoments, pair_moments

EIGENPAIRS = 40


def small_meshes() -> list[TriangleMesh]:
    """A shape without symmetry, a sphere, a torus and an open cylinder."""
    return [bumpy_sphere(), icosphere(3), torus(32, 16), cylinder(24, 16)]


def small_shapes() -> list[Spectrum]:
    """Spectra of four shapes of area 1, each a class of its own."""
    spectra = [compute_spectrum(mesh, n_eigenpairs=EIGENPAIRS) for mesh in small_meshes()]
    return [at_area_one(spectrum) for spectrum in spectra]


def at_area_one(spectrum: Spectrum) -> Spectrum:
    """The spectrum of the surface scaled to area 1."""
    return spectrum.rescaled(1.0 / np.sqrt(spectrum.area))


def scaled_pairs(
    spectra: Sequence[Spectrum], factors: Sequence[float], criterion: str
) -> tuple[list[PairMoments], list[str]]:
    """Every shape and its scaled copies, and the labels."""
    moments, labels = [], []
    for i, spectrum in enumerate(spectra):
        for factor in factors:
            moments.append(moments_of(spectrum, spectrum.rescaled(factor), criterion))
            labels.append(f"class-{i}")
    return moments, labels


def moments_of(spectrum: Spectrum, transformed: Spectrum, criterion: str) -> PairMoments:
    """Moments over all vertices, which correspond by their numbers."""
    return pair_moments(
        spectrum,
        transformed,
        spectrum.eigenvectors,
        transformed.eigenvectors,
        spectrum.areas,
        criterion=criterion,
    )


def deformed(mesh: TriangleMesh, strength: float, seed: int) -> TriangleMesh:
    """A smooth random deformation that keeps the vertices' order."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(3, 3))
    moved = mesh.vertices + strength * np.sin(mesh.vertices @ waves + rng.uniform(0, 6, size=3))
    return TriangleMesh(moved, mesh.faces)


@cache
def deformed_spectra() -> list[tuple[Spectrum, Spectrum, str]]:
    """Four shapes, three smooth deformations of each in several sizes, and the label of each."""
    pairs = []
    for i, mesh in enumerate(small_meshes()):
        spectrum = compute_spectrum(mesh, n_eigenpairs=EIGENPAIRS)
        for seed in range(3):
            other = compute_spectrum(deformed(mesh, 0.15, seed), n_eigenpairs=EIGENPAIRS)
            pairs.append((spectrum, other.rescaled(0.6 + 0.4 * seed), f"class-{i}"))
    return pairs


def deformed_pairs(criterion: str) -> tuple[list[PairMoments], list[str]]:
    """Moments and labels of `deformed_spectra`."""
    pairs = deformed_spectra()
    moments = [moments_of(first, second, criterion) for first, second, _ in pairs]
    return moments, [label for _, _, label in pairs]
