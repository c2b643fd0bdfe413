"""Bodies of correspondences."""

import json
from typing import Any

from pydantic import ConfigDict, Field
from pydantic.config import JsonDict

from service.schemas.text import Answer
from workers.correspondence import Correspondence

DIGITS = 6
"""After the point: what is stored has about as many."""

EXAMPLE: JsonDict = {
    "scale": 1.02,
    "mirrored": False,
    "coverage": 0.41,
    "points": [
        {"vertex": 0, "face": 5023, "barycentric": [0.2, 0.5, 0.3], "confidence": 0.97},
    ],
    "stretch": [0.03],
    "bending": [-0.8],
}


class PointAnswer(Answer):
    """A point of the second shape for a vertex of the first."""

    vertex: int = Field(description="of the first mesh, as in `format=glb`")
    face: int = Field(description="of the second mesh, as in `format=glb`")
    barycentric: list[float] = Field(
        min_length=3, max_length=3, description="shares of the face's corners; their sum is 1"
    )
    confidence: float = Field(
        description="how likely the point lies within 0.05 √A of the true one, 0 to 1"
    )


class CorrespondenceAnswer(Answer):
    """Which point of one shape is which point of another."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    scale: float = Field(
        description="lengths on the second shape over those on the first, each in its file's unit"
    )
    mirrored: bool | None = Field(
        description="whether left and right are exchanged; null where both fit as well, as on a "
        "symmetric shape: then they are not"
    )
    coverage: float = Field(description="share of the second shape's area with a counterpart")
    points: list[PointAnswer] = Field(description="one for each vertex of the first mesh")
    stretch: list[float] = Field(
        description="at each vertex, ln of the ratio of areas beyond that of the scale"
    )
    bending: list[float] = Field(
        description="at each vertex, the change of the mean curvature after scaling, in units of "
        "1 / √A of the first shape"
    )


def correspondence_json(found: Correspondence) -> bytes:
    """Write the body: a mesh may have a million vertices, too many for one object each.

    Parameters
    ----------
    found : Correspondence
        Of two meshes.

    Returns
    -------
    bytes
        JSON as `CorrespondenceAnswer` describes it.
    """
    rows = zip(
        found.faces.tolist(),
        found.barycentric.round(DIGITS).tolist(),
        found.confidence.round(DIGITS).tolist(),
        strict=True,
    )
    body: dict[str, Any] = {
        "scale": found.scale,
        "mirrored": found.mirrored,
        "coverage": found.coverage,
        "points": [
            {"vertex": vertex, "face": face, "barycentric": weights, "confidence": confidence}
            for vertex, (face, weights, confidence) in enumerate(rows)
        ],
        "stretch": found.stretch.round(DIGITS).tolist(),
        "bending": found.bending.round(DIGITS).tolist(),
    }
    return json.dumps(body, separators=(",", ":")).encode()
