"""Which shapes of a collection a filter lets through.

Conditions are decided here, in Python, so that they mean the same on every database. What the
database can decide alike (equality of texts and whole numbers in columns) narrows the rows
that are read.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from workers.storage.models import Shape
from workers.storage.shapes import lies_under

COLUMNS = ("label", "name", "path", "transformation", "strength")
Scalar = bool | int | float | str | None
Fields = Mapping[str, Any]
"""A shape's label, name, path, transformation, strength and metadata."""


@dataclass(frozen=True)
class Range:
    """Bounds of a value, all numbers or all texts; None where there is no bound.

    Attributes
    ----------
    gt, gte : float, str or None
        The value is above the first, and at least the second.
    lt, lte : float, str or None
        The value is below the first, and at most the second.
    """

    gt: float | str | None = None
    gte: float | str | None = None
    lt: float | str | None = None
    lte: float | str | None = None


@dataclass(frozen=True)
class Under:
    """A folder: it passes itself and all that is below it.

    Attributes
    ----------
    folder : str
        Names with ``/`` between them; the empty folder has everything below it.
    """

    folder: str

    def passes(self, path: object) -> bool:
        """Whether a path is this one or lies below it."""
        folder = self.folder.strip("/")
        if not isinstance(path, str):
            return False
        return not folder or path == folder or path.startswith(f"{folder}/")


@dataclass(frozen=True)
class Condition:
    """A test of one field.

    Attributes
    ----------
    field : str
        label, name, path, transformation, strength, or keys of the metadata:
        ``metadata.KEY.KEY``.
    allowed : tuple of Scalar, Range, or Under
        The values that pass. A missing field has the value None.
    """

    field: str
    allowed: tuple[Scalar, ...] | Range | Under


@dataclass(frozen=True)
class Filter:
    """Which shapes pass: under all of ``must``, none of ``must_not``, one of ``should`` if any.

    Attributes
    ----------
    must, must_not, should : tuple of Condition
        The conditions; an empty filter lets every shape pass.
    """

    must: tuple[Condition, ...] = ()
    must_not: tuple[Condition, ...] = ()
    should: tuple[Condition, ...] = ()


def matching_shapes(session: Session, collection_id: str, wanted: Filter) -> set[str]:
    """Find the shapes of a collection that pass a filter.

    Parameters
    ----------
    session : Session
        That reads.
    collection_id : str
        Of the collection.
    wanted : Filter
        The filter.

    Returns
    -------
    set of str
        Ids of the shapes.
    """
    conditions = [*wanted.must, *wanted.must_not, *wanted.should]
    columns = [getattr(Shape, name) for name in COLUMNS]
    if any(condition.field.startswith("metadata.") for condition in conditions):
        columns.append(Shape.attributes)
    statement = select(Shape.id, *columns).where(Shape.collection_id == collection_id)
    for condition in wanted.must:
        if (narrowed := _narrowing(condition)) is not None:
            statement = statement.where(narrowed)
    rows = session.execute(statement, execution_options={"yield_per": 5000})
    names = (*COLUMNS, "metadata")
    return {
        row[0]
        for row in rows
        if passes(wanted, dict(zip(names, row[1:], strict=False)))  # the last may be absent
    }


def passes(wanted: Filter, fields: Fields) -> bool:
    """Decide whether a shape passes.

    Parameters
    ----------
    wanted : Filter
        The filter.
    fields : Mapping
        The shape's label, name, path, transformation, strength and metadata.

    Returns
    -------
    bool
        True where it passes.
    """
    if not all(holds(condition, fields) for condition in wanted.must):
        return False
    if any(holds(condition, fields) for condition in wanted.must_not):
        return False
    return not wanted.should or any(holds(condition, fields) for condition in wanted.should)


def holds(condition: Condition, fields: Fields) -> bool:
    """Decide whether one condition holds.

    Parameters
    ----------
    condition : Condition
        The condition.
    fields : Mapping
        The shape's label, name, transformation, strength and metadata.

    Returns
    -------
    bool
        True where it holds; for a field with a list, where it holds for one item.
    """
    value = _look_up(condition.field, fields)
    values = value if isinstance(value, list) else [value]
    test = _test(condition)
    return any(test(item) for item in values)


def _look_up(field: str, fields: Fields) -> object:
    value: Any = fields
    for key in field.split("."):
        if not isinstance(value, Mapping) or key not in value:
            return None
        value = value[key]
    return value


def _test(condition: Condition) -> Callable[[object], bool]:
    allowed = condition.allowed
    if isinstance(allowed, Under):
        return allowed.passes
    if isinstance(allowed, Range):
        return lambda value: _within(allowed, value)
    keys = {_key(value) for value in allowed}
    return lambda value: not isinstance(value, (dict, list)) and _key(value) in keys


def _key(value: object) -> tuple[str, object]:
    """Make true differ from 1, and 3 equal 3.0."""
    if isinstance(value, bool):
        return "truth", value
    if isinstance(value, int | float):
        return "number", value
    return ("text", value) if isinstance(value, str) else ("null", None)


def _within(bounds: Range, value: object) -> bool:
    """Whether a value of the bounds' type lies within them; one of another type does not."""
    limits = (bounds.gt, bounds.gte, bounds.lt, bounds.lte)
    of_text = any(isinstance(limit, str) for limit in limits)
    if isinstance(value, bool) or not isinstance(value, str if of_text else (int, float)):
        return False
    number: Any = value
    return (
        (bounds.gt is None or number > bounds.gt)
        and (bounds.gte is None or number >= bounds.gte)
        and (bounds.lt is None or number < bounds.lt)
        and (bounds.lte is None or number <= bounds.lte)
    )


def _narrowing(condition: Condition) -> ColumnElement[bool] | None:
    """Return SQL that is true wherever the condition holds; None where there is no such SQL."""
    values = condition.allowed
    if condition.field == "path" and isinstance(values, Under):
        return lies_under(values.folder)
    if condition.field not in COLUMNS or isinstance(values, Range | Under):
        return None
    column = getattr(Shape, condition.field)
    if condition.field == "strength":
        usable = all(_is_small_integer(value) for value in values)
    else:
        usable = all(isinstance(value, str) for value in values)
    narrowed: ColumnElement[bool] | None = column.in_(values) if usable else None
    return narrowed


def _is_small_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**31
