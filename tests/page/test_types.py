"""The page's types and endings beside the service's own, without the generator and without Node."""

import re
from pathlib import Path
from typing import Any

import pytest

from service.web import endings, schema

WEB = Path(schema.FOLDER)
NAMES = re.compile(r"^        (\w+): \{", re.MULTILINE)
FIELDS = re.compile(r"^            \"?([\w-]+)\"?\??: ", re.MULTILINE)


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    found: dict[str, Any] = schema.schemas()["components"]["schemas"]
    return found


@pytest.fixture(scope="module")
def text() -> str:
    return schema.TYPES.read_text(encoding="utf-8")


def test_every_schema_and_its_fields_are_among_the_types(
    document: dict[str, Any], text: str
) -> None:
    """`python -m service.web --check` compares the rest, with the generator."""
    parts = NAMES.split(text[text.index("schemas: {") : text.index("responses: ")])
    fields = {
        name: set(FIELDS.findall(body)) for name, body in zip(parts[1::2], parts[2::2], strict=True)
    }
    assert set(fields) == {name for name, found in document.items() if "properties" in found}
    for name, found in fields.items():
        assert found == set(document[name]["properties"]), name


def test_the_page_names_only_types_that_there_are(document: dict[str, Any]) -> None:
    aliases = (WEB / "src" / "api" / "types.ts").read_text(encoding="utf-8")
    named = set(re.findall(r"(?:Schemas\[|Answer<)\"(\w+)\"", aliases))
    assert len(named) > 15
    assert named <= set(document)


def test_examples_are_no_part_of_a_type_but_a_field_may_be_called_so() -> None:
    assert '"example' not in str(schema.schemas()).replace("'", '"')
    kept = schema.without_examples(
        {"properties": {"examples": {"type": "string", "examples": ["a"]}}, "example": 1}
    )
    assert kept == {"properties": {"examples": {"type": "string"}}}


def test_other_types_than_the_service_has_are_refused(
    monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setattr(schema, "generate", lambda: text)
    schema.check_types()
    outdated = WEB / "src" / "api" / "none.ts"
    monkeypatch.setattr(schema, "TYPES", outdated)
    with pytest.raises(schema.OutdatedTypesError, match="--types"):
        schema.check_types()


def test_the_page_knows_the_endings_that_the_service_knows(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    endings.check_endings()
    text = endings.generate()
    assert all(f'"{ending}"' in text for ending in ("off", "gltf", "zip", "tgz", "gz", "png"))
    monkeypatch.setattr(endings, "ENDINGS", tmp_path / "endings.ts")
    with pytest.raises(endings.OutdatedEndingsError, match="--types"):
        endings.check_endings()
    endings.write_endings()
    endings.check_endings()


def test_the_generators_lock_names_no_registry() -> None:
    for folder in (WEB, schema.GENERATOR):
        assert "resolved" not in (folder / "package-lock.json").read_text(encoding="utf-8")
