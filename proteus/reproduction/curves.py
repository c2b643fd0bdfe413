"""Figs. 1, 3 and 4: transfer functions K² against λ, on logarithmic axes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from proteus.reproduction import style
from workers.geometry.arrays import FloatArray, read_only

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOWEST = 1e-7
"""Smaller shares of the largest K² in a figure are not drawn."""
LAMBDA = "eigenvalue λ"
LAMBDA_RATIO = "eigenvalue ratio λ/λ₁"
SQUARED = "K²(λ)"


@dataclass(frozen=True, eq=False)
class Curve:
    """K² at some eigenvalues.

    Attributes
    ----------
    name : str
        For the legend.
    eigenvalues, squared : (n,) float64
    """

    name: str
    eigenvalues: FloatArray
    squared: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("eigenvalues", "squared"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def scale_free(self) -> "Curve":
        """λK², which is constant for the commute-time kernel."""
        return replace(self, squared=self.eigenvalues * self.squared)


def commute_time_like(curve: Curve, *, name: str = "commute time, K² = 1/λ") -> Curve:
    """Return 1/λ, scaled to the curve, since K² has no unit.

    The factor is the median of λ K² where that is above a thousandth of its maximum.
    """
    products = curve.squared * curve.eigenvalues
    large = products[products > 1e-3 * products.max(initial=0.0)]
    factor = float(np.median(large)) if len(large) else 1.0
    return Curve(name, curve.eigenvalues, factor / curve.eigenvalues)


def loglog_slope(curve: Curve) -> float:
    """Slope of ln K² against ln λ by least squares, over all points with K² > 0."""
    seen = curve.squared > 0
    return float(np.polyfit(np.log(curve.eigenvalues[seen]), np.log(curve.squared[seen]), 1)[0])


def draw_interpolations(grid: Curve, rough: Curve, smooth: Curve) -> "Figure":
    """Fig. 1: nearest neighbour interpolation, splines without and with smoothness.

    Beside K² there is λK², which shows what the logarithm of K² hides.
    """
    figure = style.new_figure(width=2 * style.WIDTH - 2.4)
    left, right = figure.subplots(1, 2)
    looks = ((style.ORANGE, ":"), (style.GREEN, "--"), (style.BLUE, "-"))
    for curve, (colour, line) in zip((grid, rough, smooth), looks, strict=True):
        _draw(left, curve, colour, line)
        _draw(right, curve.scale_free, colour, line)
    _frame(left, (grid, rough, smooth), LAMBDA, "Three ways of interpolation")
    right.set_xscale("log")
    right.set_ylim(bottom=0.0)
    right.set_xlabel(LAMBDA)
    right.set_ylabel("λ K²(λ)")
    right.set_title("The same times λ: flat is commute time")
    return figure


def draw_scale_only(learned: Curve, *, slope: float) -> "Figure":
    """Fig. 3: learned from scaled shapes alone, against commute time."""
    figure = style.new_figure()
    axes = figure.add_subplot()
    theory = commute_time_like(learned)
    _draw(axes, theory, style.BLUE, "-", below=True)
    _draw(axes, learned, style.ORANGE, "--")
    _frame(axes, (theory, learned), LAMBDA, "Learned from scaling alone")
    text = f"slope of ln K² against ln λ: {slope:.3f}\nexpected of commute time: −1"
    axes.text(0.03, 0.05, text.replace("-", "−"), transform=axes.transAxes, va="bottom")
    return figure


def draw_learned(learned: Curve, distance: Curve) -> "Figure":
    """Fig. 4: learned from all transformations; beside it on distances, in λ/λ₁."""
    figure = style.new_figure(width=2 * style.WIDTH - 2.4)
    left, right = figure.subplots(1, 2)
    for axes, curve, label, title in (
        (left, learned, LAMBDA, "As in the paper: on k(x, x′), in λ"),
        (right, distance, LAMBDA_RATIO, "Beyond the paper: on distances, in λ/λ₁"),
    ):
        theory = commute_time_like(curve)
        _draw(axes, theory, style.BLUE, "--")
        _draw(axes, curve, style.ORANGE, "-")
        _frame(axes, (theory, curve), label, title)
    return figure


def _draw(axes: "Axes", curve: Curve, colour: str, line: str, *, below: bool = False) -> None:
    """Draw a curve where it is above 0; broad and pale if another is drawn on it."""
    width, alpha = (6.0, 0.4) if below else (2.0, 1.0)
    shown = np.where(curve.squared > 0, curve.squared, np.nan)
    axes.plot(
        curve.eigenvalues,
        shown,
        color=colour,
        linestyle=line,
        linewidth=width,
        alpha=alpha,
        label=curve.name,
    )


def _frame(axes: "Axes", curves: Sequence[Curve], label: str, title: str) -> None:
    """Set axes, their range and the legend."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    highest = max(float(curve.squared.max(initial=0.0)) for curve in curves)
    positive = np.concatenate([curve.squared[curve.squared > 0] for curve in curves])
    if highest > 0 and len(positive):
        axes.set_ylim(max(LOWEST * highest, 0.5 * float(positive.min())), 2.0 * highest)
    axes.set_xlabel(label)
    axes.set_ylabel(SQUARED)
    axes.set_title(title)
    axes.legend(loc="upper right")
