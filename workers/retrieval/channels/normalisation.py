"""The scale that a channel forgets."""

import math
from collections.abc import Sequence

import numpy as np

from workers.geometry.solution import Part, Solution
from workers.geometry.spectrum import Spectrum

FULL, MOST = 2.0, 4.0
"""A component that is up to a half of its body is seen in the body's scale, and from then on less
and less: at most four times its own. Smaller, its eigenvalues would lie where no kernel looks."""

NORMALISATIONS = ("none", "area", "first-eigenvalue", "mean")


def length_factor(spectrum: Spectrum, normalisation: str) -> float:
    """What multiplies all lengths where a surface is scaled to area 1 or to λ₁ = 1.

    Parameters
    ----------
    spectrum : Spectrum
        At least one nonzero eigenpair; λ in 1/area.
    normalisation : str
        One of `NORMALISATIONS`.

    Returns
    -------
    float
        1 for "none" and "mean".
    """
    if normalisation == "area":
        return 1.0 / math.sqrt(spectrum.area)
    if normalisation == "first-eigenvalue":
        return math.sqrt(spectrum.eigenvalues[0])
    return 1.0


def normalised_spectrum(spectrum: Spectrum, normalisation: str) -> Spectrum:
    """Spectrum of the surface scaled to area 1 or to λ₁ = 1; "none" and "mean" leave it as it is.

    Parameters
    ----------
    spectrum : Spectrum
        At least one nonzero eigenpair; λ in 1/area.
    normalisation : str
        One of `NORMALISATIONS`.

    Returns
    -------
    Spectrum
    """
    factor = length_factor(spectrum, normalisation)
    return spectrum if factor == 1.0 else spectrum.rescaled(factor)


def part_spectra(parts: Sequence[Part], normalisation: str) -> list[tuple[Spectrum, float]]:
    """Spectra of components in the scale of the body that they make up together.

    Parameters
    ----------
    parts : sequence of Part
        All of a surface.
    normalisation : str
        One of `NORMALISATIONS`.

    Returns
    -------
    list of (Spectrum, float)
        Rescaled by the factors of `part_factors`, with its other numbers.
    """
    spectra = [part.solution.spectrum for part in parts]
    return [
        (spectrum if factor == 1.0 else spectrum.rescaled(factor), rest)
        for spectrum, (factor, rest) in zip(
            spectra, part_factors(parts, normalisation), strict=True
        )
    ]


def part_factors(parts: Sequence[Part], normalisation: str) -> list[tuple[float, float]]:
    """What multiplies all lengths of components, in the scale of the body that they make up.

    Parameters
    ----------
    parts : sequence of Part
        All of a surface.
    normalisation : str
        One of `NORMALISATIONS`.

    Returns
    -------
    list of (float, float)
        For "area" the body has area 1. For "first-eigenvalue" the mean of ln λ₁, by weight, is 0.
        The second number is the logarithm of what is left of the body's area over the component's,
        where that is more than 4 times: k(x,x) of a body of n equal components is n times theirs.
    """
    spectra = [part.solution.spectrum for part in parts]
    if normalisation == "area":
        seen = [_seen(part.body) for part in parts]
        return [
            (1.0 / math.sqrt(s.area * x), math.log(part.body / x))
            for part, s, x in zip(parts, spectra, seen, strict=True)
        ]
    if normalisation == "first-eigenvalue":
        first = [float(spectrum.eigenvalues[0]) for spectrum in spectra]
        weights = [part.weight for part in parts]
        mean = math.exp(np.average(np.log(first), weights=weights))
        return [(math.sqrt(one / _seen(one / mean)), 0.0) for one in first]
    return [(1.0, 0.0) for _ in parts]


def component_factors(solution: Solution, normalisation: str) -> list[tuple[float, float]]:
    """`part_factors` of a surface of several components, `length_factor` of a connected one.

    Parameters
    ----------
    solution : Solution
        Of the surface.
    normalisation : str
        One of `NORMALISATIONS`.

    Returns
    -------
    list of (float, float)
        Of each component.
    """
    if solution.parts:
        return part_factors(solution.parts, normalisation)
    return [(length_factor(solution.spectrum, normalisation), 0.0)]


def _seen(ratio: float) -> float:
    """The ratio itself up to `FULL`, then growing ever slower towards `MOST`."""
    beyond = max(0.0, ratio - FULL) / (MOST - FULL)
    return min(ratio, FULL) + (MOST - FULL) * (1.0 - math.exp(-beyond))
