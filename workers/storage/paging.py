"""Keyset pages: a cursor says after which id to go on, so that no row is skipped or doubled."""

import base64
import binascii
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from workers.errors import InvalidRequestError

Row = TypeVar("Row")
MOST_KEY = 200
"""Characters of a row's key."""
MOST_CURSOR = -(-4 * 4 * MOST_KEY // 3)
"""Characters of a cursor: base64 makes four of three bytes, and a character has at most four."""


@dataclass(frozen=True)
class Page(Generic[Row]):
    """Rows of one page and the cursor of the next, None at the end."""

    items: Sequence[Row]
    next_cursor: str | None


def encode_cursor(key: str) -> str:
    """Make an opaque cursor of the last row's key.

    Parameters
    ----------
    key : str
        The id or name that the page ends with.

    Returns
    -------
    Text that stands in a URL as it is.
    """
    return base64.urlsafe_b64encode(key.encode()).decode().rstrip("=")


def decode_cursor(cursor: str | None) -> str | None:
    """Read a cursor.

    Parameters
    ----------
    cursor : str or None
        What `encode_cursor` gave; None for the first page.

    Returns
    -------
    The key after which the page begins; None for the first page.

    Raises
    ------
    InvalidRequestError
        It is none that Proteus gave.
    """
    if cursor is None:
        return None
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        key = base64.b64decode(padded.encode(), altchars=b"-_", validate=True).decode()
    except (binascii.Error, UnicodeError):
        raise InvalidRequestError(f"the cursor {cursor[:40]!r} is none that was given") from None
    if not key or "\x00" in key or len(key) > MOST_KEY:
        raise InvalidRequestError(f"the cursor {cursor[:40]!r} is none that was given")
    return key


def cut_page(rows: Sequence[Row], limit: int, key: Callable[[Row], str]) -> Page[Row]:
    """Make a page from rows that were read with one more than its limit.

    Parameters
    ----------
    rows : sequence
        At most ``limit + 1`` rows, in the order of the list.
    limit : int
        At most so many stand on the page.
    key : callable
        From a row to the id or name by which the list is ordered.

    Returns
    -------
    The page, with a cursor if there are more rows.
    """
    if len(rows) <= limit:
        return Page(rows, None)
    return Page(rows[:limit], encode_cursor(key(rows[limit - 1])))
