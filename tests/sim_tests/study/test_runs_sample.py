"""A sample of a plan: even over faults, scenarios and policies, repeatable, and resumable."""

from __future__ import annotations

import json
from collections import Counter
from functools import lru_cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_scenes import SHORT, short

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.crossing.faults import shipped_faults
from sim_tests.study.measures import read_records
from sim_tests.study.runs import plan_jobs, sample_jobs

SCANNERS = [name for name in shipped_faults() if name.startswith("scanner_")]


@lru_cache(maxsize=1)
def plan():
    """5 scenarios, 7 faults, 2 policies, 3 seeds: 210 episodes."""
    return plan_jobs(
        [short(name) for name in "abcde"],
        ["blind", "balanced"],
        range(3),
        perception="truth",
        faults=["none", *shipped_faults()[:6]],
    )


@lru_cache(maxsize=1)
def numbers():
    return {job: number for number, job in enumerate(plan())}


@settings(max_examples=60)
@given(st.integers(1, 210), st.integers(0, 1000))
def test_a_sample_is_even(count: int, seed: int) -> None:
    drawn = sample_jobs(plan(), count, seed)
    assert len(set(drawn)) == count
    # The order of the plan, so that jobs.jsonl is that of a run of these episodes.
    rows = [numbers()[job] for job in drawn]
    assert rows == sorted(rows)
    faults = Counter(job.fault for job in drawn)
    # Each fault once before any twice.
    assert len(faults) == min(count, 7)
    assert max(faults.values()) - min(faults.values()) <= 1
    scenarios = Counter(job.scenario for job in drawn)
    assert len(scenarios) == min(count, 5)
    policies = Counter(job.policy for job in drawn)
    if count <= 105:
        assert max(scenarios.values()) - min(scenarios.values()) <= 1
        assert abs(policies["blind"] - policies["balanced"]) <= 0.1 * count + 2


@settings(max_examples=40)
@given(st.integers(1, 209), st.integers(0, 1000))
def test_a_larger_sample_holds_the_smaller_one(count: int, seed: int) -> None:
    larger = sample_jobs(plan(), 210, seed)
    assert sample_jobs(plan(), count, seed) == sample_jobs(plan(), count, seed)
    assert larger == plan()
    assert set(sample_jobs(plan(), count, seed)) <= set(sample_jobs(plan(), count + 1, seed))


def test_a_pattern_stands_for_the_shipped_faults_that_fit() -> None:
    def faults(*patterns: str) -> list[str]:
        jobs = plan_jobs([short()], ["blind"], [0], perception="truth", faults=patterns)
        return [job.fault for job in jobs]

    assert faults("scanner_*") == SCANNERS
    assert faults("none", "*_5deg") == ["", "wrong_pitch_5deg", "wrong_yaw_5deg"]
    others = [name for name in shipped_faults() if name not in SCANNERS]
    pairs = faults("[!s]*+scanner_*")
    assert pairs == [f"{other}+{scanner}" for other in others for scanner in SCANNERS]
    with pytest.raises(SimError, match="no shipped fault fits the pattern 'lidar_\\*'; they are"):
        faults("lidar_*")
    assert faults("ghosts+*") == [f"ghosts+{each}" for each in shipped_faults()]  # also twice


def test_a_sample_is_continued_like_any_run(tmp_path, capsys) -> None:
    scenarios = []
    for name in ("one", "two"):
        path = tmp_path / f"{name}.yaml"
        path.write_text(SHORT.format(name=name))
        scenarios.append(str(path))
    out = tmp_path / "out"
    command = ["crossings", "--scenario", *scenarios, "--policy", "blind", "balanced"]
    command += ["--perception", "truth", "--episodes", "3", "--fault", "none", "misses_*", "bursts"]
    command += ["--workers", "1", "--no-report", "--seed", "4", "--sample", "6", "--out", str(out)]
    assert main(command) == 0
    table = (out / "episodes.csv").read_bytes()
    records = read_records(out / "episodes.csv")
    assert Counter(record.fault for record in records) == {"": 2, "misses_30": 2, "bursts": 2}
    assert Counter(record.scenario for record in records) == {"one": 3, "two": 3}
    assert {record.seed for record in records} <= {4, 5, 6}
    assert len((out / "jobs.jsonl").read_text().splitlines()) == 6
    about = json.loads((out / "run.json").read_text())
    assert about["settings"]["sample"] == 6
    assert "--sample 6" in about["command"]
    # As after a kill: some episodes are missing.
    (out / "episodes" / "00003.json").unlink()
    assert main([*command, "--resume"]) == 0
    assert (out / "episodes.csv").read_bytes() == table
    capsys.readouterr()
    assert main([*command, "--sample", "7", "--resume"]) == 2
    assert "begun with sample 6, and this has 7" in capsys.readouterr().err
    assert main([*command, "--sample", "37", "--overwrite"]) == 2
    assert "sample must lie in [1, 36], got 37" in capsys.readouterr().err
    assert (out / "episodes.csv").read_bytes() == table
