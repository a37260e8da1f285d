"""Simulated people beside the recorded summary: quantities, distances, starts and looks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from paths import SHARED
from scipy.stats import binomtest, kstest

from awarenav.errors import AwarenavError
from benchmarks.people.__main__ import main
from benchmarks.people._comparison import compare
from benchmarks.people._crowd import LAYOUTS, simulate
from benchmarks.people._distribution import RECORDED, Distribution, read_recorded, summarise
from benchmarks.people._motion import QUANTITIES, RATE_HZ, Scene, read_scene
from benchmarks.people._standing import DISPLACEMENTS, LOOKED, displacements, looked_within, starts
from sim_tests.actors.behaviour import START_SHARES

CLIPS = SHARED / "data"
# Quantities of which the recordings hold too few values for a distance of 0.1.
FEW = {"passing", "start_time"}
# docs/people.md says why this one misses the goal.
MISSED = {"closest"}


def by_name(name: str):
    return next(quantity for quantity in QUANTITIES if quantity.name == name)


def walk(speed_mps: float, frames: int = 300) -> np.ndarray:
    t = np.arange(frames) / RATE_HZ
    return np.column_stack([speed_mps * t, np.zeros(frames)])


def test_a_circle_turns_at_its_rate_and_pulls_inwards() -> None:
    t = np.arange(400) / RATE_HZ
    radius_m, rate = 3.0, 0.4
    circle = radius_m * np.column_stack([np.cos(rate * t), np.sin(rate * t)])
    scene = Scene(circle[None])
    assert by_name("turning").of(scene) == pytest.approx(np.degrees(rate), rel=1e-3)
    assert by_name("across").of(scene) == pytest.approx(radius_m * rate**2, rel=1e-3)
    assert by_name("along").of(scene) == pytest.approx(0.0, abs=1e-4)
    change = by_name("heading_change").of(scene)
    assert change == pytest.approx(np.degrees(rate * 30 / RATE_HZ), rel=1e-3)


def test_two_who_meet_pass_at_the_distance_between_their_lines() -> None:
    ahead = walk(1.2)
    back = ahead[::-1] + np.array([0.0, 0.9])
    scene = Scene(np.stack([ahead, back]))
    assert by_name("passing").of(scene) == pytest.approx([0.9], abs=0.02)
    assert by_name("closest").of(scene) == pytest.approx(0.9, abs=1e-3)
    assert by_name("deviation_2s").of(scene) == pytest.approx(0.0, abs=1e-6)


def test_the_distance_is_that_of_kolmogorov_and_smirnov() -> None:
    uniform = Distribution(1000, np.linspace(0.0, 1.0, 101))
    values = np.random.default_rng(0).random(500)
    assert uniform.distance(values) == pytest.approx(kstest(values, "uniform").statistic)
    shifted = kstest(values + 0.3, "uniform").statistic
    assert uniform.distance(values + 0.3) == pytest.approx(shifted) == pytest.approx(0.36, abs=0.01)
    assert uniform.distance(np.array([2.0])) == pytest.approx(1.0)
    assert uniform.distance(np.array([-1.0])) == pytest.approx(1.0)
    assert uniform.percentile(95.0) == pytest.approx(0.95)


def test_the_fitted_people_move_as_the_recorded_ones() -> None:
    scenes = [simulate(layout, row, "recorded") for row, layout in enumerate(LAYOUTS)]
    rows = {row.name: row for row in compare(read_recorded(), {"recorded": scenes})}
    # One crowd of each layout scatters; the committed baseline holds the figures of four.
    far = {name: row.distance["recorded"] for name, row in rows.items() if name not in FEW}
    assert max(far.values()) < 0.2, far
    assert np.mean(list(far.values())) < 0.1, far
    baseline = json.loads((Path(RECORDED).parent / "baseline.json").read_text())["metrics"]
    committed = {entry["name"].removesuffix(" KS"): entry["value"] for entry in baseline}
    assert set(rows) <= set(committed)
    assert {name for name in far if committed[name] > 0.1} == MISSED, committed


@pytest.mark.parametrize("robot", ["yielding", "moving"])
def test_people_at_the_kerb_start_as_often_as_the_table_says(robot: str) -> None:
    counts = starts("recorded", yielding=robot == "yielding", count=36)
    for (begun, chances), share in zip(counts, START_SHARES[robot], strict=True):
        # Chances overlap four times, and so does their evidence.
        found = binomtest(begun // 4, max(chances // 4, 1)).proportion_ci(0.999)
        assert found.low <= share <= found.high, (robot, share, begun, chances)
    assert sum(begun for begun, _ in starts("classic", yielding=True, count=4)) == 0


def test_standing_people_are_displaced_as_recorded_ones() -> None:
    found = displacements("recorded", count=45)
    for values, (after_s, high_m, most_m) in zip(found, DISPLACEMENTS, strict=True):
        assert float(np.percentile(values, 99)) == pytest.approx(high_m, rel=0.25), after_s
        assert values.max() < most_m + 0.1


def test_people_have_looked_as_recorded_ones() -> None:
    shares = looked_within("recorded", count=50)
    for share, (within_s, recorded) in zip(shares, LOOKED, strict=True):
        assert share == pytest.approx(recorded, abs=3.3 * np.sqrt(0.25 / 50)), within_s


def test_the_summary_is_that_of_the_recordings() -> None:
    clips = sorted(CLIPS.glob("*.csv"))
    if not clips:
        pytest.skip("the recordings are not here")
    found = summarise([read_scene(clip) for clip in clips], "")
    committed = json.loads(RECORDED.read_text())
    assert found["people"] == committed["people"] == 52
    for name, entry in committed["quantities"].items():
        assert found["quantities"][name]["quantiles"] == pytest.approx(entry["quantiles"], abs=2e-4)


def test_bad_input_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "none.json").write_text("{}")
    with pytest.raises(AwarenavError, match="is not a summary of recorded people"):
        read_recorded(tmp_path / "none.json")
    with pytest.raises(SystemExit):
        main(["--summary", str(tmp_path / "new.json"), "--recordings", str(tmp_path)])
    assert "holds no CSV file" in capsys.readouterr().err
