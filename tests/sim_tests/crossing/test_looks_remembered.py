"""The time since a person's last look, for those of whom it counts and not α itself."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from sim_tests import Scenario, run_crossing
from sim_tests.crossing import RequestMemory


def frame(t_s, awareness, lower, noticed):
    track = SimpleNamespace(id=1, awareness=awareness, awareness_lower=lower, noticed=noticed)
    limit = SimpleNamespace(alerts=(), answers=())
    return SimpleNamespace(t_s=t_s, tracks=(track,), constraints=limit)


def obstacle(lower):
    return SimpleNamespace(track_id=1, awareness_lower=lower)


def test_a_memory_is_dated_from_the_latest_look():
    memory = RequestMemory()
    for t_s, awareness in ((1.0, 0.9), (2.0, 0.8), (2.5, 0.2), (3.2, 0.1)):
        memory.take(frame(t_s, awareness, awareness - 0.1, 0.8))
    now = frame(3.2, 0.1, 0.0, 0.8)
    assert memory.noticed_s(obstacle(0.6), now) == pytest.approx(1.2)


@pytest.mark.parametrize(
    ("lower", "own", "noticed"),
    [(0.7, 0.7, 0.9), (0.6, 0.5, 0.0), (0.0, 0.0, 0.3)],
    ids=["alpha itself counts", "no memory", "nothing counts"],
)
def test_what_alpha_says_itself_is_no_memory(lower, own, noticed):
    memory = RequestMemory()
    now = frame(1.0, 0.8, own, noticed)
    memory.take(now)
    assert memory.noticed_s(obstacle(lower), now) is None


@pytest.mark.parametrize(("policy", "remembers"), [("balanced", True), ("conservative", False)])
def test_a_robot_that_knows_the_truth_remembers_as_its_policy_says(policy, remembers):
    scenario = Scenario.shipped("crossing_attentive").draw(0)
    short = scenario.model_copy(update={"duration_s": 6.0})
    result = run_crossing(short, policy=policy, perception="truth", seed=0)
    tracks = [track for frame in result.frames for track in frame.tracks]
    assert any(track.noticed > 0.5 for track in tracks) is remembers
    assert all((track.aware_for_s < math.inf) is remembers for track in tracks)
