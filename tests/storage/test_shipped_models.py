"""The model that comes with the program, and whether the code still fits it."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from workers.creatures import (
    CREATURES_VERSION,
    TESTED_SPECIES,
    TRAINING_SPECIES,
    make_creature,
)
from workers.errors import InvalidRequestError
from workers.geometry.solution import solve
from workers.geometry.spectrum import SOLVER_VERSION
from workers.geometry.views import PREPARATION_VERSION, named_view
from workers.retrieval.builtin import DESCRIPTION_VERSION
from workers.retrieval.model import describe
from workers.storage.shipped_models import (
    FOLDER,
    shipped_model,
    shipped_report,
    shipped_views,
    shipped_whitening,
    write_shipped,
)
from workers.training.bank import BANK_VERSION
from workers.training.candidates import candidate_model
from workers.training.examples import VARIANT_VERSION
from workers.transformations import PAPER_TRANSFORMATIONS, TRANSFORMATION_VERSION

RAISED_SINCE: dict[str, tuple[str, str]] = {}
"""Versions that the model was trained with, and those of the code that it was measured with since.

``make train-default`` empties this.
"""


def test_it_was_trained_or_measured_with_the_code_that_is_here() -> None:
    """Whoever raises a version trains the model anew, or measures what it does and says so."""
    expected = {
        "bank": BANK_VERSION,
        "creatures": CREATURES_VERSION,
        "description": DESCRIPTION_VERSION,
        "preparation": PREPARATION_VERSION,
        "solver": SOLVER_VERSION,
        "transformations": TRANSFORMATION_VERSION,
        "variants": VARIANT_VERSION,
    }
    measured = {name: now for name, (_, now) in RAISED_SINCE.items()}
    assert measured == {name: expected[name] for name in measured}
    trained = {**expected, **{name: then for name, (then, _) in RAISED_SINCE.items()}}
    assert dict(shipped_model().versions) == trained
    assert shipped_report()["versions"] == trained


def test_its_channels_and_views_are_those_of_the_code() -> None:
    model = shipped_model()
    assert [view.to_json() for view in model.views] == shipped_views()
    known = {c.name: c for c in candidate_model(model.views, power=model.fusion_power).channels}
    for channel in model.channels:
        told, candidate = channel.to_json(), known[channel.name].to_json()
        for learned in ("weight", "scale"):
            del told[learned], candidate[learned]
        assert told == candidate


def test_a_creature_is_described_as_it_was_when_the_model_was_made() -> None:
    model = shipped_model()
    for witness in shipped_report()["witnesses"]:
        mesh = make_creature(witness["species"], seed=0, vertices=witness["vertices"]).rest
        found = describe({view.name: solve(mesh, view) for view in model.views}, model)
        assert_allclose(found, witness["descriptor"], atol=2e-3)  # another processor's exp and log


def test_it_was_made_from_enough_creatures_and_none_that_are_tested_with() -> None:
    report = shipped_report()
    request = report["request"]
    assert report["n_references"] >= 60
    assert report["n_failed_variants"] <= 0.01 * report["n_queries"]
    assert request["training"]["collection"] is None
    assert set(request["training"]["transformations"]) >= set(PAPER_TRANSFORMATIONS)
    assert set(report["held_out_groups"]) < set(TRAINING_SPECIES)
    assert not set(report["held_out_groups"]) & set(TESTED_SPECIES)


def test_its_similarity_kept_its_word_on_held_out_creatures() -> None:
    """Within a factor of three and five points, on species that it was not calibrated on."""
    for entry in shipped_report()["similarity"]:
        assert entry["found"] <= 3.0 * entry["promised"] + 0.05
        assert entry["found"] >= entry["promised"] / 5.0 - 0.01


def test_it_forgets_scale_and_is_a_row_of_numbers() -> None:
    model = shipped_model()
    assert shipped_report()["share_that_sees_scale"] == 0.0
    assert sum(channel.weight for channel in model.channels) == pytest.approx(1.0, abs=2e-3)
    assert 4 * model.dimension < 8192  # bytes a shape
    assert np.all(np.diff(model.impostor_quantiles) >= 0.0)


def test_a_service_of_smaller_meshes_has_the_same_channels_on_them() -> None:
    small = shipped_model(working_vertices=700)
    assert small.channels == shipped_model().channels
    assert small.views == tuple(
        named_view(view.name, working_vertices=700) for view in shipped_model().views
    )


def test_files_are_written_as_they_are_read(tmp_path: Path) -> None:
    definition = {**shipped_model().to_json(), "name": "bank-of-creatures"}
    write_shipped(definition, shipped_report(), tmp_path)
    for name in ("proteus.json", "proteus.report.json"):
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()
    assert shipped_model(folder=tmp_path) == shipped_model()
    with pytest.raises(ValueError, match="JSON"):
        write_shipped(definition, {"a": float("nan")}, tmp_path)
    (tmp_path / "proteus.json").write_text(json.dumps({"name": "x", "views": []}))
    with pytest.raises(InvalidRequestError, match="cannot be read"):
        shipped_model(folder=tmp_path)


def test_points_are_matched_with_the_windows_of_the_model() -> None:
    windows = shipped_model().windows
    assert windows is not None
    assert_array_equal(shipped_whitening().whole, windows.whitening.whole)
    assert_array_equal(shipped_whitening().cut, windows.whitening.cut)
