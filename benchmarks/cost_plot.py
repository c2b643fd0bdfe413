"""The plot of docs/performance.md: seconds a shape against its vertices."""

import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from proteus.reproduction import style

NAME = "performance"


def draw_costs(found: Sequence[Mapping[str, Any]], folder: Path) -> Path:
    """Write the picture of what ``python -m benchmarks.cost`` measured.

    Parameters
    ----------
    found : sequence of mapping
        What `benchmarks.cost.measure` returned.
    folder : Path
        Gets the picture as PNG.

    Returns
    -------
    Path
        Of the picture.
    """
    with style.drawing():
        figure = style.new_figure()
        axes = figure.add_subplot()
        ways = (
            ("plain", "trimesh and LaPy, full resolution", style.ORANGE, "s", "--"),
            ("proteus", "Proteus, both views and the descriptor", style.BLUE, "o", "-"),
        )
        for way, label, colour, marker, line in ways:
            groups: dict[str, list[tuple[int, float]]] = {}
            for one in found:
                if one[way]:
                    spent = (one[way]["vertices"], sum(one[way]["seconds"].values()))
                    groups.setdefault(one["group"], []).append(spent)
            loose = groups.pop("data", [])
            axes.plot(*zip(*loose, strict=True), marker, color=colour, alpha=0.35, markersize=4)
            middles = [
                (statistics.median(n for n, _ in spent), statistics.median(s for _, s in spent))
                for spent in groups.values()
            ]
            axes.plot(
                *zip(*sorted(middles), strict=True),
                line,
                marker=marker,
                color=colour,
                label=label,
            )
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="vertices of the file (lines: medians of creatures; dots: real meshes)",
            ylabel="seconds of one processor",
            title="From file to descriptor",
        )
        axes.legend(loc="lower right")
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{NAME}.png"
        figure.savefig(path, dpi=style.DPI, metadata={"Software": None})
    return path
