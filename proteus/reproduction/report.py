"""The report: what was done, what came out, and what differs from the paper and why."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from proteus.benchmark.plan import COMMON_AREA
from proteus.client import Document
from proteus.reproduction import page, paper
from proteus.reproduction.draw import Tables, slope
from proteus.reproduction.models import heat_time
from proteus.reproduction.pictures import Signature, histogram_overlap
from proteus.reproduction.plan import FINE, SMOOTHNESS
from proteus.reproduction.results import Results
from proteus.reproduction.tables import HEADINGS, MEAN, PAPER_HEADINGS, difference
from workers.geometry.views import LONGEST_LOOP

TITLE = "Learned diffusion kernels: the paper’s experiments again"
REASONS = {
    "failed": "could not be computed",
    "no-label": "have no label",
    "no-relevant-target": "have no null shape among the targets",
    "not-described": "have eigenvalues beyond the range that a learned kernel was learned on",
}
NAMED_SHAPES = 6
"""So many of the shapes that were left out are named."""

Figures = Mapping[str, tuple[Path, Path]]


def write_report(
    results: Results,
    tables: Tables,
    figures: Figures,
    signatures: Sequence[Signature],
    folder: Path,
) -> Path:
    """Write ``report.html``, all in one file; return its path.

    Parameters
    ----------
    results : Results
    tables : Tables
    figures : mapping
        The PNG and the SVG of ``figure1`` to ``figure5``.
    signatures : sequence of Signature
        Of Fig. 5: the null shape, then its transformations.
    folder : Path
        Where the report is written.
    """
    path = folder / "report.html"
    context = report_context(results, tables, figures, signatures)
    path.write_text(page.render("report.html", context), encoding="utf-8")
    return path


def report_context(
    results: Results, tables: Tables, figures: Figures, signatures: Sequence[Signature]
) -> dict[str, Any]:
    """Return every value that the template of the report names."""
    learned = results.models["learned"]
    return {
        "title": TITLE,
        "paper": paper,
        "counts": results.manifest["counts"],
        "parameters": results.manifest["parameters"],
        "summary": list(_summary(results, tables)),
        "facts": _facts(results),
        "left_out": list(_left_out(results)),
        "tables": tables,
        "headings": HEADINGS,
        "paper_headings": PAPER_HEADINGS,
        "gained": difference(tables.measured, tables.closed),
        "longest": f"{LONGEST_LOOP:g}",  # decision 8
        "best_time": f"{heat_time(results.models['heat-time']):.3g}",
        "figures": {name: {"png": png, "svg": svg} for name, (png, svg) in figures.items()},
        "fine": FINE,
        "smoothness": SMOOTHNESS,
        "slope": slope(results.models["scale-only"]),
        "criteria": list(_criteria(results)),
        "overlaps": [(s.name, histogram_overlap(signatures[0], s)) for s in signatures[1:]],
        "has_own_shapes": any("file" in shape["source"] for shape in results.manifest["shapes"]),
        "basis": {
            "functions": (learned.get("training") or {}).get("functions")
            or learned["parameters"].get("splines"),
            "smoothness": learned["parameters"].get("smoothness"),
        },
    }


def _summary(results: Results, tables: Tables) -> Iterator[str]:
    measured = tables.measured
    means = dict(zip(measured.columns, measured.rows[MEAN], strict=True))
    ranked = sorted((k for k in means if means[k] is not None), key=lambda k: -(means[k] or 0.0))
    order = "; ".join(f"{HEADINGS[key]}: {means[key]:.1f}" for key in ranked)
    best = heat_time(results.models["heat-time"])
    learned_slope = page.number(slope(results.models["scale-only"]), "%.3f")
    yield (
        "Learned from scaled shapes alone, ln K² falls against ln λ with slope "
        f"{learned_slope}; commute time has −1 (Fig. 3)."
    )
    yield (
        f"The best heat time is t* = {best:.3g}, in the square of the shapes’ unit, that is "
        f"{best / COMMON_AREA:.2g} of their area (the paper: {paper.BEST_TIME:g} in its unit)."
    )
    yield f"Mean of the rows of Table 1, per cent: {order}."
    yield from _against_commute(results)


def _against_commute(results: Results) -> Iterator[str]:
    """Say of both learned kernels how far they are from commute time, and how sure that is."""
    differences = results.open_evaluation.get("differences", {})
    for key in ("learned", "distance"):
        mean = differences.get(results.models[key]["name"], {}).get("mean_of_rows")
        if not mean:
            continue
        interval = ""
        if mean.get("low") is not None:
            bounds = f"{page.number(mean['low'], '%.1f')} to {page.number(mean['high'], '%.1f')}"
            interval = f" (95 % interval over shapes: {bounds})"
        points = page.number(mean["value"], "%.1f")
        yield f"“{HEADINGS[key]}” minus commute time: {points} points{interval}."


def _facts(results: Results) -> dict[str, str]:
    manifest = results.manifest
    training = results.models["learned"].get("training") or {}
    versions = results.facts.get("versions", {})
    return {
        "Size": str(results.facts.get("size", "")),
        "Query shapes": _shape_names(manifest),
        "Learned from": _learned_from(training),
        "Held out": ", ".join(training.get("held_out_classes") or []) or "nothing",
        "Seed": str(manifest["parameters"]["seed"]),
        "Versions": ", ".join(f"{name} {value}" for name, value in versions.items()),
        "Command": str(results.facts.get("command", "proteus reproduce")),
    }


def _shape_names(manifest: Document) -> str:
    failed = {failure["label"] for failure in manifest["failures"]}
    labels = [s["label"] for s in manifest["shapes"] if s["role"] == "query"]
    return ", ".join(label for label in labels if label not in failed)


def _learned_from(training: Document) -> str:
    classes = ", ".join(training.get("classes") or [])
    return f"{classes or 'creatures of other species'} ({training.get('n_pairs', '?')} pairs)"


def _left_out(results: Results) -> Iterator[str]:
    """Name every file that was not made and every shape that was no query, with the reason."""
    for failure in results.manifest["failures"]:
        yield f"{failure['label']}: {failure['transformation']}: {failure['reason']}"
    for pose in results.manifest["left_out"]:
        yield f"{pose['file']} is no pose: {pose['reason']}"
    yield from results.manifest["notes"]
    tables = (("Table 1", results.open_evaluation), ("holes closed", results.closed_evaluation))
    for name, evaluation in tables:
        for group in evaluation.get("skipped", []):
            reason = REASONS.get(group["reason"], group["reason"])
            some = ", ".join(str(shape["name"]) for shape in group["shapes"][:NAMED_SHAPES])
            more = ", …" if group["count"] > NAMED_SHAPES else ""
            yield f"{name}: {group['count']} shapes {reason} ({some}{more})"


def _criteria(results: Results) -> Iterator[dict[str, Any]]:
    """Criterion (7) of both learned kernels, on held-out classes where there are any."""
    for key, side in (("learned", "left"), ("distance", "right")):
        criterion = (results.models[key].get("training") or {}).get("criterion") or {}
        held_out = criterion.get("held-out")
        found = held_out or criterion.get("training")
        if found:
            yield {
                "side": side,
                "classes": "held-out classes" if held_out else "the classes learned from",
                "learned": found["learned"],
                "commute_time": found["commute-time"],
                "heat": found["heat"],
            }
