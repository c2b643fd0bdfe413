"""Bodies of queries and their answers."""

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)
from pydantic.config import JsonDict

from service.schemas.collections import ModelName
from service.schemas.filters import FILTER_EXAMPLE, Filter
from service.schemas.jobs import JOB_EXAMPLE, JobAnswer
from service.schemas.shapes import SHAPE_EXAMPLE, ShapeAnswer, answer_shape
from service.schemas.text import Answer, Body, Text
from service.search.queries import Ranking, SearchOptions
from workers.retrieval.dissimilarity import DISSIMILARITIES

SIMILARITY = (
    "in [0, 1]; 1 means an equal descriptor. Of a bank: 1 minus the share of "
    "impostor pairs (a changed copy, and a shape that it is no copy of) that came closer when the "
    "bank was trained; so at 0.99 one impostor in a hundred is as near. Of other models: "
    "2^(-distance/s), where s is the median distance between procedural creatures of different "
    "species under the same model and dissimilarity, for a learned model that between shapes of "
    "different classes it was learned from, or for a model that was not calibrated its own scale; "
    "so 0.5 means as far apart as two different kinds of shape usually are. It orders as the "
    "distance does; it is no probability that two shapes are the same."
)
DissimilarityName = Annotated[
    Text,
    StringConstraints(max_length=40),
    Field(json_schema_extra={"enum": list(DISSIMILARITIES)}),
]
VertexIndex = Annotated[int, Field(ge=0, lt=2**31)]


class QueryOptions(Body):
    """How to search, whatever the query is."""

    limit: int = Field(10, ge=1, le=1000, description="at most so many matches")
    model: ModelName | None = Field(
        None, description="one the collection is described under; its own if left out"
    )
    dissimilarity: DissimilarityName | None = Field(
        None, description="compares all channels by this one instead of each by its own"
    )
    max_distance: float | None = Field(None, ge=0, description="leaves out what is farther")
    filter: Filter | None = None
    include_self: bool = Field(False, description="whether a stored shape may find itself")
    match: Literal["auto", "whole", "part"] = Field(
        "auto",
        description="whether the query stands for a whole shape or for a part of one; "
        "`auto` leaves that to the search",
    )

    def to_value(self) -> SearchOptions:
        """Return the options as the search takes them."""
        return SearchOptions(
            limit=self.limit,
            model=self.model,
            dissimilarity=self.dissimilarity,
            max_distance=self.max_distance,
            filter=None if self.filter is None else self.filter.to_value(),
            include_self=self.include_self,
            match=self.match,
        )


def _without_default(schema: JsonDict) -> None:
    """Take the default out of a schema, where another field decides what is taken."""
    schema.pop("default", None)


def _describe_region(schema: JsonDict) -> None:
    """Say in the schema that a region is given in one of two ways."""
    schema["oneOf"] = [
        {"required": ["vertices"], "maxProperties": 1},
        {"required": ["center", "radius"], "maxProperties": 2},
    ]


class Region(Body):
    """Part of a stored shape: give either `vertices`, or `center` and `radius`.

    Vertices are numbered from 0 as in `GET /v1/shapes/{id}/mesh?format=glb`. A region holds the
    faces all of whose corners are in it, at least 4 of them.
    """

    model_config = ConfigDict(json_schema_extra=_describe_region)

    vertices: list[VertexIndex] = Field(
        default_factory=list,
        min_length=1,
        description="in any order; those without a whole face do not matter",
    )
    center: VertexIndex = Field(
        0,
        description="vertex from which distances along the surface are measured",
        json_schema_extra=_without_default,
    )
    radius: float = Field(
        0.0,
        gt=0,
        description="how far the region goes along the surface, in the unit of the mesh",
        json_schema_extra=_without_default,
    )

    @model_validator(mode="after")
    def _is_given_in_one_way(self) -> "Region":
        given = [name for name in type(self).model_fields if name in self.model_fields_set]
        if given not in (["vertices"], ["center", "radius"]):
            found = " and ".join(given) or "neither"
            raise ValueError(f"expected either vertices, or center and radius; found {found}")
        return self

    @property
    def is_disc(self) -> bool:
        """Whether it is given by a center and a radius."""
        return "center" in self.model_fields_set


class RegionAnswer(Answer):
    """What a region of a shape holds."""

    n_vertices: int
    n_faces: int


