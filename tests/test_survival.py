"""Nothing that was acknowledged is lost, whichever process is killed; the benchmark in small."""

import pytest

from benchmarks.survival import VICTIMS, survive


@pytest.mark.slow
@pytest.mark.server
def test_every_acknowledged_shape_is_ready_once_though_everything_was_killed() -> None:
    account = survive(24, times=1, pause=3.0, seconds=240)
    assert sorted(account.killed) == sorted(VICTIMS)
    assert account.failed == []
    assert len(account.acknowledged) == 24
    assert (account.listed, account.distinct_contents, account.ready) == (24, 24, 24)
    assert account.answered > 0
