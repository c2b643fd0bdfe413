"""How often windows find the whole of a part, on a few shapes."""

import pytest

from benchmarks import recall
from workers.creatures import TRAINING_SPECIES
from workers.retrieval.windows import candidates


def test_it_prints_a_row_for_every_kind_of_copy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(recall, "TRAINING_SPECIES", TRAINING_SPECIES[:2])
    monkeypatch.setattr(recall, "ASKED", (("partial", (3,)),))
    monkeypatch.setattr(recall, "VERTICES", 2000)
    monkeypatch.setattr(recall, "CROWD_VERTICES", 2000)
    monkeypatch.setattr(recall, "BENT", 2)
    monkeypatch.setattr(candidates, "CANDIDATES", 2)
    recall.main(["--learned", "--sizes", "4", "6", "--processes", "1"])
    printed = capsys.readouterr().out
    assert "of 4" in printed
    assert "of 6" in printed
    (row,) = (line for line in printed.splitlines() if "partial 3" in line)
    assert row.count("100 %") == 2
