"""What a bank is learned from: descriptors of shapes and of their transformed copies."""

from dataclasses import dataclass, replace

import numpy as np

from workers.errors import InsufficientTrainingDataError, InvalidRequestError
from workers.geometry.arrays import (
    BoolArray,
    Float32Array,
    FloatArray,
    IntArray,
    read_only,
)
from workers.retrieval.model import Model
from workers.retrieval.query_weights import kept_shares
from workers.retrieval.scan import distances, rerank
from workers.training.ranking_loss import RankingTerms


@dataclass(frozen=True, eq=False)
class BankShapes:
    """Descriptors under a model of candidates.

    Attributes
    ----------
    references : (g, d) float32
        Of the shapes as they are: what is searched.
    groups : tuple of str
        Of each reference, its species or label: what is trained with or held out as one.
    names : tuple of str
        Of each reference.
    lenient : tuple of bool
        Of each reference: others of its group are no impostors, for a user's labels say that they
        are alike. Individuals of a species of creatures are impostors, and hard ones.
    queries : (q, d) float32
        Of the transformed copies.
    truth : (q,) int64
        The reference that each is a copy of.
    transformations : tuple of str
    strengths : tuple of int
        Of each query.
    """

    references: Float32Array
    groups: tuple[str, ...]
    names: tuple[str, ...]
    lenient: tuple[bool, ...]
    queries: Float32Array
    truth: IntArray
    transformations: tuple[str, ...]
    strengths: tuple[int, ...]

    def __post_init__(self) -> None:
        """Check the sizes, and freeze the arrays."""
        n_references, n_queries = len(self.references), len(self.queries)
        of_references = {len(self.groups), len(self.names), len(self.lenient)}
        of_queries = {len(self.truth), len(self.transformations), len(self.strengths)}
        if of_references != {n_references} or of_queries != {n_queries}:
            raise InvalidRequestError(
                f"{n_references} references and {n_queries} queries were given, but properties of "
                f"{sorted(of_references)} references and {sorted(of_queries)} queries"
            )
        object.__setattr__(self, "references", read_only(self.references, np.float32))
        object.__setattr__(self, "queries", read_only(self.queries, np.float32))
        object.__setattr__(self, "truth", read_only(self.truth, np.int64))

    @property
    def query_groups(self) -> tuple[str, ...]:
        """Group of each query's reference."""
        return tuple(self.groups[reference] for reference in self.truth)

    def only(self, chosen: BoolArray) -> "BankShapes":
        """Some of the queries, and all references.

        Parameters
        ----------
        chosen : (q,) bool
            Which.

        Returns
        -------
        BankShapes
        """
        places = np.flatnonzero(chosen).tolist()
        return replace(
            self,
            queries=self.queries[chosen],
            truth=self.truth[chosen],
            transformations=tuple(self.transformations[place] for place in places),
            strengths=tuple(self.strengths[place] for place in places),
        )

    @property
    def excluded(self) -> BoolArray:
        """Whether a reference is no impostor of a query though it is not its own, (q, g)."""
        groups, lenient = np.array(self.groups), np.array(self.lenient)
        alike: BoolArray = groups[self.truth][:, None] == groups  # (q, g)
        alike &= lenient[self.truth][:, None] & lenient
        alike[np.arange(len(self.truth)), self.truth] = False
        return alike

    @property
    def importance(self) -> FloatArray:
        """Share of each query, (q,): every transformation has the same, and in it every query."""
        _, row, counts = np.unique(self.transformations, return_inverse=True, return_counts=True)
        return 1.0 / (counts[row] * len(counts))


def of_channels(shapes: BankShapes, model: Model, fewer: Model) -> BankShapes:
    """Shapes that were described under a model, under one that has some of its channels.

    Parameters
    ----------
    shapes : BankShapes
        Described under ``model``.
    model, fewer : Model
        ``fewer`` has no channel that ``model`` lacks.

    Returns
    -------
    BankShapes
        Described under ``fewer``.
    """
    every = np.arange(model.dimension)
    chosen = np.concatenate([every[model.slices[channel.name]] for channel in fewer.entries])
    return replace(
        shapes, references=shapes.references[:, chosen], queries=shapes.queries[:, chosen]
    )


