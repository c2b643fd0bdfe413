from html.parser import HTMLParser
from pathlib import Path

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


def test_a_page_is_whole_and_what_is_text_stays_text() -> None:
    reader = read_page(page.page("<b>&", [page.paragraph("a < b"), page.facts({"<i>": "&amp;"})]))
    texts = "".join(reader.texts)
    assert "a < b" in texts
    assert "<b>&" in texts
    assert "<i>" in texts
    assert "&amp;" in texts
    assert reader.tags[0] == ("html", {"lang": "en"})
    metas = [attributes for tag, attributes in reader.tags if tag == "meta"]
    assert {"name": "color-scheme", "content": "light dark"} in metas


def test_a_table_marks_the_best_of_each_row_and_names_rows_and_columns() -> None:
    text = page.table(NUMBERS, HEADINGS, caption="Measured & found")
    reader = read_page(text)
    assert text.count("<strong>") == 3
    assert "<strong>90.0</strong>" in text
    assert text.count("–") == 2
    assert "Micro holes" in reader.texts
    assert "Commute time" in reader.texts
    signed = page.table(NUMBERS, HEADINGS, caption="", form="{:+.1f}", marks_best=False)
    assert "<strong>" not in signed
    assert "+90.0" in signed


def test_a_figure_is_inside_the_page(tmp_path: Path) -> None:
    image = tmp_path / "dot.png"
    Image.new("RGB", (2, 2)).save(image)
    text = page.figure(image, alternative='a "dot"', caption="Fig. 0.")
    reader = read_page(text)
    source = next(attributes["src"] for tag, attributes in reader.tags if tag == "img")
    assert (source or "").startswith("data:image/png;base64,")
