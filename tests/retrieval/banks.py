"""Made-up descriptors of shapes and copies, under channels that tell them apart or do not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workers.geometry.arrays import FloatArray
from workers.geometry.views import default_view
from workers.retrieval.model import Model
from workers.training.bank_shapes import BankShapes
from workers.training.candidates import candidate_model

N_CHANNELS = 8


def few_candidates() -> Model:
    """The first channels under the default view, and the area."""
    model = candidate_model([default_view()], power=0.25)
    return replace(model, channels=(*model.channels[: N_CHANNELS - 1], model.channels[-1]))


def bank_shapes(
    *, groups: int = 8, members: int = 3, telling: tuple[int, ...] = (0, 1), noise: float = 0.15
) -> BankShapes:
    """Shapes whose copies keep the channels of ``telling`` nearly, and lose all others."""
    rng = np.random.default_rng(0)
    model = few_candidates()
    n, d = groups * members, model.dimension
    references = rng.normal(size=(n, d))
    kept = np.zeros(d, dtype=np.bool_)
    for channel in telling:
        kept[list(model.slices.values())[channel]] = True
    truth = np.repeat(np.arange(n), 4)
    changes = rng.normal(size=(len(truth), d))
    queries = np.where(kept, references[truth] + noise * changes, changes)
    return of_copies(references, queries, ("noise", "holes") * (len(truth) // 2), members=members)


def of_copies(
    references: FloatArray, queries: FloatArray, transformations: Sequence[str], *, members: int
) -> BankShapes:
    """Shapes in groups of so many, and as many copies of each one after another."""
    n, each = len(references), len(queries) // len(references)
    return BankShapes(
        references=references.astype(np.float32),
        groups=tuple(f"group {i // members}" for i in range(n)),
        names=tuple(f"shape {i}" for i in range(n)),
        lenient=(False,) * n,
        queries=queries.astype(np.float32),
        truth=np.repeat(np.arange(n), each),
        transformations=tuple(transformations),
        strengths=tuple((1, 1, 3, 3)[copy % 4] for copy in range(len(queries))),
    )
