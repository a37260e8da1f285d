"""Sequences of updates that once gave too little room or too much speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from nav_scenes import ROBOT, person, policy_radius_m, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavError, RobotState
from tracking import PersonTrack

POLICY = AwarenessPolicy()


def adapter() -> NavAdapter:
    return NavAdapter(POLICY, ROBOT)


@pytest.mark.parametrize("dead", ["everything", "odometry"])
def test_the_reachable_limit_falls_to_zero_when_the_robots_state_repeats(dead: str) -> None:
    nav = adapter()
    for k in range(20):
        nav.update([person(k * 0.05, position=(6, 0))], robot_at(k * 0.05, speed_mps=1.0), k * 0.05)
    last = robot_at(0.95, speed_mps=1.0)
    for k in range(20, 80):
        now = k * 0.05
        if dead == "everything":
            result = nav.watchdog(now)
        else:
            result = nav.update([person(now, position=(6, 0))], last, now)
    assert result.speed_limit_mps == 0.0
    assert result.reachable_speed_limit_mps == 0.0


def test_a_neighbour_does_not_stand_for_somebody_whose_id_has_jumped() -> None:
    nav = adapter()

    def neighbour(t: float) -> PersonTrack:
        return person(t, track_id=2, position=(2, 0.4), sigma_m=0.05, awareness_lower=0.95)

    for k in range(40):
        now = k * 0.05
        tracks = [person(now, position=(2, 0), sigma_m=0.05), neighbour(now)]
        before = nav.update(tracks, robot_at(now, speed_mps=0.2), now)
    tracks = [person(2.0, position=(8, 0), sigma_m=0.05), neighbour(2.0)]
    after = nav.update(tracks, robot_at(2.0, speed_mps=0.2), 2.0)
    assert [each.track_id for each in after.obstacles] == [-2, 1, 2]
    assert after.speed_limit_mps <= before.speed_limit_mps + 1e-9


def test_clutter_does_not_stand_for_somebody_whose_id_has_jumped() -> None:
    nav = adapter()
    for k in range(40):
        now = k * 0.05
        nav.update([person(now, position=(2, 0), sigma_m=0.05)], robot_at(now), now)
    jumped = person(2.0, position=(8, 0), sigma_m=0.05)
    clutter = person(2.0, track_id=7, position=(2.02, 0), sigma_m=0.05, status="tentative")
    nav.update([jumped, clutter], robot_at(2.0), 2.0)
    after = nav.update([replace(jumped, stamp_s=2.05)], robot_at(2.05), 2.05)
    assert [each.track_id for each in after.obstacles] == [-2, 1]


def test_one_new_track_stands_for_one_person() -> None:
    nav = adapter()
    places = {1: (2.0, 0.1), 2: (2.0, -0.1)}
    for k in range(40):
        now = k * 0.05
        tracks = [person(now, track_id=i, position=at, sigma_m=0.1) for i, at in places.items()]
        nav.update(tracks, robot_at(now), now)
    tracks = [
        person(2.0, track_id=1, position=(8, 3), sigma_m=0.1),
        person(2.0, track_id=2, position=(8, -3), sigma_m=0.1),
        person(2.0, track_id=3, position=(2, 0), sigma_m=0.1),
    ]
    after = nav.update(tracks, robot_at(2.0), 2.0)
    assert [each.track_id for each in after.obstacles] == [-2, 1, 2, 3]


def test_a_robot_may_have_set_off_since_its_state() -> None:
    """It stood 0.4 s ago, and may have driven ½ · 1 m/s² · (0.4 s)² = 0.08 m since."""

    def limit(age_s: float, at: tuple[float, float]) -> float:
        state = robot_at(-age_s)
        track = person(position=at)
        nav = adapter()
        return nav.update([track], state, 0.0, perception_stamp_s=0.0).speed_limit_mps

    assert limit(0.4, (3.0, 0.0)) == pytest.approx(limit(0.0, (2.92, 0.0)), abs=0.01)
    assert limit(0.4, (3.0, 0.0)) < limit(0.0, (3.0, 0.0)) - 0.02


def test_two_resets_keep_the_ceiling_of_one() -> None:
    nav = adapter()
    nav.update([person(position=(1.5, 0))], robot_at(), 0.0)
    nav.update([], robot_at(5.0), 5.0, perception_stamp_s=2.0)
    nav.reset()
    nav.reset()
    assert nav.update([], robot_at(5.1), 5.1).speed_limit_mps == 0.0


@pytest.mark.parametrize("ahead_s", [0.6, 2.0, 5.0, 9.9])
@pytest.mark.parametrize("by", ["update", "watchdog"])
def test_a_stamp_a_few_seconds_ahead_costs_one_update(ahead_s: float, by: str) -> None:
    nav = adapter()
    for k in range(120):
        now = 100.0 + k * 0.1
        if k == 50:
            ahead = now + ahead_s
            if by == "watchdog":
                nav.watchdog(ahead)
            else:
                nav.update([person(ahead)], robot_at(ahead, speed_mps=0.5), ahead)
        result = nav.update([person(now, awareness_lower=0.9)], robot_at(now), now)
        if k > 20:
            assert result.obstacles[0].radius_m == pytest.approx(policy_radius_m(POLICY, 0.9))
    assert nav.clock_restarts == 0
    assert nav.refused_stamps == (1 if by == "update" else 0)


def test_after_a_silence_an_id_is_first_sight_for_the_speed() -> None:
    unaware = (
        adapter().update([person(position=(2.2, 0))], robot_at(speed_mps=1.2), 0.0).speed_limit_mps
    )
    limits = []
    for track_id in (1, 5):
        nav = adapter()
        for k in range(20):
            now = k * 0.05
            nav.update([person(now, position=(-4, 0))], robot_at(now, speed_mps=1.2), now)
        track = person(5.95, track_id=track_id, position=(2.2, 0), awareness_lower=0.95)
        limits.append(nav.update([track], robot_at(5.95, speed_mps=1.2), 5.95).speed_limit_mps)
    assert limits[0] == limits[1] == unaware


def test_a_person_once_confirmed_is_kept_although_the_track_was_tentative_at_last() -> None:
    nav = adapter()
    for k in range(40):
        nav.update([person(k * 0.05)], robot_at(k * 0.05), k * 0.05)
    before = nav.update([person(2.0, status="tentative")], robot_at(2.0), 2.0)
    after = nav.update([], robot_at(2.05), 2.05)
    assert [each.track_id for each in after.obstacles] == [1]
    assert after.speed_limit_mps <= before.speed_limit_mps + 1e-9


def test_a_clock_that_was_set_back_is_believed_although_its_stamps_are_slightly_unordered() -> None:
    nav, accepted = adapter(), 0
    for k in range(20):
        nav.update([], robot_at(5000 + k * 0.05), 5000 + k * 0.05)
    for k in range(200):
        now = 100 + k * 0.05 - 0.07 * (k % 4 == 3)
        try:
            nav.update([], robot_at(now), now)
            accepted += 1
        except NavError:
            pass
    assert nav.clock_restarts == 1
    assert accepted >= 120


def test_repeated_frames_shrink_no_sooner() -> None:
    radii = []
    for repeats in (1, 2, 5):
        nav = adapter()
        for frame in range(5):
            for again in range(repeats):
                now = 0.2 * frame + 0.2 * again / repeats
                track = person(0.2 * frame, awareness_lower=0.95)
                result = nav.update([track], robot_at(now), now)
        radii.append(result.obstacles[0].radius_m)
    assert radii == pytest.approx([radii[0]] * 3)


@pytest.mark.parametrize(
    "call",
    [
        lambda nav: nav.update([], robot_at(), 10**400),
        lambda nav: nav.watchdog(10**400),
        lambda nav: RobotState(10**400, np.zeros(2), 0.0, 0.0, 0.0),
        lambda nav: RobotState(0.0, [10**400, 0], 0.0, 0.0, 0.0),
    ],
)
def test_numbers_beyond_any_float_are_refused(call) -> None:
    with pytest.raises(NavError):
        call(adapter())


@pytest.mark.parametrize("stamp_s", [-1e155, -1e308, -1e13])
@pytest.mark.parametrize("of", ["robot_state", "tracks", "perception"])
def test_a_stamp_that_was_never_a_time_is_refused(stamp_s: float, of: str) -> None:
    nav = adapter()
    state = robot_at(stamp_s if of == "robot_state" else 0.0, speed_mps=0.5)
    track = person(stamp_s if of == "tracks" else 0.0)
    perceived_s = stamp_s if of == "perception" else 0.0
    with pytest.raises(NavError, match=f"{of}.*more than 1e\\+12 s before stamp_s"):
        nav.update([track], state, 0.0, perception_stamp_s=perceived_s)
    assert nav.update([person()], robot_at(), 0.0).speed_limit_mps > 0.0
    # An empty header is old, not absurd.
    assert "stale" in adapter().update([person(1.7e9)], robot_at(), 1.7e9).limited_by


def test_an_absurd_variance_of_the_velocity_is_refused() -> None:
    track = replace(person(), covariance_odom=np.diag([0.01, 0.01, 1.7e308, 1.7e308]))
    with pytest.raises(NavError, match="velocity's variance"):
        adapter().update([track], robot_at(), 0.0)


def test_noise_to_the_side_never_raises_the_limit_of_a_robot_that_can_move_sideways() -> None:
    def limit(lateral_mps: float) -> float:
        state = replace(robot_at(speed_mps=0.051), velocity_base_mps=np.array([0.051, lateral_mps]))
        behind = person(position=(-2.0, 0.35))
        return adapter().update([behind], state, 0.0).speed_limit_mps

    assert limit(0.0999) <= limit(0.1001) + 1e-3
