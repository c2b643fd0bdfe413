"""Texts of a form as values."""

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from service.errors import explain_validation
from service.schemas.text import Body
from workers.errors import InvalidRequestError

Fields = TypeVar("Fields", bound=Body)


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
