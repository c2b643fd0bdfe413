"""Bodies of the health checks."""

from typing import Literal

from pydantic import ConfigDict

from service.schemas.text import Answer


class Alive(Answer):
    """The process answers."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "ok"}]})

    status: Literal["ok"] = "ok"


class Readiness(Answer):
    """Whether requests can be served.

    `degraded`: the broker does not answer. What is stored can be searched; uploads are
    accepted, and computed once it is back.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"status": "ok", "database": "ok", "index": "ok", "broker": "ok"}]
        }
    )

    status: Literal["ok", "degraded", "down"]
    database: Literal["ok", "down"]
    index: Literal["ok", "down"]
    broker: Literal["ok", "down"]
