"""Keyset pages: a cursor says after which id to go on, so that no row is skipped or doubled."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar
from urllib.parse import quote, unquote

from workers.errors import InvalidRequestError

Row = TypeVar("Row")
CURSOR_PATTERN = r"^([2-7][0-9a-f])*$"
"""Every cursor of this form is one; see `encode_cursor`."""
MOST_CURSOR = 4800
"""Characters of a cursor: a key has at most 200, each at most 12 in a URL, each of these two."""


@dataclass(frozen=True)
class Page(Generic[Row]):
    """Rows of one page and the cursor of the next, None at the end."""

    items: Sequence[Row]
    next_cursor: str | None


def encode_cursor(key: str) -> str:
    """Make an opaque cursor of the last row's key.

    It is the key as in a URL, in hexadecimal digits of its ASCII codes. So there is no text of
    the declared form that is no cursor.

    Parameters
    ----------
    key : str
        What rows are sorted by.

    Returns
    -------
    Text of `CURSOR_PATTERN`.
    """
    return quote(key, safe=" ").encode("ascii").hex()


def decode_cursor(cursor: str | None) -> str | None:
    """Read a cursor.

    Parameters
    ----------
    cursor : str or None
        As `encode_cursor` made it.

    Returns
    -------
    The key after which the page begins; None for no cursor, or an empty one.

    Raises
    ------
    InvalidRequestError
        It is not of the form of a cursor.
    """
    if not cursor:
        return None
    if len(cursor) > MOST_CURSOR or not re.fullmatch(CURSOR_PATTERN, cursor):
        raise InvalidRequestError(f"the cursor {cursor[:40]!r} is none that was given")
    return unquote(bytes.fromhex(cursor).decode("ascii")).replace("\x00", "\ufffd")


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
