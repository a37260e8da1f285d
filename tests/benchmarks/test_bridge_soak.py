"""Short runs of the soaks; the long ones are for a computer that has nothing else to do."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from benchmarks.bridge.soak import main


def test_minutes_of_a_day_end_well(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["day", "0.05"]) == 0
    assert "450 ticks, 450 limits" in capsys.readouterr().out


@pytest.mark.slow
def test_some_publishers_come_and_go_without_a_loss(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert main(["peers", "own", "50"]) == 0
    assert "50 publishers, " in capsys.readouterr().out


def test_other_words_print_the_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["week"]) == 2
    assert "peers VENDOR" in capsys.readouterr().out
