"""Bodies of maintenance: what can be freed."""

from collections.abc import Mapping

from pydantic import ConfigDict, Field
from pydantic.config import JsonDict

from service.schemas.text import Answer
from workers.settings import Settings
from workers.storage.pruning import KINDS
from workers.storage.retention import Amount

EXAMPLE: JsonDict = {
    "count": 5,
    "bytes": 4194304,
    "kinds": [
        {
            "kind": "meshes",
            "what": "files of deleted shapes and old queries",
            "kept_days": 7.0,
            "count": 5,
            "bytes": 4194304,
        }
    ],
}


class Freeable(Answer):
    """What can be freed of a kind."""

    kind: str
    what: str
    kept_days: float = Field(description="how long things of this kind are kept")
    count: int = Field(description="rows or files")
    bytes: int = Field(description="of files, and of vectors in rows")


class FreeableAnswer(Answer):
    """What can be freed, by kind."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    count: int
    bytes: int
    kinds: list[Freeable] = Field(description="in the order in which they are freed")


def answer_freeable(amounts: Mapping[str, Amount], settings: Settings) -> FreeableAnswer:
    """Convert the amounts by kind."""
    kinds = [
        Freeable(
            kind=name,
            what=KINDS[name].what,
            kept_days=KINDS[name].days(settings),
            count=amount.count,
            bytes=amount.bytes,
        )
        for name, amount in amounts.items()
    ]
    total = sum(amounts.values(), Amount())
    return FreeableAnswer(count=total.count, bytes=total.bytes, kinds=kinds)
