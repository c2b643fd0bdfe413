"""Figs. 2 and 5: transformed shapes, and k(x,x) on them with its distribution."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proteus.reproduction import style
from workers.geometry.arrays import FloatArray
from workers.geometry.mesh import TriangleMesh
from workers.rendering.colouring import ANCHORS
from workers.rendering.render import Picture, render

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHEET_PIXELS, SIGNATURE_PIXELS = 280, 460  # enough for the resolution of the files
WHITE = (255, 255, 255)
BINS = 60
TAILS = (0.005, 0.995)
"""Shares of the area beyond which colours and histograms are cut."""


@dataclass(frozen=True, eq=False)
class Signature:
    """k(x,x) on one shape.

    Attributes
    ----------
    name : str
        Of the transformation.
    mesh : TriangleMesh
        n vertices.
    values : (n,) float64
        k(x,x); K² was scaled as its training scales it.
    """

    name: str
    mesh: TriangleMesh
    values: FloatArray

    @property
    def areas(self) -> FloatArray:
        """Area of each vertex, (n,), a third of its faces'."""
        third = np.repeat(self.mesh.face_areas / 3.0, 3)  # (3m,)
        areas = np.bincount(self.mesh.faces.ravel(), third, minlength=self.mesh.n_vertices)
        return areas.astype(np.float64)


def draw_transformations(shapes: Sequence[tuple[str, TriangleMesh]], *, columns: int) -> "Figure":
    """Fig. 2: a contact sheet of named shapes, at most so many in a row."""
    columns = min(columns, len(shapes))
    rows = -(-len(shapes) // columns)
    figure = style.new_figure(width=1.75 * columns, height=2.0 * rows)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (name, mesh) in zip(grid.flat, shapes, strict=False):
        _show(axes, render(mesh, size=SHEET_PIXELS, background=WHITE), name)
    return figure


def draw_signatures(signatures: Sequence[Signature]) -> "Figure":
    """Fig. 5: k(x,x) in colours above, and the histograms of its values below."""
    low, high = common_range(signatures)
    figure = style.new_figure(width=2.9 * len(signatures), height=5.6)
    places = figure.add_gridspec(2, len(signatures), height_ratios=(3.0, 2.2))
    tops = [figure.add_subplot(places[0, i]) for i in range(len(signatures))]
    for axes, one in zip(tops, signatures, strict=True):
        axes.set_axis_off()
        picture = render(
            one.mesh,
            size=SIGNATURE_PIXELS,
            background=WHITE,
            values=one.values,
            value_range=(low, high),
        )
        _show(axes, picture, one.name)
    _colour_bar(figure, tops, low, high)
    _draw_histograms(figure.add_subplot(places[1, :]), signatures, low, high)
    return figure


def common_range(signatures: Sequence[Signature]) -> tuple[float, float]:
    """Return the range of the values of all shapes, without their tails."""
    values = np.concatenate([one.values for one in signatures])
    areas = np.concatenate([one.areas / one.areas.sum() for one in signatures])
    order = np.argsort(values, kind="stable")
    shares = np.cumsum(areas[order]) / areas.sum()
    low, high = np.interp(TAILS, shares, values[order])
    return float(low), float(max(high, low))


def histogram_overlap(one: Signature, other: Signature) -> float:
    """Share of the area that two histograms have in common, 0 to 1."""
    low, high = common_range([one, other])
    first, second = (_histogram(s, low, high)[0] for s in (one, other))
    return float(np.minimum(first, second).sum())


def _histogram(signature: Signature, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Shares of the area (b,) and edges (b + 1,); what lies beyond is in the first and last bin."""
    edges = np.linspace(low, high if high > low else low + 1.0, BINS + 1)
    inside = np.clip(signature.values, edges[0], edges[-1])
    counts, _ = np.histogram(inside, bins=edges, weights=signature.areas)
    return counts / counts.sum(), edges


def _draw_histograms(
    axes: "Axes", signatures: Sequence[Signature], low: float, high: float
) -> None:
    colours = (style.BLUE, style.ORANGE, style.GREEN, style.PINK)
    for number, one in enumerate(signatures):
        shares, edges = _histogram(one, low, high)
        axes.stairs(
            100.0 * shares,
            edges,
            color=colours[number % len(colours)],
            linestyle=style.LINES[number % len(style.LINES)],
            linewidth=1.8,
            label=one.name,
        )
    axes.set_xlabel("k(x, x)")
    axes.set_ylabel("share of the area, %")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper right")


def _colour_bar(figure: "Figure", tops: Sequence["Axes"], low: float, high: float) -> None:
    """Set the map of `colouring` beside the pictures."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    colours = LinearSegmentedColormap.from_list(
        "values", [tuple(c / 255 for c in a) for a in ANCHORS]
    )
    mappable = ScalarMappable(Normalize(low, high if high > low else low + 1.0), colours)
    bar = figure.colorbar(mappable, ax=list(tops), shrink=0.8, aspect=25, pad=0.02)
    bar.set_label("k(x, x)")
    bar.outline.set_visible(False)


def _show(axes: "Axes", picture: Picture, name: str) -> None:
    axes.imshow(picture, interpolation="antialiased")
    axes.set_title(name, fontweight="normal", loc="center", fontsize=10)
