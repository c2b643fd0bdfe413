"""Pages of lists, and times."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Generic, TypeVar

from pydantic import Field

from service.schemas.text import Answer
from workers.storage.paging import Page

Row = TypeVar("Row")
Item = TypeVar("Item")


class PageAnswer(Answer, Generic[Item]):
    """Some items of a list; `next_cursor` asks for those after them, null at the end."""

    items: list[Item]
    next_cursor: str | None = Field(examples=[None, "7a65627261"])


def answer_page(page: Page[Row], convert: Callable[[Row], Item]) -> PageAnswer[Item]:
    """Convert a page of rows."""
    items = [convert(row) for row in page.items]
    return PageAnswer(items=items, next_cursor=page.next_cursor)


def time_from(seconds: float) -> datetime:
    """Return seconds since 1970 as a time in UTC."""
    return datetime.fromtimestamp(seconds, UTC)


def time_or_none(seconds: float | None) -> datetime | None:
    """Return seconds since 1970 as a time in UTC, None for None."""
    return None if seconds is None else time_from(seconds)
