"""Bodies of comparisons: why a shape matches."""

from typing import Any

from pydantic import ConfigDict, Field

from service.schemas.models import MODEL_EXAMPLE, Fusion
from service.schemas.queries import SIMILARITY
from service.schemas.shapes import SHAPE_EXAMPLE, DistributionAxis, answer_axis
from service.schemas.text import Answer
from workers.retrieval.comparison import ComparedChannel, Comparison
from workers.retrieval.model import Model

COPIED = ("name", "view", "kernel", "feature", "normalisation", "scale", "weight")


class ComparedWith(Answer):
    """The query: a stored shape, or a stored query by mesh."""

    shape_id: str | None = None
    query_id: str | None = None


class ChannelComparison(Answer):
    """What one channel says of two shapes, and how much of their distance it is."""

    name: str
    view: str
    kernel: dict[str, Any] | None
    feature: str
    normalisation: str
    dissimilarity: str = Field(description="by which it was compared")
    scale: float
    weight: float
    distance: float = Field(description="D, the dissimilarity of the values")
    share: float = Field(
        description="weight * (D / scale) ** power: its part of the whole distance"
    )
    axis: DistributionAxis
    values: list[float] = Field(description="of the match")
    asked_values: list[float] = Field(description="of the query")


class ComparisonAnswer(Answer):
    """Why a shape matches: the distance, and each channel's share of it."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "shape_id": SHAPE_EXAMPLE["id"],
                    "asked_with": {
                        "shape_id": None,
                        "query_id": "0199b1c4-8b22-7e3f-ad4c-6b7c8d9e0f1a",
                    },
                    "model": "heat",
                    "distance": 0.031,
                    "similarity": 0.97,
                    "fusion": MODEL_EXAMPLE["fusion"],
                    "channels": [
                        {
                            "name": "distances",
                            "view": "closed",
                            "kernel": {"kind": "heat", "parameters": {"time": 0.15}},
                            "feature": "distance-distribution",
                            "normalisation": "first-eigenvalue",
                            "dissimilarity": "l1",
                            "scale": 1.0,
                            "weight": 1.0,
                            "distance": 0.031,
                            "share": 0.031,
                            "axis": {"kind": "edges", "values": [0.0, 0.5, 1.0]},
                            "values": [0.6355, 0.3645],
                            "asked_values": [0.62, 0.38],
                        }
                    ],
                }
            ]
        }
    )

    shape_id: str = Field(description="the match")
    asked_with: ComparedWith
    model: str
    distance: float = Field(description="as in the answer of a query")
    similarity: float = Field(description=SIMILARITY, ge=0, le=1)
    fusion: Fusion
    channels: list[ChannelComparison] = Field(description="by their shares, the largest first")


def answer_comparison(
    comparison: Comparison, model: Model, *, shape_id: str, asked_with: ComparedWith
) -> ComparisonAnswer:
    """Convert a comparison."""
    return ComparisonAnswer(
        shape_id=shape_id,
        asked_with=asked_with,
        model=model.name,
        distance=comparison.distance,
        similarity=comparison.similarity,
        fusion=Fusion(power=model.fusion_power),
        channels=[_answer_channel(part) for part in comparison.channels],
    )


def _answer_channel(part: ComparedChannel) -> ChannelComparison:
    stored = part.channel.to_json()
    return ChannelComparison(
        **{name: stored[name] for name in COPIED},
        dissimilarity=part.dissimilarity,
        distance=part.distance,
        share=part.share,
        axis=answer_axis(part.channel.axis),
        values=part.match.tolist(),
        asked_values=part.query.tolist(),
    )
