"""The benchmark of the cost of an episode runs, and refuses what is no checkout."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.episode_cost import main


def test_a_folder_without_the_packages_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["--against", str(tmp_path)])
    assert "must be a checkout with sim_tests" in capsys.readouterr().err


@pytest.mark.full
def test_a_checkout_has_the_results_of_itself(capsys: pytest.CaptureFixture[str]) -> None:
    here = str(Path(__file__).resolve().parents[2])
    arguments = ["--episodes", "1", "--perception", "truth", "--scenario", "crossing_attentive"]
    assert main([*arguments, "--against", here]) == 0
    *_, row, mean = capsys.readouterr().out.splitlines()
    _, perception, scenario, before, now, ratio, same, _ = (cell.strip() for cell in row.split("|"))
    assert (perception, scenario, same) == ("`truth`", "`crossing_attentive`", "yes")
    assert float(before) > 0.0
    assert float(now) / float(before) == pytest.approx(float(ratio), rel=0.1)
    assert mean.startswith("| `truth` | mean |")
