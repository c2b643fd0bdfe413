"""The second half of a bank's end: what its windows are worth, or those of the shipped model."""

import structlog

from workers.errors import InsufficientTrainingDataError
from workers.geometry.views import window_view
from workers.pipeline.progress import LEARNING, SEARCHING
from workers.pipeline.training.fit import Material
from workers.pipeline.workbench import Workbench
from workers.retrieval.windows.matching import WindowMatching
from workers.retrieval.windows.whitening import learn_whitening
from workers.storage.models import Json
from workers.storage.shipped_models import shipped_model
from workers.training.bank import TrainedBank
from workers.training.bank_shapes import BankShapes
from workers.training.chosen_windows import most_copies, require_enough
from workers.training.examples import Variant
from workers.training.window_pairs import WindowPairs
from workers.training.window_shapes import WindowShapes
from workers.training.windows import (
    held_out_distances,
    learn_windows,
    windows_report,
)

log = structlog.get_logger(__name__)


def fit_windows(
    bench: Workbench, trained: TrainedBank, shapes: BankShapes, material: Material[Variant]
) -> tuple[WindowMatching | None, Json]:
    """Learn how windows are compared and how far they are trusted beside a bank.

    Parameters
    ----------
    bench : Workbench
        Its settings, and whom to tell what is done.
    trained : TrainedBank
        That was learned.
    shapes : BankShapes
        That it was learned from.
    material : Material of Variant
        Those that windows are learned from.

    Returns
    -------
    matching : WindowMatching
        The shipped model's where there is too little to learn from.
    report : dict
        Plain JSON: whether it was learned, and the figures, or why not.
    """
    try:
        return _learned(bench, trained, shapes, material)
    except InsufficientTrainingDataError as error:
        log.info("windows are those of the shipped model", reason=str(error))
        return _shipped(bench), {"learned": False, "reason": str(error)}


def _learned(
    bench: Workbench, trained: TrainedBank, shapes: BankShapes, material: Material[Variant]
) -> tuple[WindowMatching, Json]:
    if not material.examples:  # perhaps none were planned
        require_enough(len(shapes.references), most_copies(len(shapes.queries)))
    is_shape = [one.change is None for one in material.examples]
    require_enough(is_shape.count(True), is_shape.count(False))
    own = WindowShapes.of(material.examples, material.arrays)
    both = zip(material.examples, material.arrays, strict=True)
    pairs = WindowPairs.joined([WindowPairs.from_arrays(a) for one, a in both if one.paired])
    whitening = learn_whitening(pairs.differences, pairs.one, pairs.other)
    candidates = material.examples[0].candidates
    near = held_out_distances(own.bank, candidates, shapes.query_groups, trained.relearned)
    bench.progress.enter(SEARCHING)
    known = own.compared(near, whitening)
    bench.progress.enter(LEARNING)
    view = window_view(working_vertices=bench.settings.working_vertices)
    shipped = _shipped(bench)
    start = shipped.trust if shipped is not None else None
    report = {
        "learned": True,
        "n_pairs": len(pairs.differences),
        **windows_report(known, own.bank, start),
    }
    return learn_windows(known, whitening, view, start), report


def _shipped(bench: Workbench) -> WindowMatching | None:
    """How the shipped model compares windows."""
    return shipped_model(working_vertices=bench.settings.working_vertices).windows
