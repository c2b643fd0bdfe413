"""What the study of a model tells of a benchmark's shapes."""

import numpy as np

from benchmarks.model_study import ranges_of_roughness, with_heavier_points
from tests.retrieval.banks import of_copies
from workers.geometry.views import named_view
from workers.training.candidates import candidate_model


def test_roughness_is_told_by_transformation_and_strength() -> None:
    model = candidate_model([named_view("detailed"), named_view("smooth")], power=0.25)
    column = model.slices["detailed: roughness"]
    references, queries = (np.full((n, model.dimension), 9.0) for n in (3, 12))
    references[:, column] = np.array([[0.2], [0.03], [0.1]])
    queries[:, column] = np.tile([[0.31], [0.05], [1.3], [0.07]], (3, 1))
    queries[4:6, column] = [[0.5], [0.06]]
    shapes = of_copies(references, queries, ("noise", "holes") * 6, members=1)
    assert ranges_of_roughness(shapes, model) == {
        "as they are": "0.03 to 0.20",
        "noise": "0.31 to 0.50, 1.30 to 1.30",
        "holes": "0.05 to 0.06, 0.07 to 0.07",
    }


def test_points_alone_weigh_more() -> None:
    model = candidate_model([named_view("closed")], power=0.25)
    pairs = zip(model.channels, with_heavier_points(model, 3.0).channels, strict=True)
    factors = {one.is_reranked: other.weight / one.weight for one, other in pairs}
    assert factors == {True: 3.0, False: 1.0}
