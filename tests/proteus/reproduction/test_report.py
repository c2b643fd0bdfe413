from html.parser import HTMLParser
from pathlib import Path

import pytest
from jinja2 import UndefinedError
from PIL import Image

from proteus.reproduction import page
from proteus.reproduction.tables import HEADINGS, MEAN, Table

VOID = frozenset({"meta", "img", "br", "hr", "link", "input"})
NUMBERS = Table(
    ("learned", "commute"), {"micro-holes": [90.0, 80.0], "scale": [None, 5.0], MEAN: [None, 42.5]}
)


class Reader(HTMLParser):
    """Reads a page, and holds it to be well formed and to need nothing from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        for name, value in attrs:
            if name in {"src", "href", "srcset", "data"}:
                assert (value or "").startswith(("data:", "#"))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def read_page(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    reader.close()
    assert reader.open == []
    assert "script" not in {tag for tag, _ in reader.tags}
    assert "url(" not in text
    assert "@import" not in text
    for tag, attributes in reader.tags:
        if tag == "img":
            assert attributes["alt"]
        if tag == "th":
            assert attributes["scope"] in {"row", "col"}
    return reader


def rendered(source: str, **context: object) -> str:
    """What a template makes of its values, with the report's own parts."""
    path = "parts.html" if "(" in source else ""
    imported = f'{{% from "{path}" import bullets, figure, table with context %}}' if path else ""
    return page.environment().from_string(imported + source).render(context)


def test_a_page_is_whole_and_what_is_text_stays_text() -> None:
    text = rendered('{% extends "page.html" %}{% block body %}<p>{{ a }}</p>{% endblock %}',
                    title="<b>&", a="a < b, <i>, &amp;")  # fmt: skip
    reader = read_page(text)
    texts = "".join(reader.texts)
    assert "a < b, <i>, &amp;" in texts
    assert "<b>&" in texts
    assert reader.tags[0] == ("html", {"lang": "en"})
    metas = [attributes for tag, attributes in reader.tags if tag == "meta"]
    assert {"name": "color-scheme", "content": "light dark"} in metas


def test_a_value_that_is_missing_is_an_error_and_no_gap() -> None:
    with pytest.raises(UndefinedError, match="'summary' is undefined"):
        rendered("{{ summary }}")


def test_a_table_marks_the_best_of_each_row_and_names_rows_and_columns() -> None:
    values = {"numbers": NUMBERS, "headings": HEADINGS}
    text = rendered("{{ table(numbers, headings, 'Measured & found') }}", **values)
    reader = read_page(text)
    assert text.count("<strong>") == 3
    assert "<strong>90.0</strong>" in text
    assert text.count("–") == 2
    assert "Micro holes" in reader.texts
    assert "Commute time" in reader.texts
    assert "Measured & found" in reader.texts
    assert text.count('class="mean"') == 1
    signed = rendered("{{ table(numbers, headings, '', '%+.1f', marks_best=false) }}", **values)
    assert "<strong>" not in signed
    assert "+90.0" in signed


@pytest.mark.parametrize(
    ("value", "shown"), [(-0.04, "0.0"), (-1.26, "−1.3"), (None, "–"), (7.0, "7.0")]
)
def test_a_number_has_a_true_minus_and_no_negative_zero(value: float | None, shown: str) -> None:
    assert page.number(value, "%.1f") == shown


def test_a_figure_is_inside_the_page(tmp_path: Path) -> None:
    image = tmp_path / "dot.png"
    Image.new("RGB", (2, 2)).save(image)
    text = rendered("{% call figure(image, alternative) %}Fig. 0.{% endcall %}",
                    image=image, alternative='a "dot"')  # fmt: skip
    reader = read_page(text)
    attributes = next(attributes for tag, attributes in reader.tags if tag == "img")
    assert (attributes["src"] or "").startswith("data:image/png;base64,")
    assert attributes["alt"] == 'a "dot"'
    assert "Fig. 0." in reader.texts