class ShapeQuery(QueryOptions):
    """A query by a stored shape, of this collection or another."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"shape_id": SHAPE_EXAMPLE["id"]},
                {
                    "shape_id": SHAPE_EXAMPLE["id"],
                    "limit": 20,
                    "max_distance": 0.8,
                    "filter": FILTER_EXAMPLE,
                },
            ]
        }
    )

    shape_id: Annotated[Text, StringConstraints(min_length=1, max_length=64)]


class RegionQuery(ShapeQuery):
    """A query by a stored shape, of this collection or another, or by a region of it."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"shape_id": SHAPE_EXAMPLE["id"]},
                {
                    "shape_id": SHAPE_EXAMPLE["id"],
                    "limit": 20,
                    "max_distance": 0.8,
                    "filter": FILTER_EXAMPLE,
                },
                {"shape_id": SHAPE_EXAMPLE["id"], "region": {"center": 1204, "radius": 0.25}},
            ]
        }
    )

    include_self: bool = Field(
        False,
        description="whether a stored shape may find itself: false if left out. With a region, "
        "true if left out: the shape that the region is cut from is found, too",
        json_schema_extra=_without_default,
    )
    region: Region | None = Field(
        None, description="the part of the shape to search with; the whole shape if left out"
    )

    def to_parameters(self, found: RegionAnswer) -> dict[str, Any]:
        """Return what is stored: the options given, the shape, and what the region holds.

        The vertices themselves are those of the query's mesh.
        """
        given = self.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude={"region"})
        return {**given, "region": found.model_dump()}


class MeshQueryForm(QueryOptions):
    """Form fields that may go with a mesh; `filter` is JSON."""

    def to_parameters(self) -> dict[str, Any]:
        """Return the fields that were given as JSON, from which the same form can be made again."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)


class StoredQuery(QueryOptions):
    """Parameters of a query that was stored: of a mesh that was sent, or of a region."""

    shape_id: str | None = None
    region: RegionAnswer | None = None

    def to_value(self) -> SearchOptions:
        """Return the options as the search takes them; a region finds its shape by default."""
        options = super().to_value()
        if self.region is not None and "include_self" not in self.model_fields_set:
            return replace(options, include_self=True)
        return options


def _without_region(query: Any) -> Any:
    if isinstance(query, dict) and query.get("region") is not None:
        raise ValueError(
            "a batch takes no region, which may have to be described first; "
            "POST /v1/collections/{c}/query answers one"
        )
    return query


class BatchQuery(Body):
    """Up to a hundred queries by whole shapes, answered in order."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"queries": [{"shape_id": SHAPE_EXAMPLE["id"]}]}]}
    )

    queries: list[Annotated[ShapeQuery, BeforeValidator(_without_region)]] = Field(
        min_length=1, max_length=100
    )


class AskedWith(Answer):
    """The query: a stored shape, a mesh by its content, or a region of a shape by both."""

    shape_id: str | None = None
    sha256: str | None = None
    region: RegionAnswer | None = Field(
        None,
        description="what the region of the shape holds; `GET /v1/queries/{query_id}/mesh` has it",
    )


class Match(Answer):
    """One shape that was found."""

    rank: int = Field(description="from 1")
    distance: float = Field(
        description="of the descriptors and, under a model that compares windows, of these, too; "
        "ties are broken by the shape's id"
    )
    similarity: float = Field(description=SIMILARITY, ge=0, le=1)
    shape: ShapeAnswer


QUERY_RESULT_EXAMPLE: JsonDict = {
    "collection": "zoo",
    "model": "heat",
    "dissimilarity": "l1",
    "query": {"shape_id": "0199b1c4-6d0e-7c5a-b1f2-3d4e5f6a7b8d"},
    "matches": [{"rank": 1, "distance": 0.031, "similarity": 0.97, "shape": SHAPE_EXAMPLE}],
    "searched": 116,
    "searched_closely": 104,
    "took_ms": 2.4,
}


class QueryResult(Answer):
    """The shapes most like the query, the nearest first.

    The same query has the same answer, bit for bit, on any replica.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [QUERY_RESULT_EXAMPLE]})

    collection: str
    model: str
    dissimilarity: str = Field(description="what was compared by; several names: one a channel")
    query: AskedWith
    matches: list[Match]
    searched: int = Field(description="shapes that passed the filter and were compared")
    searched_closely: int = Field(
        0, description="shapes of these that were compared by what lies around their points, too"
    )
    took_ms: float


class BatchResult(Answer):
    """One result a query, in the order of the queries."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"results": [QUERY_RESULT_EXAMPLE]}]})

    results: list[QueryResult]


class QueryAccepted(Answer):
    """The mesh is being described; `GET /v1/queries/{query_id}` answers once it is."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "job": {**JOB_EXAMPLE, "kind": "query", "model": "heat", "errors": []},
                    "query_id": "0199b1c4-8b22-7e3f-ad4c-6b7c8d9e0f1a",
                }
            ]
        }
    )

    job: JobAnswer
    query_id: str


def answer_ranking(ranking: Ranking, query: AskedWith) -> QueryResult:
    """Convert what a search found."""
    return QueryResult(
        collection=ranking.collection,
        model=ranking.model,
        dissimilarity=ranking.dissimilarity,
        query=query,
        matches=[
            Match(
                rank=rank,
                distance=match.distance,
                similarity=match.similarity,
                shape=answer_shape(match.shape),
            )
            for rank, match in enumerate(ranking.matches, start=1)
        ],
        searched=ranking.searched,
        searched_closely=ranking.searched_closely,
        took_ms=round(1000 * ranking.seconds, 3),
    )
