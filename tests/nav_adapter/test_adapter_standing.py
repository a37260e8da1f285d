"""People who stand: whom the bound on human acceleration holds for, and for whom not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavError, RobotProfile, max_speed_mps
from nav_adapter.policies import SpeedRules, StandingPeople, StartReserve
from nav_adapter.settled import settled_speed_limit_mps
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

RULE = StandingPeople(human_acceleration_mps2=2.0, start_delay_s=0.25, standing_below_mps=0.2)
# Without the other bounds on human acceleration.
BLIND = AwarenessPolicy.preset("blind").model_copy(
    update={"rules": SpeedRules(start_reserve=StartReserve())}
)
AHEAD_M, FRONT_M = 3.0, 0.3625
GAP_M = AHEAD_M - FRONT_M - BODY_RADIUS_M
BRAKING = {"deceleration_mps2": 1.0, "reaction_time_s": 0.3, "clearance_m": 0.1}
WALKER_MPS = float(max_speed_mps(GAP_M, 1.6, **BRAKING))


def with_rule(policy: AwarenessPolicy, rule: StandingPeople | None) -> AwarenessPolicy:
    rules = policy.rules.model_copy(update={"standing": rule})
    return policy.model_copy(update={"rules": rules})


STANDING = with_rule(BLIND, RULE)


def standing_mps(delay_s: float = 0.25, human_mps: float = 1.6) -> float:
    return float(
        max_speed_mps(
            GAP_M,
            human_mps,
            **BRAKING,
            human_acceleration_mps2=2.0,
            start_delay_s=delay_s,
        )
    )


def limit_mps(track: PersonTrack, policy: AwarenessPolicy = STANDING) -> float:
    """Return the limit for a person who has been seen for 0.4 s."""
    return settled_update((track,), policy=policy).speed_limit_mps


def test_a_person_who_has_been_seen_standing_gets_time_to_speed_up() -> None:
    assert standing_mps() > WALKER_MPS + 0.05
    assert limit_mps(person()) == standing_mps()
    assert limit_mps(person(), BLIND) == WALKER_MPS
    settled = settled_speed_limit_mps(STANDING, ROBOT, GAP_M, 0.0)
    assert float(settled) == standing_mps()


def _uncertain(variance: float) -> PersonTrack:
    return replace(person(), covariance_odom=np.diag([0.0, 0.0, variance, 0.01]))


@pytest.mark.parametrize(
    "track",
    [
        person(velocity=(0.0, 0.21)),
        person(velocity=(0.21, 0.0)),
        _uncertain(0.041),
        replace(_uncertain(0.03), velocity_odom_mps=np.array([0.0, 0.11])),
        person(status="tentative"),
        person(status="coasting"),
    ],
    ids=["walks across", "walks away", "uncertain", "slow and uncertain", "tentative", "coasting"],
)
def test_nobody_else_counts_as_standing(track: PersonTrack) -> None:
    assert limit_mps(track) == pytest.approx(WALKER_MPS, abs=1e-12)


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.099])
def test_a_slow_and_somewhat_uncertain_track_stands(speed: float) -> None:
    track = replace(_uncertain(0.03), velocity_odom_mps=np.array([0.0, speed]))
    assert limit_mps(track) == pytest.approx(standing_mps(), abs=1e-12)


def test_nobody_stands_at_first_sight() -> None:
    adapter, limits = NavAdapter(STANDING, ROBOT), []
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        track = person(stamp_s)
        limits.append(adapter.update([track], robot_at(stamp_s), stamp_s).speed_limit_mps)
    assert limits == [WALKER_MPS, WALKER_MPS, standing_mps(), standing_mps()]


def test_an_id_that_jumps_to_somebody_standing_gets_no_speed_at_once() -> None:
    adapter = NavAdapter(STANDING, ROBOT)
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        adapter.update([person(stamp_s, position=(9.0, 4.0))], robot_at(stamp_s), stamp_s)
    result = adapter.update([person(0.4)], robot_at(0.4), 0.4)
    assert result.speed_limit_mps == WALKER_MPS


@pytest.mark.parametrize("unseen_s", [0.05, 0.1, 0.2])
def test_time_without_a_look_counts_as_time_in_which_a_start_was_missed(unseen_s: float) -> None:
    """A track that the tracker predicted to the present, and one that is old."""
    adapter = NavAdapter(STANDING, ROBOT)
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        adapter.update([person(stamp_s)], robot_at(stamp_s), stamp_s)
    now = 0.3 + unseen_s
    predicted = person(now, unseen_s=unseen_s)
    found = adapter.update([predicted], robot_at(now), now).speed_limit_mps
    assert found == pytest.approx(standing_mps(0.25 + unseen_s), abs=1e-12)
    old = settled_update([person(-unseen_s)], policy=STANDING).speed_limit_mps
    expected = max_speed_mps(
        GAP_M,
        1.6,
        **(BRAKING | {"reaction_time_s": 0.3 + unseen_s}),
        human_acceleration_mps2=2.0,
        start_delay_s=0.25,
    )
    assert old == pytest.approx(float(expected), abs=1e-12)


# Somebody so slow to set off that the rule is worth much even for old measurements.
SLUGGISH = with_rule(
    BLIND, StandingPeople(human_acceleration_mps2=0.5, start_delay_s=0.4, standing_below_mps=0.2)
)


@pytest.mark.parametrize("how", ["unseen", "missing", "late", "stale", "silent"])
def test_without_a_fresh_measurement_nobody_stands(how: str) -> None:
    """The limit is that of people who walk, to the bit, once the last frame is too old."""
    limits = []
    for policy in (SLUGGISH, BLIND):
        adapter = NavAdapter(policy, ROBOT)
        for stamp_s in np.arange(0.0, 1.05, 0.1).tolist():
            seen_s = min(stamp_s, 0.3)
            state = robot_at(stamp_s, speed_mps=0.5)
            if how == "missing" and stamp_s > 0.35:
                result = adapter.update([], state, stamp_s, perception_stamp_s=stamp_s)
            elif how == "unseen":
                predicted = person(stamp_s, unseen_s=stamp_s - seen_s)
                result = adapter.update([predicted], state, stamp_s)
            elif how == "late":
                result = adapter.update([person(seen_s)], state, stamp_s)
            elif how == "stale":
                result = adapter.update(
                    [person(stamp_s)], state, stamp_s, perception_stamp_s=seen_s
                )
            elif how == "silent" and stamp_s > 0.35:
                result = adapter.watchdog(stamp_s)
            else:
                result = adapter.update([person(stamp_s)], state, stamp_s)
            limits.append(result.speed_limit_mps)
    standing, walking = np.array(limits).reshape(2, -1)
    assert (standing[2:4] > walking[2:4] + 0.2).all()
    # From here on the last frame is older than ``fresh_within_s``, or stale.
    old = 6 if how != "stale" else 9
    assert (standing[old:] == walking[old:]).all()
    if how == "missing":
        assert (standing[4:] == walking[4:]).all()


@pytest.mark.parametrize("alpha", [0.6, 0.7, 1.0])
def test_people_who_are_assumed_to_be_slow_already_gain_nothing(alpha: float) -> None:
    """At 0.35 m/s and below, 2 m/s² and 0.25 s the start is over before it is noticed."""
    preset = AwarenessPolicy.preset("balanced")
    rules = preset.rules.model_copy(update={"standing": None, "walking": None})
    balanced = preset.model_copy(update={"rules": rules})
    track = person(awareness_lower=alpha)
    assert limit_mps(track, with_rule(balanced, RULE)) == limit_mps(track, balanced)


def test_a_robot_at_its_limit_can_brake_when_the_start_is_noticed() -> None:
    adapter = NavAdapter(STANDING, ROBOT)
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        result = adapter.update([person(stamp_s)], robot_at(stamp_s), stamp_s)
    speed = result.speed_limit_mps
    assert speed == standing_mps()
    driving = robot_at(0.3, speed_mps=speed)
    assert adapter.update([person(0.3)], driving, 0.3).braking_suffices
    moved = person(0.4, position=(AHEAD_M - 0.06, 0.0), velocity=(-0.5, 0.0))
    later = adapter.update([moved], robot_at(0.4, position=(0.04, 0.0), speed_mps=speed), 0.4)
    assert later.speed_limit_mps < speed
    assert later.braking_suffices


@pytest.mark.parametrize(("speed", "suffices"), [(1.04, True), (1.13, True), (1.15, False)])
def test_braking_suffices_counts_with_the_way_of_a_person_who_stands(
    speed: float, suffices: bool
) -> None:
    """A walker limits it to 1.052 m/s and a standing person to 1.141 m/s; the way is 2.3375 m."""
    state = robot_at(speed_mps=speed)
    assert settled_update((person(),), policy=STANDING, state=state).braking_suffices is suffices
    walking = settled_update((person(),), policy=BLIND, state=state).braking_suffices
    assert walking is (speed < 1.052)


@settings(max_examples=30)
@given(
    policy=policies(),
    robot=robots(),
    people=crowds(),
    speed=finite(-1.5, 1.5),
    more=finite(0.0, 1.0),
    data=st.data(),
)
def test_the_rule_never_lowers_a_limit_and_a_later_start_never_raises_one(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    people: tuple[PersonTrack, ...],
    speed: float,
    more: float,
    data: Any,
) -> None:
    def limit(rule: StandingPeople | None) -> float:
        state = robot_at(0.0, heading_rad=0.4, speed_mps=speed)
        result = settled_update(people, policy=with_rule(policy, rule), robot=robot, state=state)
        return result.speed_limit_mps

    rule = StandingPeople(start_delay_s=data.draw(finite(0.1, 1.0)))
    later = rule.model_copy(update={"start_delay_s": rule.start_delay_s + more})
    faster = rule.model_copy(update={"human_acceleration_mps2": 2.0 + more})
    assert limit(rule) >= limit(later) - 1e-9
    assert limit(rule) >= limit(faster) - 1e-9
    assert min(limit(later), limit(faster)) >= limit(None)


def test_the_presets_have_the_rule_with_own_delays_and_it_survives_a_file(tmp_path: Any) -> None:
    for name in ("blind", "conservative", "balanced", "assertive"):
        standing = AwarenessPolicy.preset(name).rules.standing
        assert standing == StandingPeople(delay_from_tracks=True)
    STANDING.to_yaml(tmp_path / "mine.yaml")
    assert AwarenessPolicy.from_yaml(tmp_path / "mine.yaml") == STANDING


def test_a_rule_that_leaves_out_slow_walkers_is_refused() -> None:
    message = (
        r"standing_below_mps must be at most human_acceleration_mps2 × start_delay_s = 0.2 m/s, "
        r"got 0.3 m/s"
    )
    with pytest.raises(ValueError, match=message):
        StandingPeople(start_delay_s=0.1, standing_below_mps=0.3)
    with pytest.raises(ValueError, match="did you mean 'standing'"):
        SpeedRules.model_validate({"standin": {}})
    assert issubclass(StandingPeople.error, NavError)
