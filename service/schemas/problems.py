"""Problems (RFC 9457)."""

from pydantic import ConfigDict, Field

from service.schemas.text import Answer


class Problem(Answer):
    """What went wrong, as `application/problem+json`."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/invalid-mesh",
                    "title": "Invalid mesh",
                    "status": 422,
                    "detail": "face 17 refers to vertex 99, but the mesh has 42 vertices",
                    "instance": "/v1/queries/0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8c",
                    "request_id": "4f0c9b0e7d1a4a52",
                }
            ]
        }
    )

    type: str = Field(description="`/problems/<kind>`: what programs may rely on")
    title: str = Field(description="the kind in words")
    status: int = Field(description="HTTP status")
    detail: str = Field(description="what was found and what was expected")
    instance: str = Field(description="path of the request")
    request_id: str = Field(description="the answer's X-Request-ID, also in the service's log")
