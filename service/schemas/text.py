"""Values that can be stored and answered again: no NUL, no lone surrogate, no NaN."""

import json
import math
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

MAX_METADATA_BYTES = 16 * 1024
MAX_METADATA_DEPTH = 16


class Body(BaseModel):
    """A request body: unknown fields are refused, so that a misspelt one is noticed.

    A value has the type that the document says: no text or truth value stands for a number.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)

    @model_validator(mode="before")
    @classmethod
    def _whole_numbers_are_integers(cls, given: Any) -> Any:
        """Take 3.0 as 3: JSON has one kind of number, and some clients write all with a point."""
        if not isinstance(given, dict):
            return given
        return {name: _whole(value) for name, value in given.items()}


class Answer(BaseModel):
    """A response body."""

    model_config = ConfigDict(from_attributes=True)


def _whole(value: Any) -> Any:
    if isinstance(value, list):
        return [_whole(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def check_text(text: str) -> str:
    """Return the text if every database and every JSON reader can hold it.

    Raises
    ------
    ValueError
        It has a NUL character or a lone surrogate.
    """
    if "\x00" in text:
        raise ValueError("must not hold the NUL character")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError("must be Unicode text, found half of a surrogate pair") from None
    return text


def check_metadata(metadata: dict[str, Any]) -> dict[str, Any]:
    """Return the metadata if it can be stored.

    Raises
    ------
    ValueError
        It is too large, nested too deep, or holds what no JSON reader takes.
    """
    _check_value(metadata, depth=0)
    size = len(json.dumps(metadata, ensure_ascii=False, allow_nan=False).encode())
    if size > MAX_METADATA_BYTES:
        raise ValueError(f"has {size} bytes as JSON, allowed are {MAX_METADATA_BYTES}")
    return metadata


def _check_value(value: object, *, depth: int) -> None:
    if depth > MAX_METADATA_DEPTH:
        raise ValueError(f"is nested deeper than {MAX_METADATA_DEPTH} levels")
    if isinstance(value, str):
        check_text(value)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError("must not hold NaN or infinity")
    elif isinstance(value, list):
        for item in value:
            _check_value(item, depth=depth + 1)
    elif isinstance(value, dict):
        for key, item in value.items():
            check_text(key)
            _check_value(item, depth=depth + 1)


NO_NUL = r"^[^\x00]*$"
Text = Annotated[str, AfterValidator(check_text), Field(json_schema_extra={"pattern": NO_NUL})]
Label = Annotated[Text, StringConstraints(max_length=255)]
Name = Annotated[Text, StringConstraints(min_length=1, max_length=255)]
Metadata = Annotated[
    dict[str, Any],
    AfterValidator(check_metadata),
    Field(description="any JSON object of at most 16 KiB"),
]
