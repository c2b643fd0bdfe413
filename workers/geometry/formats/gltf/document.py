"""The JSON part of a glTF file, read so that no content of it can do harm."""

import json
from dataclasses import dataclass
from typing import Any

from workers.errors import InvalidMeshError, UnsupportedFormatError, UploadTooLargeError

Json = dict[str, Any]
BLANK = b"\0 \t\r\n"
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
MOST_CONTAINERS = 1_000_000  # objects and lists; each takes up to 240 bytes of memory
LARGEST_COUNT = 1 << 40


@dataclass(frozen=True, eq=False)
class Document:
    """A glTF document.

    Attributes
    ----------
    content : dict
        As the JSON has it; only its outermost form and its version are checked.
    repairs : tuple of str
        Where the text breaks JSON's rules.
    """

    content: Json
    repairs: tuple[str, ...] = ()


def read_document(text: bytes) -> Document:
    """Parse the JSON of a glTF file.

    Parameters
    ----------
    text : bytes
        May begin with a byte order mark and end in blanks or zeros.

    Returns
    -------
    Document
        Has an object 'asset'; of any version.

    Raises
    ------
    InvalidMeshError
        No JSON, nested too deeply, or no glTF.
    UploadTooLargeError
        So many objects and lists that they would fill the memory.
    """
    text = text.strip(BLANK).removeprefix(BYTE_ORDER_MARK)
    n_containers = text.count(b"{") + text.count(b"[")
    if n_containers > MOST_CONTAINERS:
        raise UploadTooLargeError(
            f"the JSON of the glTF file has {n_containers:,} objects and lists, "
            f"but at most {MOST_CONTAINERS:,} are accepted"
        )
    repairs = []
    try:
        decoded = text.decode()
    except UnicodeDecodeError:
        decoded = text.decode("latin-1")
        repairs.append("the JSON of the glTF file is not UTF-8; it was read as Latin-1")
    try:
        content, end = json.JSONDecoder().raw_decode(decoded.lstrip())
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)[:80]
        raise InvalidMeshError(
            f"the JSON of the glTF file is truncated or damaged: {reason}"
        ) from None
    if len(decoded.lstrip()) > end:
        repairs.append("the glTF file has text after the end of its JSON, which was ignored")
    if not isinstance(content, dict) or not isinstance(content.get("asset", {}), dict):
        raise InvalidMeshError("the file is JSON, but no glTF: it has no 'asset'")
    if "asset" not in content and not {"meshes", "accessors"} <= content.keys():
        raise InvalidMeshError("the file is JSON, but no glTF: it has no 'asset'")
    return Document(content, tuple(repairs))


def require_version_2(content: Json) -> None:
    """Raise ``UnsupportedFormatError`` for another version than glTF 2.

    Parameters
    ----------
    content : dict
        Of a glTF document.

    Raises
    ------
    UnsupportedFormatError
        glTF 1.0 or one that is not out yet.
    """
    asset = content.get("asset", {})
    version = asset.get("minVersion", asset.get("version"))
    if version is None and isinstance(content.get("meshes", []), list):
        return  # version 1 has objects where version 2 has lists
    if not str(version).startswith("2"):
        raise UnsupportedFormatError(
            f"the file is glTF version {str(version or '1.0')[:8]}; expected 2.0: open it in "
            "Blender or another program and export it as GLB"
        )


def entries(content: Json, key: str) -> list[Json]:
    """All objects of a list of the document, such as its nodes.

    Parameters
    ----------
    content : dict
        Of a glTF document, or a part of it.
    key : str
        Name of the list.

    Returns
    -------
    list of dict
        Empty where the list is missing.

    Raises
    ------
    InvalidMeshError
        No list, or one of other things than objects.
    """
    found = content.get(key)
    if found is None:
        return []
    if not isinstance(found, list) or not all(isinstance(item, dict) for item in found):
        raise InvalidMeshError(f"the glTF file is damaged: '{key}' is no list of objects")
    return found


def entry(items: list[Json], index: Any, noun: str) -> Json:
    """Object by its number.

    Parameters
    ----------
    items : list of dict
        From `entries`.
    index : any
        Whatever the file has there.
    noun : str
        What the objects are, for the message.

    Returns
    -------
    dict
        ``items[index]``.

    Raises
    ------
    InvalidMeshError
        There is none of this number.
    """
    if isinstance(index, float) and index.is_integer():
        index = int(index)
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(items):
        raise InvalidMeshError(f"the glTF file has no {noun} {_short(index)}")
    return items[index]


def part(item: Json, *keys: str) -> Json:
    """Object within objects, such as an extension.

    Parameters
    ----------
    item : dict
        Where to begin.
    keys : str
        The way down.

    Returns
    -------
    dict
        Empty where one of the keys is missing or no object.
    """
    for key in keys:
        found = item.get(key)
        if not isinstance(found, dict):
            return {}
        item = found
    return item


def natural(item: Json, key: str) -> int:
    """Return the natural number under a key.

    Parameters
    ----------
    item : dict
        A part of the document.
    key : str
        Name of the number.

    Returns
    -------
    int
        0 where it is missing or null.

    Raises
    ------
    InvalidMeshError
        Something else, or more than any file has bytes.
    """
    value = item.get(key)
    if value is None:
        return 0
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < LARGEST_COUNT:
        raise InvalidMeshError(f"'{key}' of the glTF file is {_short(value)}; expected a count")
    return value


def _short(value: Any) -> str:
    """Text of a value, however long; Python refuses to print very large integers."""
    return "a huge number" if isinstance(value, int) and abs(value) > 10**18 else str(value)[:20]