def search_distances(shapes: BankShapes, model: Model) -> FloatArray:
    """Distances from every query to every reference, as a search under a model has them.

    Parameters
    ----------
    shapes : BankShapes
        Described under ``model``.
    model : Model
        Ready to search with.

    Returns
    -------
    (q, g) float64, infinite to references that are no impostors though not the query's own
    """
    found = np.empty((len(shapes.queries), len(shapes.references)))
    for place, query in enumerate(shapes.queries):
        scanned = distances(query, shapes.references, model)
        found[place] = rerank(query, lambda rows: shapes.references[rows], scanned, model)
    return np.where(shapes.excluded, np.inf, found)


def dissimilarities(shapes: BankShapes, candidates: Model) -> Float32Array:
    """Dissimilarity D of every channel, from every query to every reference, as a search has it.

    In float32, so that all of them fit in memory.

    Parameters
    ----------
    shapes : BankShapes
        Described under ``candidates``.
    candidates : Model
        Of c channels.

    Returns
    -------
    (c, q, g) float32
    """
    n_queries, n_references = len(shapes.queries), len(shapes.references)
    found = np.empty((len(candidates.channels), n_queries, n_references), dtype=np.float32)
    for number, channel in enumerate(candidates.channels):
        own = candidates.slices[channel.name]
        references = np.ascontiguousarray(shapes.references[:, own])  # (g, d)
        for place, query in enumerate(shapes.queries[:, own]):
            found[number, place] = channel.compare(query, references, dtype=np.float32)
    return found


def typical_scales(shapes: BankShapes, found: Float32Array) -> FloatArray:
    """Median D between a copy and its own shape.

    Where most copies do not change a channel at all it is the median between different shapes. A
    channel in which nothing differs has 0, and no use.

    Parameters
    ----------
    shapes : BankShapes
        q copies of g shapes.
    found : (c, q, g) float32
        Of `dissimilarities`.

    Returns
    -------
    (c,) float64, to three digits
    """
    places = np.arange(len(shapes.truth))
    own = np.median(found[:, places, shapes.truth], axis=1)  # (c,)
    impostors = ~shapes.excluded
    impostors[places, shapes.truth] = False
    other = np.array([np.median(one[impostors]) if impostors.any() else 0.0 for one in found])
    return np.array([float(f"{s:.3g}") for s in np.where(own > 0.0, own, other)])


def ranking_terms(
    shapes: BankShapes,
    candidates: Model,
    found: Float32Array,
    scales: FloatArray,
    *,
    power: float,
) -> RankingTerms:
    """(D/s)^p of the channels with a scale above 0, in their order, with their query weights.

    Channels that are scanned are of one kind. Points are of another, and few.

    Parameters
    ----------
    shapes : BankShapes
        q copies of g shapes.
    candidates : Model
        Of c channels.
    found : (c, q, g) float32
        Of `dissimilarities`.
    scales : (c,) float64
        s, or 0 for a channel that is left out.
    power : float
        p > 0.

    Returns
    -------
    RankingTerms
        Of the channels that are not left out.

    Raises
    ------
    InsufficientTrainingDataError
        There is no such channel: all shapes are the same.
    """
    useful = np.flatnonzero(scales > 0.0)
    if len(useful) == 0:
        raise InsufficientTrainingDataError(
            f"all {len(shapes.references)} shapes are the same under every channel, so that there "
            "is nothing to tell them apart by"
        )
    channels = [
        replace(candidates.channels[number], scale=float(scales[number]))
        for number in useful.tolist()
    ]
    terms: Float32Array = np.stack(
        [
            channel.term(found[number], power=power)
            for channel, number in zip(channels, useful.tolist(), strict=True)
        ]
    )
    shares: Float32Array = kept_shares(shapes.queries, candidates)[:, useful].T.astype(np.float32)
    return RankingTerms(
        terms,
        shapes.truth,
        shapes.excluded,
        shapes.importance,
        alike=np.array([not channel.is_reranked for channel in channels]),
        kept=None if np.all(shares == 1.0) else shares,
    )
