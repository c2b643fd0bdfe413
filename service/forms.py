"""Texts of a form as values, and whether a file is an archive of meshes."""

import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from service.errors import explain_validation
from service.schemas.text import Body
from workers.errors import InvalidRequestError

Fields = TypeVar("Fields", bound=Body)

LOCAL_ENTRY, NO_ENTRY = b"PK\x03\x04", b"PK\x05\x06"
DIRECTORY_ENTRY = struct.Struct("<4s24xHHH12x")
DIRECTORY_END = struct.Struct("<4s8xII2x")
LOOKED_AT_END = 65_535 + 22
LOOKED_AT_DIRECTORY = 1 << 20


def read_fields(
    kind: type[Fields], texts: Mapping[str, str], *, as_json: frozenset[str] = frozenset()
) -> Fields:
    """Read a form's texts; an empty one is as good as none.

    Parameters
    ----------
    kind : type
        The body that the fields make up.
    texts : mapping
        As they were received.
    as_json : frozenset of str
        Fields whose text is JSON.

    Raises
    ------
    InvalidRequestError
        A field is not what it should be.
    """
    filled = {name: text for name, text in texts.items() if text.strip()}
    values = {name: _read_json(name, t) if name in as_json else t for name, t in filled.items()}
    try:
        return kind.model_validate(values, strict=False)
    except ValidationError as error:
        found = [{**e, "loc": ("form", *e["loc"])} for e in error.errors(include_url=False)]
        raise InvalidRequestError(explain_validation(found)) from None


def _read_json(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise InvalidRequestError(
            f"{name} is no JSON: {error.msg} at character {error.pos}"
        ) from None
    except (ValueError, RecursionError):
        raise InvalidRequestError(f"{name} is no JSON that can be read") from None


def is_archive(path: Path) -> bool:
    """Whether a file is a zip archive, other than 3MF, which is one with a model inside.

    One whose directory cannot be read counts as an archive: unpacking it will say why.
    """
    with path.open("rb") as file:
        if file.read(4) not in {LOCAL_ENTRY, NO_ENTRY}:
            return False
    return not any(name.lower().endswith(b".model") for name in _directory_names(path))


def _directory_names(path: Path) -> Iterator[bytes]:
    """Names in a zip's directory, of which a bounded part is read."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - LOOKED_AT_END))
        tail = file.read()
        end = tail.rfind(NO_ENTRY)
        if end < 0 or len(tail) - end < DIRECTORY_END.size:
            return
        _, length, start = DIRECTORY_END.unpack_from(tail, end)
        if start + length > size:
            return
        file.seek(start)
        directory = file.read(min(length, LOOKED_AT_DIRECTORY))
    place = 0
    while place + 46 <= len(directory):
        mark, name, extra, comment = DIRECTORY_ENTRY.unpack_from(directory, place)
        if mark != b"PK\x01\x02":
            return
        yield directory[place + 46 : place + 46 + name]
        place += 46 + name + extra + comment
