"""Numbers in text as programs of all languages print them, in the spelling of Python."""

import re

NOT_A_NUMBER = re.compile(
    rb"[-+]?(?:nanq?s?(?:\([^)]*\))?|1[.,]#(?:q|s|i(?!nf))\S*|1[.,]#?[$j]\S*)", re.IGNORECASE
)
INFINITE = re.compile(rb"([-+]?)(?:1[.,]#inf\S*|inf(?:inity)?|\xe2\x88\x9e)", re.IGNORECASE)
FORTRAN = re.compile(rb"([-+]?[\d.]+)[dq]([-+]?\d+)", re.IGNORECASE)
WITH_NUMBER_SIGN = re.compile(rb"(?<!\S)[-+]?1[.,]#[a-z]\S*", re.IGNORECASE)
FOLLOWED_BY_BLANK = re.compile(rb"[,;](?=\s|\Z)")


def respelled(token: bytes) -> bytes:
    """Spell a number as Python does: ``1.5d+03``, ``-nan(ind)``, ``1.#QNAN``, ``1.#INF``.

    Parameters
    ----------
    token : bytes
        What stands between blanks.

    Returns
    -------
    bytes
        The same number, or the token itself where it is of no known spelling.
    """
    if NOT_A_NUMBER.fullmatch(token):
        return b"nan"
    if found := INFINITE.fullmatch(token):
        return found[1] + b"inf"
    if found := FORTRAN.fullmatch(token):
        return found[1] + b"e" + found[2]
    return token


def without_number_signs(text: bytes) -> bytes:
    """Spell ``1.#QNAN`` and ``1.#INF`` as Python does, where ``#`` would begin a comment.

    Parameters
    ----------
    text : bytes
        The whole file.

    Returns
    -------
    bytes
        The text itself where there are none.
    """
    if b".#" not in text and b",#" not in text:
        return text
    return WITH_NUMBER_SIGN.sub(lambda found: respelled(found[0]), text)


def with_decimal_points(text: bytes) -> tuple[bytes, tuple[str, ...]]:
    """Turn decimal commas into points, and commas between numbers into blanks.

    Parameters
    ----------
    text : bytes
        Rows of at least three numbers each.

    Returns
    -------
    text : bytes
        The same rows.
    repairs : tuple of str
        What was done, in a sentence for people; empty if nothing.
    """
    if b"," not in text and b";" not in text:
        return text, ()
    text = FOLLOWED_BY_BLANK.sub(b" ", text).replace(b";", b" ")
    if b"," not in text:
        return text, ("read commas between numbers as blanks",)
    if len(text.lstrip().split(b"\n", 1)[0].split()) < 3:
        return text.replace(b",", b" "), ("read commas between numbers as blanks",)
    if re.search(rb"\d,\d+\.", text):
        return text.replace(b",", b""), ("left out the commas between thousands",)
    if re.search(rb"\.\d+,", text):
        text = text.replace(b".", b"")
    return text.replace(b",", b"."), ("read decimal commas as points",)
