"""The page of formats is made from the tests."""

from tests.formats.document import PATH, document


def test_the_page_of_formats_is_up_to_date() -> None:
    assert PATH.read_text() == document(), "run `python -m tests.formats.document`"
