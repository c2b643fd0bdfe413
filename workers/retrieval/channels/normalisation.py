"""The scale that a channel forgets."""

import numpy as np

from workers.geometry.spectrum import Spectrum

NORMALISATIONS = ("none", "area", "first-eigenvalue", "mean")


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
    if normalisation == "area":
        return spectrum.rescaled(1.0 / np.sqrt(spectrum.area))
    if normalisation == "first-eigenvalue":
        return spectrum.rescaled(float(np.sqrt(spectrum.eigenvalues[0])))
    return spectrum
