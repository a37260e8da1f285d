"""Limits that stay low until there is a reason to raise them."""

from __future__ import annotations

import pytest
from nav_scenes import ROBOT, person, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter
from nav_adapter.limit import in_the_path_mps, straight_course_of
from perception.anthropometry import BODY_RADIUS_M

FAST = robot_at(speed_mps=1.4)


@pytest.mark.parametrize("ids", [(1, 2), (2, 1)])
def test_braking_suffices_only_if_it_does_for_everybody(ids: tuple[int, int]) -> None:
    at_once, in_time = (
        person(track_id=track_id, position=(x_m, 0.0))
        for track_id, x_m in zip(ids, (1.0, 3.7), strict=True)
    )
    assert NavAdapter(AwarenessPolicy(), ROBOT).update([in_time], FAST, 0.0).braking_suffices
    both = NavAdapter(AwarenessPolicy(), ROBOT).update([at_once, in_time], FAST, 0.0)
    assert not both.braking_suffices


@pytest.mark.parametrize("speed_mps", [0.0, 1.4])
@pytest.mark.parametrize(("near", "far"), [(1, 2), (2, 1)])
def test_the_limit_names_who_sets_it(near: int, far: int, speed_mps: float) -> None:
    people = person(track_id=near, position=(2.0, 0.0)), person(track_id=far, position=(5.5, 1.0))
    state = robot_at(speed_mps=speed_mps)
    found = NavAdapter(AwarenessPolicy(), ROBOT).update(people, state, 0.0)
    assert found.limited_by == f"track {near}: reach"


def test_a_robot_that_stands_has_braked() -> None:
    touching = person(position=(0.5, 0.0), velocity=(-1.0, 0.0))
    constraints = NavAdapter(AwarenessPolicy(), ROBOT).update([touching], robot_at(), 0.0)
    assert constraints.speed_limit_mps == 0.0
    assert constraints.braking_suffices


@pytest.mark.parametrize("sigma_m", [0.0, 0.1, 0.3])
def test_the_protective_field_counts_how_near_the_person_may_be(sigma_m: float) -> None:
    policy = AwarenessPolicy(reach=None)
    standing = person(position=(2.0, 0.0), sigma_m=sigma_m)
    found = NavAdapter(policy, ROBOT).update([standing], FAST, 0.0).speed_limit_mps
    body_m = BODY_RADIUS_M + policy.margins.uncertainty_sigmas * sigma_m
    course = straight_course_of(ROBOT, FAST)
    clearance_m = policy.margins.clearance_m
    assert found == pytest.approx(in_the_path_mps((2.0, 0.0), body_m, clearance_m, course))


def test_after_a_pause_the_limit_rises_from_the_robots_speed() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    assert adapter.update([], robot_at(), 0.0).speed_limit_mps == ROBOT.max_speed_mps
    fresh_s = AwarenessPolicy().timing.fresh_within_s
    for step, (stamp_s, speed_mps) in enumerate([(0.6, 0.4), (0.7, 0.4), (0.8, 0.5)]):
        constraints = adapter.update([], robot_at(stamp_s, speed_mps=speed_mps), stamp_s)
        expected = 0.4 + ROBOT.max_acceleration_mps2 * (fresh_s + 0.1 * step)
        assert constraints.speed_limit_mps == pytest.approx(expected)
        assert constraints.limited_by == "recovery after stale data"


def test_time_without_a_sighting_is_no_time_in_view() -> None:
    def limit_mps(*seen: bool) -> float:
        adapter = NavAdapter(AwarenessPolicy(), ROBOT)
        for step, shows in enumerate(seen):
            stamp_s = 0.05 * step
            aware = person(stamp_s, position=(2.5, 0.0), awareness_lower=0.95)
            tracks = [aware] if shows else []
            found = adapter.update(tracks, robot_at(stamp_s, speed_mps=0.5), stamp_s)
        return found.speed_limit_mps

    unaware_mps = limit_mps(True)
    assert limit_mps(True, False, False, True) == pytest.approx(unaware_mps, abs=0.02)
    assert limit_mps(True, True, True, True, True) > unaware_mps + 0.2
