"""How windows are compared and how far they are trusted, learned from shapes and their copies.

Trust is learned and measured on distances as they are of unknown shapes. The groups of shapes are
split into folds. The bank's weights for one fold are learned on the others. So is the trust that
the report's table is measured with. Channels and whitening have seen all groups.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from workers.errors import InsufficientTrainingDataError
from workers.geometry.arrays import BoolArray, FloatArray, IntArray
from workers.geometry.views import View
from workers.retrieval.model import Model
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.trust import Trust
from workers.retrieval.windows.whitening import Whitening
from workers.training.bank_report import scored_rows
from workers.training.bank_shapes import BankShapes, of_channels, search_distances
from workers.training.ranking_loss import ranks_among
from workers.training.window_trust import WindowQueries, learn_trust, window_impostors

FOLDS = 3
"""Of the groups of shapes. With more, each is learned on more of them, and takes longer."""


def folds_of(groups: Sequence[str]) -> IntArray:
    """Number of the fold that each belongs to: a group is in one fold.

    Parameters
    ----------
    groups : sequence of str
        Species or labels.

    Returns
    -------
    (n,) int64
        From 0 to `FOLDS` - 1.
    """
    _, number = np.unique(groups, return_inverse=True)
    folds: IntArray = number % FOLDS
    return folds


def held_out_distances(
    shapes: BankShapes,
    candidates: Model,
    groups: Sequence[str],
    relearned: Callable[[BoolArray], Model],
) -> FloatArray:
    """The bank's distances of copies, its weights learned on shapes of other groups.

    Which channels there are was chosen with all groups.

    Parameters
    ----------
    shapes : BankShapes
        Whose windows are learned from, described under ``candidates``.
    candidates : Model
        Of all channels.
    groups : sequence of str
        Of each query that the bank is learned from.
    relearned : callable
        Of `TrainedBank`.

    Returns
    -------
    (q, g) float64, infinite to shapes that are alike by their labels

    Raises
    ------
    InsufficientTrainingDataError
        All copies of the bank are of one group.
    """
    names = np.array(shapes.query_groups)
    folds = folds_of(shapes.query_groups)
    found = np.empty((len(names), len(shapes.references)))
    for fold in np.unique(folds).tolist():
        held_out = folds == fold
        others = ~np.isin(groups, names[held_out])
        if not others.any():
            apart = ", ".join(sorted(set(names[held_out].tolist())))
            raise InsufficientTrainingDataError(
                f"the bank has copies of the group {apart} alone, expected others to learn "
                "weights from that are not of this group"
            )
        model = relearned(others)
        own = of_channels(shapes.only(held_out), candidates, model)
        found[held_out] = search_distances(own, model)
    return found


def learn_windows(
    known: WindowQueries, whitening: Whitening, view: View, start: Trust | None = None
) -> WindowMatching:
    """Learn how far windows are trusted.

    Parameters
    ----------
    known : WindowQueries
        Copies, compared under the whitening.
    whitening : Whitening
        How windows are compared.
    view : View
        Under which windows were taken.
    start : Trust, optional
        What is known of trust already.

    Returns
    -------
    WindowMatching
        As it is after it was stored; the same for the same copies.

    Raises
    ------
    InsufficientTrainingDataError
        There are no copies.
    """
    trust = learn_trust(known, start)
    matching = WindowMatching(view, whitening, trust, window_impostors(known, trust))
    return WindowMatching.from_json(matching.to_json())


def cross_validated(
    known: WindowQueries,
    folds: IntArray,
    taught: BoolArray | None = None,
    *,
    start: Trust | None = None,
) -> FloatArray:
    """Distances from all evidence, under a trust that was learned on the other folds.

    Parameters
    ----------
    known : WindowQueries
        q copies of g shapes.
    folds : (q,) int64
        Of each copy.
    taught : (q,) bool, optional
        Copies that are learned from; all, if left out.
    start : Trust, optional
        What is known of trust already, from other groups.

    Returns
    -------
    (q, g) float64, infinite where the bank's are
    """
    fused = np.empty_like(known.distances)
    for fold in np.unique(folds).tolist():
        held_out = folds == fold
        others = ~held_out if taught is None else taught & ~held_out
        trust = learn_trust(known.only(others), start)
        fused[held_out] = known.only(held_out).fused(trust)[0]
    return np.where(np.isfinite(known.distances), fused, np.inf)


def windows_report(
    known: WindowQueries, shapes: BankShapes, start: Trust | None = None
) -> dict[str, Any]:
    """Figures of the bank's distances alone and of all evidence, on groups not learned from.

    Parameters
    ----------
    known : WindowQueries
        Copies, compared under the whitening.
    shapes : BankShapes
        Shapes and copies.
    start : Trust, optional
        What is known of trust already, from other groups.

    Returns
    -------
    dict
        Plain JSON.

    Raises
    ------
    InsufficientTrainingDataError
        All copies are of one group.
    """
    fused = cross_validated(known, folds_of(shapes.query_groups), start=start)
    measured = {"bank": known.distances, "with_windows": fused}
    return {
        "n_shapes": len(shapes.references),
        "n_copies": len(shapes.queries),
        "n_groups": len(set(shapes.query_groups)),
        "rows": {
            name: scored_rows(
                100.0 / ranks_among(distances, shapes.truth), shapes.transformations, shapes.truth
            )
            for name, distances in measured.items()
        },
    }
