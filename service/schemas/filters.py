"""Filters of queries: which shapes are searched."""

from typing import Annotated

from pydantic import ConfigDict, Field, StringConstraints, model_validator
from pydantic.config import JsonDict
from pydantic.json_schema import SkipJsonSchema

from service.schemas.text import Body, Text
from service.search import filters

FIELD_PATTERN = r"^(label|name|path|transformation|strength|metadata(\.[^.]{1,100}){1,8})$"
FILTER_EXAMPLE: JsonDict = {
    "must": [{"field": "label", "in": ["cat", "dog"]}],
    "must_not": [{"field": "transformation", "equals": "noise"}],
    "should": [{"field": "metadata.year", "range": {"gte": 2024}}],
}
BOUNDS = ("gt", "gte", "lt", "lte")
Scalar = bool | int | float | Text | None


def _describe_range(schema: JsonDict) -> None:
    """Say in the schema that some bound is needed, and that all are of one kind."""
    schema["anyOf"] = [_bounds_of("number"), _bounds_of("string")]


def _bounds_of(kind: str) -> JsonDict:
    needed: list[JsonDict] = [
        {"required": [name], "properties": {name: {"type": kind}}} for name in BOUNDS
    ]
    return {
        "properties": {name: {"type": [kind, "null"]} for name in BOUNDS},
        "anyOf": list(needed),
    }


def _describe_condition(schema: JsonDict) -> None:
    """Say in the schema that a condition has exactly one test."""
    schema["oneOf"] = [{"required": [name]} for name in ("equals", "in", "range", "under")]


class Range(Body):
    """Bounds of numbers, or of texts in the order of their code points."""

    model_config = ConfigDict(json_schema_extra=_describe_range)

    gt: float | Text | None = None
    gte: float | Text | None = None
    lt: float | Text | None = None
    lte: float | Text | None = None

    @model_validator(mode="after")
    def _bounds_are_alike(self) -> "Range":
        kinds = {
            isinstance(b, str) for b in (self.gt, self.gte, self.lt, self.lte) if b is not None
        }
        if not kinds:
            raise ValueError("a range needs at least one of gt, gte, lt, lte")
        if len(kinds) > 1:
            raise ValueError("the bounds of a range must be all numbers or all texts")
        return self

    def to_value(self) -> filters.Range:
        """Return the bounds as the search takes them."""
        return filters.Range(gt=self.gt, gte=self.gte, lt=self.lt, lte=self.lte)


class Condition(Body):
    """One test of one field: give exactly one of `equals`, `in`, `range` and `under`.

    A list in the metadata passes if one of its items does. A missing field equals null.
    """

    model_config = ConfigDict(json_schema_extra=_describe_condition)

    field: Annotated[Text, StringConstraints(pattern=FIELD_PATTERN)] = Field(
        description="label, name, path, transformation, strength, metadata.KEY, metadata.KEY.KEY …",
        json_schema_extra={"pattern": FIELD_PATTERN},
    )
    equals: Scalar = None
    one_of: Annotated[list[Scalar], Field(min_length=1, max_length=1000)] | SkipJsonSchema[None] = (
        Field(None, alias="in")
    )
    range: Range | SkipJsonSchema[None] = None
    under: Annotated[Text, StringConstraints(max_length=1024)] | SkipJsonSchema[None] = Field(
        None, description="a folder, which passes with all that is below it: of `path`, or any text"
    )

    @model_validator(mode="after")
    def _one_test(self) -> "Condition":
        given = self.model_fields_set & {"equals", "one_of", "range", "under"}
        empty = {name for name in given - {"equals"} if getattr(self, name) is None}
        if len(given) != 1 or empty:
            raise ValueError("give exactly one of equals, in, range and under")
        return self

    def to_value(self) -> filters.Condition:
        """Return the condition as the search takes it."""
        if self.under is not None:
            return filters.Condition(self.field, filters.Under(self.under))
        if self.range is not None:
            return filters.Condition(self.field, self.range.to_value())
        allowed = [self.equals] if self.one_of is None else self.one_of
        return filters.Condition(self.field, tuple(allowed))


Conditions = Annotated[list[Condition], Field(max_length=100)]


class Filter(Body):
    """Which shapes are searched: all of `must`, none of `must_not`, one of `should` if any."""

    model_config = ConfigDict(json_schema_extra={"examples": [FILTER_EXAMPLE]})

    must: Conditions = Field(default_factory=list)
    must_not: Conditions = Field(default_factory=list)
    should: Conditions = Field(default_factory=list)

    def to_value(self) -> filters.Filter:
        """Return the filter as the search takes it."""
        groups = (self.must, self.must_not, self.should)
        must, must_not, should = (tuple(one.to_value() for one in group) for group in groups)
        return filters.Filter(must, must_not, should)
