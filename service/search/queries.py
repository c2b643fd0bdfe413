"""What is searched for, and what was found."""

from dataclasses import dataclass

from service.search.filters import Filter
from service.search.indexes import SearchModel
from workers.geometry.arrays import Float32Array
from workers.retrieval.windows.closely import AUTO
from workers.retrieval.windows.signature import Signature
from workers.storage.shapes import ShapeView


@dataclass(frozen=True)
class SearchOptions:
    """How to search, whatever the query is.

    Attributes
    ----------
    limit : int
        Most matches of the answer, at least 1.
    model : str or None
        Name of the model to search under; None for the collection's own.
    dissimilarity : str or None
        Compares all channels by this one; None for each by its own.
    max_distance : float or None
        Leaves out what is farther.
    filter : Filter or None
        Which shapes are searched; None for all.
    include_self : bool
        Whether a stored shape, or a region of one, may find that shape.
    match : "auto", "whole" or "part"
        What the query is taken for.
    """

    limit: int = 10
    model: str | None = None
    dissimilarity: str | None = None
    max_distance: float | None = None
    filter: Filter | None = None
    include_self: bool = False
    match: str = AUTO


@dataclass(frozen=True, eq=False)
class SearchQuery:
    """A descriptor to search for, and how.

    Attributes
    ----------
    vector : (d,) float32
        Descriptor of the query, made under the model of ``search``.
    search : SearchModel
        The model to search under.
    options : SearchOptions
        How to search.
    shape_id : str or None
        The query itself, where it is a stored shape.
    signature : Signature or None
        Its windows, where the model compares them.
    cut_from : str or None
        The stored shape that the query is a region of.
    """

    vector: Float32Array
    search: SearchModel
    options: SearchOptions
    shape_id: str | None = None
    signature: Signature | None = None
    cut_from: str | None = None


@dataclass(frozen=True)
class Match:
    """One shape that was found.

    Attributes
    ----------
    distance : float
        Of the descriptors, at least 0.
    similarity : float
        In [0, 1]; 1 for equal descriptors.
    shape : ShapeView
        The shape as it is stored.
    """

    distance: float
    similarity: float
    shape: ShapeView


@dataclass(frozen=True)
class Ranking:
    """The nearest shapes of a collection.

    Attributes
    ----------
    collection, model : str
        What was searched, and under which model.
    dissimilarity : str
        What descriptors were compared by; several names, one a channel, with commas between.
    matches : tuple of Match
        The nearest first; of equal distances, the smaller id first.
    searched : int
        How many shapes passed the filter and were compared.
    searched_closely : int
        How many of them were compared by their windows too.
    seconds : float
        How long it took.
    """

    collection: str
    model: str
    dissimilarity: str
    matches: tuple[Match, ...]
    searched: int
    searched_closely: int
    seconds: float
