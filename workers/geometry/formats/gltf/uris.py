"""What the URIs of a glTF file point to: data within it, or files beside it."""

import base64
import binascii
import posixpath
import re
import unicodedata
from collections.abc import Iterable
from urllib.parse import unquote, unquote_to_bytes

from workers.errors import InvalidMeshError

DATA = re.compile(r"\s*data:", re.IGNORECASE)
SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")  # two letters or more: C: is a disk
FILE = re.compile(r"file:/*", re.IGNORECASE)
URL_SAFE = str.maketrans("-_", "+/")


def is_data(uri: str) -> bool:
    """Tell whether a URI holds its data itself.

    Parameters
    ----------
    uri : str
        As in the file.

    Returns
    -------
    bool
        True for ``data:`` in upper or lower case.
    """
    return DATA.match(uri) is not None


def is_relative(uri: str) -> bool:
    """Tell whether a URI names a file that could have come along.

    Parameters
    ----------
    uri : str
        As in the file.

    Returns
    -------
    bool
        False for ``data:``, ``http:`` and other schemes; True for ``file:``.
    """
    return SCHEME.match(uri) is None or FILE.match(uri) is not None


def file_name(uri: str) -> str:
    """Path that a URI names.

    Parameters
    ----------
    uri : str
        A relative URI, or one of a file.

    Returns
    -------
    str
        Percent-decoded, without "./" and "file:".
    """
    return unquote(FILE.sub("", uri)).removeprefix("./")


def decode_data(uri: str) -> bytes:
    """Bytes of a ``data:`` URI.

    Parameters
    ----------
    uri : str
        Of Base64, in either alphabet and with or without padding, or percent-encoded.

    Returns
    -------
    bytes
        Never more than the URI has characters.

    Raises
    ------
    InvalidMeshError
        Damaged Base64.
    """
    head, _, body = uri.partition(",")
    if not head.rstrip().lower().endswith(";base64"):
        return unquote_to_bytes(body)
    if "%" in body[:100] or "%" in body[-100:]:
        body = unquote(body)
    if "-" in body or "_" in body:
        body = body.translate(URL_SAFE)
    try:
        return base64.b64decode(body + "==", validate=False)
    except (binascii.Error, ValueError) as error:
        raise InvalidMeshError(f"an embedded buffer of the glTF file is damaged: {error}") from None


class FileNames:
    """Files by the names that a document may have for them.

    Parameters
    ----------
    names : iterable of str
        Paths of the files that came along.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self._names = set(names)
        self._loosely: dict[str, set[str]] = {}
        for name in self._names:
            for key in {_folded(name), _folded(posixpath.basename(_folded(name)))}:
                self._loosely.setdefault(key, set()).add(name)

    def find(self, uri: str) -> str | None:
        """Name of the file that a URI means.

        Parameters
        ----------
        uri : str
            As in the document.

        Returns
        -------
        str or None
            The exact name, or that percent-decoded; or else the only one that is the same without
            regard to case, or the only one with this base name. None where there is none, or
            where it is not clear.
        """
        for name in (uri, file_name(uri)):
            if name in self._names:
                return name
        folded = _folded(file_name(uri))
        for key in (folded, posixpath.basename(folded)):
            found = self._loosely.get(key, set())
            whole = {name for name in found if _folded(name) == key}
            for candidates in (whole, found):
                if len(candidates) == 1:
                    return next(iter(candidates))
        return None


def _folded(name: str) -> str:
    """Name without regard to case, slashes, and how accents are encoded."""
    path = posixpath.normpath(unicodedata.normalize("NFC", name).replace("\\", "/"))
    return path.casefold()


def missing_file(uri: str) -> InvalidMeshError:
    """Return the error for a buffer whose file is not there.

    Parameters
    ----------
    uri : str
        As in the document.

    Returns
    -------
    InvalidMeshError
        Names the file and says what to do.
    """
    if not is_relative(uri):
        return InvalidMeshError(
            f"the glTF file needs '{uri[:80]}', and nothing is fetched from elsewhere: send it as "
            "GLB, or with its files in a zip"
        )
    return InvalidMeshError(
        f"the glTF file needs '{file_name(uri)[:80]}', which did not come with it: send the two "
        "together, in a zip or in one upload"
    )
