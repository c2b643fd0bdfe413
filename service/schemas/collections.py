"""Bodies of collections."""

from datetime import datetime
from typing import Annotated

from pydantic import ConfigDict, Field, StringConstraints

from service.schemas.pages import time_from
from service.schemas.text import Answer, Body, Text
from workers.storage.collections import Counts
from workers.storage.models import Collection

NAME_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,62}$"
CollectionName = Annotated[
    str,
    StringConstraints(pattern=NAME_PATTERN),
    Field(description="small letters, digits, `-` and `_`; at most 63"),
]
ModelName = Annotated[Text, StringConstraints(min_length=1, max_length=63)]
Description = Annotated[Text, StringConstraints(max_length=2000)]


class NewCollection(Body):
    """A new collection."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"name": "zoo", "description": "scanned animals", "model": "heat"},
                {"name": "parts"},
            ]
        }
    )

    name: CollectionName
    description: Description | None = None
    model: ModelName | None = Field(None, description="the service's default model if left out")


class CollectionChange(Body):
    """What is to change; a field that is left out stays as it is."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"description": "scanned animals, second season"}]}
    )

    name: CollectionName = Field("", description="a new name", validate_default=False)
    description: Description | None = Field(None, description="null removes it")


class ModelChoice(Body):
    """The model to move to."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"model": "commute-time"}]})

    model: ModelName


class CollectionAnswer(Answer):
    """A named set of shapes that is searched under one model."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "zoo",
                    "description": "scanned animals",
                    "model": "heat",
                    "shape_count": 120,
                    "ready_count": 117,
                    "failed_count": 2,
                    "created_at": "2026-03-01T09:30:00Z",
                }
            ]
        }
    )

    name: str
    description: str
    model: str = Field(description="under which it is searched; PUT …/model moves it")
    shape_count: int
    ready_count: int = Field(description="shapes that can be found")
    failed_count: int
    created_at: datetime


def answer_collection(row: Collection, counts: Counts) -> CollectionAnswer:
    """Convert a row."""
    return CollectionAnswer(
        name=row.name,
        description=row.description,
        model=row.model,
        shape_count=counts.shapes,
        ready_count=counts.ready,
        failed_count=counts.failed,
        created_at=time_from(row.created_at),
    )
