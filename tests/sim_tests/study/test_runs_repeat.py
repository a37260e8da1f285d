"""An episode is a function of its line, by the API and in a run; planners that draw are named."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
import run_planners
from run_scenes import SHORT, short_jobs

from sim_tests import CrossingFrame, run_crossing
from sim_tests.conditions import Perception
from sim_tests.scenario import Scenario
from sim_tests.study.measures import read_records, summarise, summary_text
from sim_tests.study.runs import (
    attempt,
    in_parallel,
    observed_episode,
    plan_jobs,
    read_jobs,
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

class Sideways(Unseeded):
    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.4, 0.01 * self.rng.random(), 0.0

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


def test_sideways_speeds_that_differ_are_not_deterministic(drawing):
    (job,) = short_jobs(1, planners=[f"{drawing}:Sideways"], robot="omni")[::2]
    record = run_episode(job)
    assert (record.error, record.nondeterministic) == ("", True)


_SHORT = SHORT.format(name="short")
ADULT = _SHORT.replace("notices_within_m: 0.0", "watches: true")
CHILD = _SHORT + "    stature_m: 1.15\n"
SMALL = "camera: {width_px: 640, height_px: 480, horizontal_fov_deg: 60.0}\n"
TWO_VIEWS = ADULT + "camera: {views_deg: [0.0, 90.0]}\n"


def signature(frame: CrossingFrame) -> tuple[Any, ...]:
    """Return the numbers of a frame, for comparisons to the bit."""
    limits = frame.constraints
    return (
        frame.t_s,
        frame.robot_state.position_odom_m.tobytes(),
        [(each.position_odom_m.tobytes(), each.awareness) for each in frame.truth],
        [each.position_camera_m.tobytes() for each in frame.observations],
        [
            (each.id, each.awareness, *map(bytes, (each.position_odom_m, each.covariance_odom)))
            for each in frame.tracks
        ],
        frame.scan_points_odom_m.tobytes(),
        (limits.speed_limit_mps, limits.limited_by, limits.stale),
        frame.command,
        frame.separations_m,
    )


@pytest.mark.parametrize(
    ("text", "perception"),
    [
        (ADULT, "truth"),
        (ADULT, "oracle"),
        (ADULT, "keypoints"),
        pytest.param(CHILD, "keypoints+scanner", marks=pytest.mark.slow),
        pytest.param(ADULT, "scanner", marks=pytest.mark.slow),
        pytest.param(ADULT + SMALL, "pixels", marks=pytest.mark.slow),
        pytest.param(CHILD, "pixels+scanner", marks=pytest.mark.full),
        pytest.param(TWO_VIEWS, "pixels", marks=pytest.mark.full),
    ],
)
def test_the_api_a_run_a_replay_and_gymnasium_give_the_same_frames(text, perception, tmp_path):
    gymnasium = pytest.importorskip("gymnasium", reason="needs the extra awarenav[gym]")
    scenario = Scenario.from_text(text)
    oracle = perception == "oracle"
    senses = Perception.named("keypoints" if oracle else perception)
    kind, sensors = senses.kind or "keypoints", senses.sensors
    jobs = plan_jobs(
        [scenario],
        ["oracle" if oracle else "balanced"],
        [3],
        perception=kind,
        sensors=[sensors],
        faults=["bursts"],
    )
    by_the_api = run_crossing(
        scenario, policy="balanced", perception=perception, seed=3, fault="bursts"
    )
    expected = [signature(each) for each in by_the_api.frames]
    assert sum(len(each.tracks) for each in by_the_api.frames) > 5
    (record,) = run_jobs(jobs, tmp_path / "run", workers=1)
    assert record.duration_s == pytest.approx(by_the_api.duration_s)
    assert record.perception == perception
    (job,) = read_jobs(tmp_path / "run")
    replayed, again = observed_episode(job)
    assert again == record
    assert [signature(each) for each in replayed.frames] == expected
    env = gymnasium.make(
        "sim_tests.learning:awarenav/Crossing-v0",
        scenarios=scenario,
        policy="balanced",
        perception=perception,
        fault="bursts",
        normalised_actions=False,
    ).unwrapped
    env.reset(seed=3)
    found = []
    for frame in by_the_api.frames:
        _, _, terminated, truncated, _ = env.step(np.array(frame.command))
        found.append(signature(env.frame))
        if terminated or truncated:
            break
    env.close()
    # The last frame of a crossing that reaches its goal has a command that is not driven.
    assert len(found) >= len(expected) - 1
    assert found == expected[: len(found)]


def test_a_task_without_people_is_driven_once_for_all_processes(tmp_path, monkeypatch):
    """A line for every planner that is made: two for the task, and one for each episode."""
    monkeypatch.setenv(run_planners.MARKER, str(tmp_path / "made"))
    jobs = short_jobs(2, planners=["run_planners:Counted"])
    records = run_jobs(jobs, tmp_path / "two", workers=2)
    made = (tmp_path / "made").read_text().splitlines()
    # One was made to see that it can be.
    assert len(made) == 1 + 2 + len(jobs)
    assert run_jobs(jobs, tmp_path / "one", workers=1) == records
