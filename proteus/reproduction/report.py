"""The report: what was done, what came out, and what differs from the paper and why."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from proteus.benchmark.plan import COMMON_AREA
from proteus.client import Document
from proteus.reproduction import page, paper
from proteus.reproduction.asking import heat_time
from proteus.reproduction.draw import Tables, slope
from proteus.reproduction.pictures import Signature, histogram_overlap
from proteus.reproduction.plan import FINE, SMOOTHNESS
from proteus.reproduction.results import Results
from proteus.reproduction.tables import HEADINGS, MEAN, PAPER_HEADINGS, Table, difference

TITLE = "Learned diffusion kernels: the paper’s experiments again"
REASONS = {
    "failed": "could not be computed",
    "no-label": "have no label",
    "no-relevant-target": "have no null shape among the targets",
    "not-described": "lie outside what a learned kernel knows: their eigenvalues are beyond the "
    "range it was learned on",
}

Figures = Mapping[str, tuple[Path, Path]]


def write_report(
    results: Results,
    tables: Tables,
    figures: Figures,
    signatures: Sequence[Signature],
    folder: Path,
) -> Path:
    """Write ``report.html``, all in one file; return its path."""
    parts = [
        f"<h1>{TITLE}</h1>",
        page.paragraph(f"{paper.AUTHORS}, “{paper.TITLE}”.", quiet=True),
        *_summary(results, tables),
        *_what_was_done(results),
        *_table_section(results, tables),
        *_closed_section(results, tables),
        *_figure_section(results, figures, signatures),
        *_differences(results),
    ]
    path = folder / "report.html"
    path.write_text(page.page(TITLE, parts), encoding="utf-8")
    return path


def _summary(results: Results, tables: Tables) -> Iterator[str]:
    measured = tables.measured
    means = dict(zip(measured.columns, measured.rows[MEAN], strict=True))
    ranked = sorted((k for k in means if means[k] is not None), key=lambda k: -(means[k] or 0.0))
    order = "; ".join(f"{HEADINGS[key]}: {means[key]:.1f}" for key in ranked)
    best = heat_time(results.models["heat-time"])
    yield page.bullets(
        [
            "Learned from scaled shapes alone, ln K² falls against ln λ with slope "
            f"{_number(slope(results.models['scale-only']), 3)}; commute time has −1 (Fig. 3).",
            f"The best heat time is t* = {best:.3g}, in the square of the shapes’ unit, that is "
            f"{best / COMMON_AREA:.2g} of their area (the paper: {paper.BEST_TIME:g} in its unit).",
            f"Mean of the rows of Table 1, per cent: {order}.",
            *_against_commute(results.open_evaluation, results),
        ]
    )


def _against_commute(evaluation: Document, results: Results) -> Iterator[str]:
    """Say of both learned kernels how far they are from commute time, and how sure that is."""
    for key in ("learned", "distance"):
        found = evaluation.get("differences", {}).get(results.models[key]["name"], {})
        mean = found.get("mean_of_rows")
        if not mean:
            continue
        sure = ""
        if mean.get("low") is not None:
            bounds = f"{_number(mean['low'], 1)} to {_number(mean['high'], 1)}"
            sure = f" (95 % interval over shapes: {bounds})"
        yield f"“{HEADINGS[key]}” minus commute time: {_number(mean['value'], 1)} points{sure}."


def _what_was_done(results: Results) -> Iterator[str]:
    manifest, counts = results.manifest, results.manifest["counts"]
    parameters = manifest["parameters"]
    training = results.models["learned"].get("training") or {}
    strengths = ", ".join(str(s) for s in parameters["strengths"])
    yield page.heading("What was done")
    yield page.paragraph(
        f"{counts['nulls']} shapes were each changed in {len(parameters['transformations'])} ways "
        f"at strengths {strengths}: {counts['queries']} queries. Each asks which of "
        f"{counts['nulls'] + counts['distractors']} unchanged shapes it was, among them "
        f"{counts['distractors']} that are never right. One shape is right, so that average "
        "precision is 1/rank. All shapes were brought to the same area, since heat times and "
        "kernels in raw units need a common unit of length, as the paper’s shapes have it. "
        "Shapes are compared by the L1 distance of histograms of diffusion distances."
    )
    yield page.facts(
        {
            "Size": str(results.facts.get("size", "")),
            "Query shapes": _shape_names(manifest),
            "Learned from": _learned_from(training),
            "Held out": ", ".join(training.get("held_out_classes") or []) or "nothing",
            "Seed": str(parameters["seed"]),
            "Versions": ", ".join(
                f"{name} {value}" for name, value in results.facts.get("versions", {}).items()
            ),
            "Again": str(results.facts.get("command", "proteus reproduce")),
        }
    )
    left_out = list(_left_out(results))
    if left_out:
        yield page.paragraph("What was left out:")
        yield page.bullets(left_out)


def _shape_names(manifest: Document) -> str:
    failed = {failure["label"] for failure in manifest["failures"]}
    labels = [s["label"] for s in manifest["shapes"] if s["role"] == "query"]
    return ", ".join(label for label in labels if label not in failed)


def _learned_from(training: Document) -> str:
    classes = ", ".join(training.get("classes") or [])
    return f"{classes or 'creatures of other species'} ({training.get('n_pairs', '?')} pairs)"


def _left_out(results: Results) -> Iterator[str]:
    """Say everything that was not made or not asked, and what to know of the classes."""
    for failure in results.manifest["failures"]:
        yield f"{failure['label']}: {failure['transformation']}: {failure['reason']}"
    for pose in results.manifest["left_out"]:
        yield f"{pose['file']} is no pose: {pose['reason']}"
    yield from results.manifest["notes"]
    tables = (("Table 1", results.open_evaluation), ("holes closed", results.closed_evaluation))
    for name, evaluation in tables:
        for group in evaluation.get("skipped", []):
            why = REASONS.get(group["reason"], group["reason"])
            some = ", ".join(str(shape["name"]) for shape in group["shapes"][:6])
            more = ", …" if group["count"] > 6 else ""
            yield f"{name}: {group['count']} shapes {why} ({some}{more})"


def _table_section(results: Results, tables: Tables) -> Iterator[str]:
    yield page.heading("Table 1")
    best = heat_time(results.models["heat-time"])
    yield page.table(
        tables.measured,
        HEADINGS,
        caption=f"Measured: mean average precision in per cent, meshes left as they are; "
        f"t* = {best:.3g}",
    )
    yield page.table(
        tables.paper, PAPER_HEADINGS, caption="The paper’s numbers, on its own shapes, in per cent"
    )
    yield page.paragraph(
        "The best of each row is bold. “All” is everything at once, not a mean. The mean of the "
        "rows is not in the paper; by it, commute time, which is not learned, is its best column. "
        "The shapes are others, so that the differences between columns can be compared, not the "
        "numbers themselves."
    )


def _closed_section(results: Results, tables: Tables) -> Iterator[str]:
    gained = difference(tables.measured, tables.closed)
    yield page.heading("Holes closed")
    yield page.paragraph(
        "The same shapes and columns, but every hole that is round enough (isoperimetric quotient "
        "at least 0.1) was closed before anything was computed. Heat times are the same; both "
        "learned kernels were learned again, on closed shapes."
    )
    yield page.table(tables.closed, HEADINGS, caption="Holes closed: per cent")
    yield page.table(
        Table(gained.columns, gained.rows),
        HEADINGS,
        caption="Holes closed minus Table 1, in points",
        form="{:+.1f}",
        marks_best=False,
    )


def _figure_section(
    results: Results, figures: Figures, signatures: Sequence[Signature]
) -> Iterator[str]:
    png = {name: paths[0] for name, paths in figures.items()}
    svg = {name: paths[1] for name, paths in figures.items()}
    yield page.heading("Figures")
    yield page.figure(
        svg["figure1"],
        alternative="Three curves of K² and of λK² against λ: a grid with nearest neighbour "
        "interpolation, splines without and with smoothness.",
        caption="Fig. 1. The kernel that is learned from all transformations, by three ways of "
        f"interpolation with {FINE} functions each; smoothness {SMOOTHNESS:g} of "
        "trace(P)/trace(R). K² is scaled so that the mean squared distance is 1. The kernels of "
        "the other figures have fewer splines, which serve retrieval better.",
    )
    yield page.figure(
        png["figure2"],
        alternative="A shape, unchanged and under each transformation.",
        caption="Fig. 2. The first query shape and its transformations at strength "
        f"{max(results.manifest['parameters']['strengths'])}.",
    )
    yield page.figure(
        svg["figure3"],
        alternative="Two curves of K² against λ that fall together on logarithmic axes.",
        caption="Fig. 3. Learned from scaled shapes alone, against commute time; slope "
        f"{_number(slope(results.models['scale-only']), 3)}.",
    )
    yield page.figure(
        svg["figure4"],
        alternative="Two pairs of curves of K²: learned, and commute time, on logarithmic axes.",
        caption="Fig. 4. Learned from all transformations, against commute time. Left as in the "
        "paper, right on distances in λ/λ₁: past the paper. " + _criteria(results),
    )
    yield page.figure(
        png["figure5"],
        alternative="Shapes coloured by k(x, x), and below them histograms of its values that "
        "nearly cover each other.",
        caption="Fig. 5. k(x, x) of the kernel learned as in the paper, on a shape and two "
        "transformations of it; below, how its values are distributed. " + _overlaps(signatures),
    )


def _criteria(results: Results) -> str:
    told = []
    for key, name in (("learned", "left"), ("distance", "right")):
        criterion = ((results.models[key].get("training") or {}).get("criterion")) or {}
        found = criterion.get("held-out") or criterion.get("training")
        if found:
            where = "held-out classes" if criterion.get("held-out") else "the classes learned from"
            told.append(
                f"Criterion (7) on {where}, {name}: learned {found['learned']:.3g}, "
                f"commute time {found['commute-time']:.3g}, heat {found['heat']:.3g}."
            )
    return " ".join(told)


def _overlaps(signatures: Sequence[Signature]) -> str:
    first, *others = signatures
    told = [f"{100 * histogram_overlap(first, one):.0f} % with {one.name}" for one in others]
    return f"The histogram of the null shape shares of its area {' and '.join(told)}."


def _differences(results: Results) -> Iterator[str]:
    own = any("file" in shape["source"] for shape in results.manifest["shapes"])
    shapes = "shapes of a folder" if own else "procedural creatures"
    yield page.heading("What differs from the paper, and why")
    yield page.bullets(
        [
            f"The shapes are {shapes}, not those of SHREC’10, and the transformations are made by "
            "Proteus after the paper’s Fig. 2 and the published sets. The absolute numbers depend "
            "on both.",
            "What is learned from are creatures of other species than those asked with: no class "
            "is in both.",
            "Criterion (7) is taken over all pairs of points in closed form, not over a sample; "
            "distributions are weighted by area, with no random points: a scaled copy scores 100 "
            "under a kernel that does not see scale.",
            f"K² ≥ 0 holds everywhere; {_basis(results)}.",
            "The sixth column and the right of Fig. 4 are not in the paper: the same idea, learned "
            "on squared distances instead of k(x, x′) and in λ/λ₁ instead of λ.",
        ]
    )
    yield page.heading("Slips of the paper, as they were settled")
    yield page.bullets(paper.SLIPS)


def _basis(results: Results) -> str:
    """Say in what the learned kernel is written."""
    model = results.models["learned"]
    count = (model.get("training") or {}).get("functions") or model["parameters"].get("splines")
    smoothness = model["parameters"].get("smoothness")
    share = "" if smoothness is None else f", with smoothness {smoothness:g} of trace(P)/trace(R)"
    return f"it is made of {count or 'some'} cubic splines in ln λ{share}"


def _number(value: float, places: int) -> str:
    """Return a number with a minus sign that is one."""
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", "−")
