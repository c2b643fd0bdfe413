"""Figures and tables of a reproduction, from its results."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from proteus.benchmark.build import Built
from proteus.client import Document
from proteus.reproduction import curves, pictures, style
from proteus.reproduction.models import kernel_of, trained_range
from proteus.reproduction.results import Results, model_names
from proteus.reproduction.tables import (
    COLUMNS,
    HEADINGS,
    PAPER_HEADINGS,
    Table,
    measured_table,
    paper_table,
)
from workers.diffusion.kernels import evaluate
from workers.geometry.formats import parse
from workers.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVE_POINTS = 1500
CURVE_NAMES: Mapping[str, str] = {
    "grid": "grid, nearest neighbour",
    "rough": "splines without smoothness",
    "smooth": "splines with smoothness",
}


@dataclass(frozen=True)
class Tables:
    """Table 1 as measured, the paper's, and the table of closed shapes."""

    measured: Table
    paper: Table
    closed: Table


def make_tables(results: Results) -> Tables:
    """Return all tables of the results."""
    names = model_names(results.models, COLUMNS)
    measured = measured_table(results.open_evaluation, names)
    closed_names = model_names(results.closed, COLUMNS)
    closed = measured_table(results.closed_evaluation, closed_names)
    return Tables(measured, paper_table(list(measured.rows)), closed)


def save_tables(tables: Tables, folder: Path) -> None:
    """Write all tables as CSV, and table1.json with all of them."""
    named = (("table1", tables.measured), ("table1-closed", tables.closed))
    for name, found in named:
        (folder / f"{name}.csv").write_text(found.to_csv(HEADINGS))
    (folder / "table1-paper.csv").write_text(tables.paper.to_csv(PAPER_HEADINGS))
    document = {
        "unit": "mean average precision, per cent",
        "columns": dict(HEADINGS),
        "measured": tables.measured.to_json(),
        "holes_closed": tables.closed.to_json(),
        "paper": tables.paper.to_json(),
    }
    (folder / "table1.json").write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n")


def draw_figures(
    results: Results, signatures: Sequence[pictures.Signature], built: Built, folder: Path
) -> dict[str, tuple[Path, Path]]:
    """Draw Figs. 1 to 5; return the PNG and the SVG of each by name."""
    models = results.models
    with style.drawing():
        learned = trained_curve(models["learned"], "learned from all transformations")
        drawn: dict[str, Figure] = {
            "figure1": curves.draw_interpolations(
                *(trained_curve(models[key], name) for key, name in CURVE_NAMES.items())
            ),
            "figure2": pictures.draw_transformations(_strongest(built), columns=6),
            "figure3": curves.draw_scale_only(
                trained_curve(models["scale-only"], "learned from scaled shapes"),
                slope=slope(models["scale-only"]),
            ),
            "figure4": curves.draw_learned(
                learned, trained_curve(models["distance"], "learned from all transformations")
            ),
            "figure5": pictures.draw_signatures(signatures),
        }
        return {name: style.save_figure(it, folder, name) for name, it in drawn.items()}


def trained_curve(model: Document, name: str) -> curves.Curve:
    """Return K² of a model over the eigenvalues that it was learned from."""
    eigenvalues = np.geomspace(*trained_range(model), CURVE_POINTS)
    return curves.Curve(name, eigenvalues, evaluate(kernel_of(model), eigenvalues))


def slope(model: Document) -> float:
    """Return the slope of ln K² against ln λ over the eigenvalues learned from."""
    known = (model.get("training") or {}).get("slope")
    return float(known) if known is not None else curves.loglog_slope(trained_curve(model, ""))


def _strongest(built: Built) -> list[tuple[str, TriangleMesh]]:
    """Return the first shape as it is and under every transformation at the largest strength."""
    parameters = built.manifest["parameters"]
    strength = max(parameters["strengths"])
    made = set(built.manifest["files"])
    labels = [s["label"] for s in built.manifest["shapes"] if s["role"] == "query"]
    label = next(name for name in labels if f"{name}.null.0.ply" in made)
    names = {"null": f"{label}.null.0.ply"}
    names |= {how: f"{label}.{how}.{strength}.ply" for how in parameters["transformations"]}
    return [
        (how.replace("-", " "), parse((built.folder / name).read_bytes(), filename=name).mesh)
        for how, name in names.items()
        if name in made
    ]
