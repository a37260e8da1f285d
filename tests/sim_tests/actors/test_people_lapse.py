"""People who forget the robot after a look at it, or set off then."""

from __future__ import annotations

import math

import numpy as np
import pytest
from staged_people import run_stage

LOOKER = {
    "name": "p",
    "route": [{"x_m": 6.0, "y_m": -3.0}, {"x_m": 6.0, "y_m": 4.0}],
    "speed_mps": 1.2,
    "heading_deg": 180.0,
    "glances": {"watches": True, "first_glance_delay_s": 0.3},
    "reactions": {"wait": 1.0},
}


def noticed_s(run):
    (outcome,) = run.outcomes
    assert outcome.noticed_s is not None
    return outcome.noticed_s


@pytest.mark.parametrize("after_s", [0.0, 1.0, 2.5])
def test_somebody_who_halts_stands_until_the_lapse_and_sets_off_then(after_s):
    """``start_s`` comes too late, or too early, for when the person sets off."""
    for start_s in (0.0, 100.0):
        lapse = {"after_look_s": after_s, "halts": True}
        person = {**LOOKER, "start_s": start_s, "lapse": lapse, "social": False}
        run = run_stage([person], robot_mps=0.0, seconds=8.0)
        go_s = noticed_s(run) + after_s
        speeds, times = run.speeds[:, 0], run.times_s
        # A walker brakes within half a second; then nobody moves before the lapse.
        waiting = (times > noticed_s(run) + 0.6) & (times < go_s - 0.1)
        assert (speeds[waiting] < 0.15).all()
        assert speeds[(times > go_s + 1.5) & (times < go_s + 3.0)].min() > 0.8
        assert run.people[-1, 0, 1] > 0.0


def test_without_a_lapse_the_same_person_waits_for_the_robot():
    """The comparison that shows what the lapse changes: without it a clear distance stays."""

    def nearest(person):
        run = run_stage([person], robot_mps=0.8, seconds=12.0)
        return float(np.hypot(*(run.people[:, 0, :2] - run.robot).T).min()), run

    waits, _ = nearest({**LOOKER, "start_s": 3.6, "social": True})
    forgets, run = nearest({**LOOKER, "start_s": 3.6, "lapse": {"after_look_s": 1.0}})
    assert forgets < waits - 0.2
    (outcome,) = run.outcomes
    assert outcome.noticed_s is not None


@pytest.mark.parametrize("looks_away", [True, False])
def test_after_the_lapse_the_head_turns_away_or_stays_on_the_robot(looks_away):
    lapse = {"after_look_s": 1.0, "looks_away": looks_away}
    person = {**LOOKER, "heading_deg": 120.0, "route": LOOKER["route"][:1], "lapse": lapse}
    run = run_stage([person], robot_mps=0.0, seconds=5.0)
    before = (run.times_s > noticed_s(run) + 0.6) & (run.times_s < noticed_s(run) + 1.0)
    after = run.times_s > noticed_s(run) + 2.0
    off = run.off_robot_deg[:, 0]
    assert off[before].max() < 15.0
    assert (off[after].min() > 30.0) if looks_away else (off[after].max() < 15.0)


def test_the_robots_touch_ends_the_lapse():
    """A person whom the robot touches steps back, and does not walk on into it."""
    person = {
        **LOOKER,
        "route": [{"x_m": 4.0, "y_m": 0.0}],
        "heading_deg": 90.0,
        "lapse": {"after_look_s": 0.0},
    }
    run = run_stage([person], robot_mps=0.8, seconds=8.0)
    assert run.contacts
    touched_s = run.contacts[0].t_s
    assert math.isfinite(touched_s)
    after = run.people[run.times_s > touched_s + 1.5, 0]
    assert np.hypot(after[:, 0] - 4.0, after[:, 1]).max() > 0.2
