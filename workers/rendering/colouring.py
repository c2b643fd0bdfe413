"""Colours for the values of a function on a surface.

The map runs from dark violet over blue and green to yellow, in even steps of the Oklab colour space
(Ottosson 2020). So equal differences of the values look equal. Lightness rises all the way, so
this holds also in grey, and for eyes that do not tell red from green.
"""

import numpy as np

from workers.errors import InvalidRequestError
from workers.geometry.arrays import FloatArray

ANCHORS = (
    (48, 14, 116), (41, 43, 139), (15, 68, 157), (17, 88, 150), (23, 108, 146),
    (29, 129, 148), (34, 151, 149), (40, 171, 148), (45, 190, 138), (96, 204, 121),
    (151, 216, 108), (200, 225, 98), (246, 233, 97),
)  # fmt: skip
"""Red, green and blue, 0 to 255, evenly spaced from the lowest value to the highest."""

WITHOUT_VALUE = (150, 150, 150)


def value_colours(values: FloatArray, low: float, high: float) -> FloatArray:
    """Colours of values, from dark violet to yellow.

    Parameters
    ----------
    values : (n,) float64
        What lies outside the range has the colour of its end; what is not a number is grey.
    low, high : float
        The values of the first and the last colour; where both are the same, all is in the middle.

    Returns
    -------
    (n, 3) float64
        Red, green and blue, 0 to 255.

    Raises
    ------
    InvalidRequestError
        The range is not finite, or upside down.
    """
    if not (np.isfinite(low) and np.isfinite(high) and low <= high):
        raise InvalidRequestError(f"the range of colours is {low} to {high}, expected to ascend")
    known = np.isfinite(values)
    width = high - low
    places = (
        (np.where(known, values, low) - low) / width if width > 0 else np.full(len(values), 0.5)
    )
    stops = np.linspace(0.0, 1.0, len(ANCHORS))
    channels = [np.interp(places, stops, column) for column in np.array(ANCHORS, dtype=float).T]
    colours: FloatArray = np.stack(channels, axis=1)  # (n, 3)
    colours[~known] = WITHOUT_VALUE
    return colours


def finite_range(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest of the values that are numbers.

    Parameters
    ----------
    values : (n,) float64
        May have NaN and infinities.

    Returns
    -------
    low, high : float
        0 and 0 where no value is finite.
    """
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
