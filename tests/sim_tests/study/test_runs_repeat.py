"""An episode is a function of its line, by the API and in a run; planners that draw are named."""

from __future__ import annotations

import random

import numpy as np
import pytest
from run_scenes import SHORT, short_jobs

from sim_tests import run_crossing
from sim_tests.scenario import ScenarioTemplate
from sim_tests.study.measures import read_records, summarise, summary_text
from sim_tests.study.runs import (
    attempt,
    in_parallel,
    observed_episode,
    plan_jobs,
    run_episode,
    run_jobs,
)

PLANNERS = """
import random
import time
import numpy as np

class Straight:
    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return self.speed_mps(), 0.0

class Seeded(Straight):
    def __init__(self, *, seed):
        self.rng = np.random.default_rng(seed)

    def speed_mps(self):
        return 0.2 + 0.4 * self.rng.random()

class Unseeded(Straight):
    def __init__(self):
        self.rng = np.random.default_rng()

    def speed_mps(self):
        return 0.2 + 0.4 * self.rng.random()

DRAWN = np.random.random() + random.random()

class DrawnAtImport(Straight):
    def speed_mps(self):
        return 0.2 + 0.2 * DRAWN
"""


@pytest.fixture
def drawing(tmp_path, monkeypatch):
    """Return the folder of the planners, on the import path of this process and its children."""
    name = f"drawing_{random.randrange(10**9)}"
    (tmp_path / f"{name}.py").write_text(PLANNERS, "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


def test_a_planner_that_draws_while_it_is_imported_draws_the_same_in_every_process(drawing):
    (job,) = short_jobs(1, planners=[f"{drawing}:DrawnAtImport"])[::2]
    (here,) = (outcome.record for _, outcome in in_parallel(attempt, [job], workers=1))
    ((_, there),) = in_parallel(attempt, [job], workers=1, own_process=True)
    assert not here.error
    assert there.record == here


def test_the_seed_of_the_episode_is_handed_to_a_planner_that_takes_it(drawing):
    first, second = short_jobs(2, planners=[f"{drawing}:Seeded"])[::2]
    record = run_episode(first)
    assert run_episode(first) == record
    assert not record.nondeterministic
    assert run_episode(second).path_length_m != record.path_length_m


def test_a_planner_that_is_not_deterministic_is_found_and_named(drawing, tmp_path):
    jobs = short_jobs(1, planners=[f"{drawing}:Unseeded", f"{drawing}:Seeded", ""])
    records = run_jobs(jobs, tmp_path / "run", workers=1)
    assert [each.planner for each in records if each.nondeterministic] == ["Unseeded"] * 2
    assert read_records(tmp_path / "run" / "episodes.csv") == records
    summary = summarise(records)
    assert {row.variant: row.nondeterministic for row in summary.policies}[
        "balanced, Unseeded"
    ] == 1
    assert "balanced, Unseeded: the planner is not deterministic" in summary_text(summary)


_SHORT = SHORT.format(name="short")
ADULT = _SHORT + "    gaze: [{t_s: 0.0, look: robot}]\n"
CHILD = _SHORT + "    stature_m: 1.15\n"
TWO_VIEWS = ADULT + "camera: {views_deg: [0.0, 90.0]}\n"
PIXELS = [
    pytest.param(text, "pixels", "camera", marks=pytest.mark.full)
    for text in (ADULT, CHILD, TWO_VIEWS)
]


@pytest.mark.parametrize(
    ("text", "perception", "sensors"),
    [
        (ADULT, "truth", "camera"),
        (ADULT, "keypoints", "camera"),
        (CHILD, "keypoints", "camera+scanner"),
        *PIXELS,
    ],
)
def test_the_same_job_by_the_api_and_in_a_run_gives_the_same_frames(text, perception, sensors):
    template = ScenarioTemplate.from_text(text)
    (job,) = plan_jobs([template], ["balanced"], [3], perception=perception, sensors=[sensors])
    in_a_run, _ = observed_episode(job)
    by_the_api = run_crossing(
        template.for_seed(3), policy="balanced", perception=job.perception, seed=3
    )
    assert len(in_a_run.frames) == len(by_the_api.frames)
    seen = 0
    for one, other in zip(in_a_run.frames, by_the_api.frames, strict=True):
        assert one.command == other.command
        assert one.constraints.speed_limit_mps == other.constraints.speed_limit_mps
        assert np.array_equal(one.robot_state.position_odom_m, other.robot_state.position_odom_m)
        assert len(one.tracks) == len(other.tracks)
        for track, same in zip(one.tracks, other.tracks, strict=True):
            assert np.array_equal(track.position_odom_m, same.position_odom_m)
            assert np.array_equal(track.covariance_odom, same.covariance_odom)
            assert track.awareness == same.awareness
            seen += 1
    assert seen > 5
