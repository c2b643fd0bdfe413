"""``python -m benchmarks.windows`` in small: what it learns goes into a model that can be read."""

from pathlib import Path

import pytest

from benchmarks import windows
from workers.storage.shipped_models import shipped_model, shipped_report

SPECIES = ("cow", "octopus", "chair", "worm")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few species, copies and vertices; processes are forked, so that they have them, too."""
    monkeypatch.setattr(windows, "TRAINING_SPECIES", SPECIES)
    monkeypatch.setattr(windows, "COPIES", (("partial", (3,)), ("isometry", (2,))))
    monkeypatch.setattr(windows, "INDIVIDUALS", 1)
    monkeypatch.setattr(windows, "ASKED", 1)
    monkeypatch.setattr(windows, "VERTICES", 2000)
    monkeypatch.setattr(windows, "FINE_VERTICES", 3000)


def test_what_is_learned_is_written_into_the_model(
    small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cache, out = tmp_path / "cache", tmp_path / "shipped"
    windows.main(["--cache", str(cache), "--write", "--out", str(out)])
    printed = capsys.readouterr().out
    assert "partial 3" in printed
    assert "mean of the transformations" in printed
    learned, shipped = shipped_model(folder=out), shipped_model()
    assert learned.channels == shipped.channels
    assert learned.windows is not None
    assert learned.windows.impostor_quantiles
    assert learned.windows != shipped.windows
    report = shipped_report(out)["windows"]
    assert report["learned"]
    assert (report["n_shapes"], report["n_copies"]) == (4, 8)
    assert f"{report['rows']['with_windows']['map']['partial']:.1f}" in printed
    again = tmp_path / "again"
    windows.main(["--cache", str(cache), "--write", "--out", str(again)])
    files = [folder / "proteus.json" for folder in (out, again)]
    assert files[0].read_bytes() == files[1].read_bytes()
