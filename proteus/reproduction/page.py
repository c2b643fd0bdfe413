"""The report's page: one HTML file that needs neither network nor JavaScript."""

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template

from proteus.reproduction.tables import MEAN, Table

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title</title>
<style>
:root {
  --ground: #ffffff; --text: #1b1d21; --quiet: #565c66; --line: #d9dce1; --band: #f4f5f7;
  --accent: #00598c;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #16181c; --text: #e7e9ec; --quiet: #a4abb6; --line: #383d45; --band: #1f2227;
    --accent: #7cc4f0;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 62rem; background: var(--ground);
  color: var(--text); font: 1rem/1.55 system-ui, sans-serif;
}
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; margin: 2.6rem 0 .6rem; padding-top: .6rem;
     border-top: 1px solid var(--line); }
p, li { max-width: 46rem; }
a { color: var(--accent); }
.quiet { color: var(--quiet); }
figure { margin: 1rem 0 2rem; }
figure img { display: block; max-width: 100%; height: auto; background: #fff; padding: .5rem;
             border: 1px solid var(--line); border-radius: 6px; }
figcaption { margin-top: .5rem; max-width: 46rem; color: var(--quiet); }
.wide { overflow-x: auto; margin: 1rem 0 1.6rem; }
.wide:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding: 0 0 .5rem; color: var(--quiet); }
caption span { display: block; max-width: calc(100vw - 2.5rem); position: sticky; left: 0; }
th, td { padding: .3rem .7rem; border-bottom: 1px solid var(--line); text-align: right;
         vertical-align: bottom; }
th[scope="row"], thead th:first-child { text-align: left; white-space: nowrap; }
thead th { border-bottom: 2px solid var(--quiet); font-size: .9rem; }
tbody tr:nth-child(even) { background: var(--band); }
tbody tr.mean th, tbody tr.mean td { border-top: 2px solid var(--quiet); }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1rem; max-width: 46rem; }
dt { font-weight: 600; } dd { margin: 0; overflow-wrap: anywhere; }
@media (max-width: 34rem) { dl { grid-template-columns: 1fr; } dd { margin: 0 0 .5rem; }
  th, td { padding: .3rem .45rem; } }
@media print { body { max-width: none; } h2 { break-after: avoid; } figure, table
  { break-inside: avoid; } }
</style>
</head>
<body>
<main>
$body
</main>
</body>
</html>
""")


def page(title: str, parts: Sequence[str]) -> str:
    """Return the whole page from parts that are HTML already."""
    return PAGE.substitute(title=escape(title), body="\n".join(parts))


def paragraph(text: str, *, quiet: bool = False) -> str:
    """Return a paragraph of plain text."""
    return f'<p class="quiet">{escape(text)}</p>' if quiet else f"<p>{escape(text)}</p>"


def heading(text: str) -> str:
    """Return a heading of a section."""
    return f"<h2>{escape(text)}</h2>"


def bullets(texts: Sequence[str]) -> str:
    """Return a list."""
    items = "\n".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<ul>\n{items}\n</ul>"


def facts(pairs: Mapping[str, str]) -> str:
    """Return names and values."""
    items = "\n".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in pairs.items())
    return f"<dl>\n{items}\n</dl>"


def figure(image: Path, *, alternative: str, caption: str) -> str:
    """Return a picture with its caption, the file inside the page."""
    kind = {"svg": "image/svg+xml", "png": "image/png"}[image.suffix[1:]]
    data = base64.b64encode(image.read_bytes()).decode("ascii")
    return (
        f'<figure>\n<img src="data:{kind};base64,{data}" alt="{escape(alternative)}">\n'
        f"<figcaption>{escape(caption)}</figcaption>\n</figure>"
    )


def table(
    found: Table,
    headings: Mapping[str, str],
    *,
    caption: str,
    form: str = "{:.1f}",
    marks_best: bool = True,
) -> str:
    """Return a table of numbers, the best of each row bold unless that means nothing."""
    head = "".join(f'<th scope="col">{escape(headings[key])}</th>' for key in found.columns)
    rows = "\n".join(_row(found, name, form, marks_best=marks_best) for name in found.rows)
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{escape(caption)}">\n<table>\n'
        f"<caption><span>{escape(caption)}</span></caption>\n"
        f'<thead><tr><th scope="col">Transformation</th>{head}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody>\n</table>\n</div>"
    )


def _row(found: Table, name: str, form: str, *, marks_best: bool) -> str:
    best = found.best(name) if marks_best else set()
    cells = []
    for i, number in enumerate(found.rows[name]):
        text = "–" if number is None else form.format(number).replace("-", "−")
        cells.append(f"<td><strong>{text}</strong></td>" if i in best else f"<td>{text}</td>")
    mark = ' class="mean"' if name == MEAN else ""
    label = escape(name.replace("-", " ").capitalize())
    return f'<tr{mark}><th scope="row">{label}</th>{"".join(cells)}</tr>'
