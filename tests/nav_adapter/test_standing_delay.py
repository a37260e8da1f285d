"""The delay of a start from how far a person has moved: the bound, and who gets it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nav_scenes import ROBOT, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, max_speed_mps
from nav_adapter.policies import StandingPeople
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from tracking import PersonTrack

RULE = StandingPeople(
    human_acceleration_mps2=2.0,
    start_delay_s=0.15,
    standing_below_mps=0.2,
    delay_from_tracks=True,
)
AHEAD_M, FRONT_M = 3.0, 0.3625
GAP_M = AHEAD_M - FRONT_M - BODY_RADIUS_M
BRAKING = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
PRESETS = ("blind", "conservative", "balanced", "assertive")


def with_rule(name: str, rule: StandingPeople | None) -> AwarenessPolicy:
    """Return a preset with this rule, and without the one for people who walk."""
    policy = AwarenessPolicy.preset(name)
    rules = policy.rules.model_copy(update={"standing": rule, "walking": None})
    return policy.model_copy(update={"rules": rules})


def limit_mps(track: PersonTrack, name: str = "blind", rule: StandingPeople | None = RULE) -> float:
    return settled_update((track,), policy=with_rule(name, rule)).speed_limit_mps


def still(moved_m: float, age_s: float = 0.0, **how: Any) -> PersonTrack:
    return replace(person(**how), moved_m=moved_m, moved_age_s=age_s)


def expected_mps(delay_s: float) -> float:
    start = {"human_acceleration_mps2": 2.0, "start_delay_s": delay_s}
    return float(max_speed_mps(GAP_M, 1.6, **BRAKING, **start))


WALKER_MPS = expected_mps(math.inf)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize(
    ("moved_m", "age_s", "delay_s"),
    [
        (0.04, 0.0, 0.2),
        (0.04, 0.05, 0.25),
        (0.01, 0.1, 0.2),
        (0.0, 0.0, 0.15),
        (0.01, 0.02, 0.15),
    ],
)
def test_the_delay_is_the_age_and_the_time_to_come_so_far(
    name: str, moved_m: float, age_s: float, delay_s: float
) -> None:
    """At 2 m/s², 4 cm take 0.2 s; the delay is never below ``start_delay_s``."""
    assert limit_mps(still(moved_m, age_s), name) == pytest.approx(expected_mps(delay_s), abs=1e-12)
    assert expected_mps(delay_s) > WALKER_MPS + 0.05


def test_nobody_of_whom_the_tracker_says_nothing_counts_as_standing() -> None:
    """Least of all at ``start_delay_s``: a start is what makes the tracker say nothing."""
    assert limit_mps(person()) == WALKER_MPS
    fixed = RULE.model_copy(update={"delay_from_tracks": False})
    assert limit_mps(person(), rule=fixed) == pytest.approx(expected_mps(0.15), abs=1e-12)
    assert limit_mps(still(0.04), rule=fixed) == limit_mps(person(), rule=fixed)


def test_a_track_that_moves_does_not_stand_whatever_its_places_say() -> None:
    assert limit_mps(still(0.0, velocity=(0.0, 0.21))) == pytest.approx(WALKER_MPS, abs=1e-12)


def test_a_later_start_and_a_longer_way_never_raise_the_limit() -> None:
    moved = [limit_mps(still(moved_m)) for moved_m in np.linspace(0.0, 0.2, 21)]
    aged = [limit_mps(still(0.02, age_s)) for age_s in np.linspace(0.0, 0.5, 21)]
    for limits in (moved, aged):
        assert (np.diff(limits) <= 1e-12).all()
        assert limits[0] > limits[-1] + 0.05
        assert min(limits) >= WALKER_MPS


def test_time_that_the_tracker_predicts_counts_once() -> None:
    """The age of the places goes on with the stamp, and so covers the time without a frame."""
    adapter = NavAdapter(with_rule("blind", RULE), ROBOT)
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        adapter.update([still(0.02, 0.01, stamp_s=stamp_s)], robot_at(stamp_s), stamp_s)
    predicted = still(0.02, 0.11, stamp_s=0.4, unseen_s=0.1)
    found = adapter.update([predicted], robot_at(0.4), 0.4).speed_limit_mps
    assert found == pytest.approx(expected_mps(0.11 + math.sqrt(0.02)), abs=1e-12)
    short = still(0.0, 0.1, stamp_s=0.4, unseen_s=0.1)
    found = adapter.update([short], robot_at(0.4), 0.4).speed_limit_mps
    assert found == pytest.approx(expected_mps(0.15 + 0.1), abs=1e-12)


def motions(count: int, limit_mps2: float, rng: np.random.Generator) -> tuple[FloatArray, float]:
    """Places (count, T) of people who stood, sway and start, with bounded acceleration."""
    dt, steps = 2e-3, 1200
    pieces = rng.integers(2, 9, count)
    acceleration = np.zeros((count, steps))
    for row in range(count):
        cuts = np.sort(rng.integers(steps // 2, steps, pieces[row]))
        for begin, end in zip(cuts, [*cuts[1:], steps], strict=True):
            acceleration[row, begin:end] = rng.choice([-1.0, 0.0, 1.0, 1.0, rng.uniform(-1, 1)])
    step = limit_mps2 * acceleration * dt
    speed = np.cumsum(step, axis=1)
    return np.cumsum(speed - 0.5 * step, axis=1) * dt, dt


@pytest.mark.parametrize("dropped", ["nothing", "half the way", "the age"])
def test_nobody_gets_farther_than_from_the_delay_that_the_moved_way_gives(dropped: str) -> None:
    """Whatever they did before, with at most 2 m/s² they are within D(t + δ) of where they stood.

    How far they were, an age before now, from each place of the second before, is known exactly.
    """
    places, dt = motions(400, 2.0, np.random.default_rng(3))
    exact = RULE.model_copy(update={"start_delay_s": 0.0})
    short, checked = 0, 0
    for age_s in (0.0, 0.04, 0.1):
        for now in range(700, 1100, 10):
            then = now - round(age_s / dt)
            window = places[:, then - 500 : then + 1]
            # Nobody turns round exactly at one of the instants: 5 µm.
            moved_m = (places[:, then, None] - window).max(axis=1) + 5e-6
            stood = places[:, then] - moved_m
            factor = 0.5 if dropped == "half the way" else 1.0
            counted_s = 0.0 if dropped == "the age" else age_s
            for row in np.flatnonzero(moved_m <= 0.07):
                delay_s = exact.delay_s(0.0, factor * float(moved_m[row]), counted_s)
                ahead = np.arange(1200 - now) * dt
                way_m = 0.5 * 2.0 * (ahead + delay_s) ** 2
                short += bool((places[row, now:] - stood[row] > way_m + 1e-4).any())
                checked += 1
    assert checked > 5000
    assert (short == 0) is (dropped == "nothing")


def test_the_rule_survives_a_file(tmp_path: Any) -> None:
    policy = with_rule("balanced", RULE)
    policy.to_yaml(tmp_path / "mine.yaml")
    assert AwarenessPolicy.from_yaml(tmp_path / "mine.yaml") == policy
    assert not StandingPeople().delay_from_tracks


def test_a_policy_says_what_its_tracker_needs() -> None:
    assert with_rule("balanced", None).standing_window_s is None
    assert with_rule("balanced", StandingPeople(start_delay_s=0.2)).standing_window_s is None
    assert with_rule("balanced", RULE).standing_window_s == 1.0
    for name in PRESETS:
        assert AwarenessPolicy.preset(name).standing_window_s == 1.0
