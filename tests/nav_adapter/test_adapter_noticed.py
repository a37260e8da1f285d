"""People who have noticed the robot and look at it no more: whom it counts for, and how much."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, numbers, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile
from nav_adapter.policies import NoticedPeople, SpeedRules
from tracking import PersonTrack

# Without the reserve for people who set off, which would hide the differences.
BALANCED = AwarenessPolicy(noticed=None, rules=SpeedRules())
RULE = NoticedPeople(at_least=0.5, counts_as_awareness=0.6)


def with_rule(policy: AwarenessPolicy, rule: NoticedPeople | None = RULE) -> AwarenessPolicy:
    return policy.model_copy(update={"noticed": rule})


NOTICED = with_rule(BALANCED)


def noticing(track: PersonTrack, noticed: float = 0.9) -> PersonTrack:
    return replace(track, noticed=noticed)


def constraints(*tracks: PersonTrack, policy: AwarenessPolicy = NOTICED) -> NavConstraints:
    """Return the constraints for people who have been seen for 0.4 s."""
    return settled_update(tracks, policy=policy)


UNAWARE = constraints(person())


def test_it_counts_as_aware_and_not_as_watching() -> None:
    near = person(position=(2.0, 0.0))
    aware = constraints(replace(near, awareness_lower=0.6))
    assert numbers(constraints(noticing(near))) == numbers(aware)
    assert aware.speed_limit_mps > constraints(near).speed_limit_mps + 0.2
    watches = replace(near, awareness_lower=0.9)
    speed = AwarenessPolicy.preset("assertive").speed  # has a level for people who watch
    two_levels = NOTICED.model_copy(update={"speed": speed})
    aware = constraints(noticing(near), policy=two_levels)
    watching = constraints(watches, policy=two_levels)
    assert watching.speed_limit_mps > aware.speed_limit_mps + 0.05
    assert numbers(constraints(noticing(watches), policy=two_levels)) == numbers(watching)


def test_the_obstacle_says_which_bound_was_used() -> None:
    (obstacle,) = constraints(noticing(person())).obstacles
    assert obstacle.awareness_lower == 0.6


@pytest.mark.parametrize("noticed", [0.0, 0.49])
def test_a_weak_belief_counts_nothing(noticed: float) -> None:
    assert numbers(constraints(noticing(person(), noticed))) == numbers(UNAWARE)


@pytest.mark.parametrize("policy", ["conservative", "assertive", "blind"])
def test_presets_without_the_rule_ignore_it(policy: str) -> None:
    preset = with_rule(AwarenessPolicy.preset(policy), None)
    with_belief = constraints(noticing(person()), policy=preset)
    assert numbers(with_belief) == numbers(constraints(person(), policy=preset))


@pytest.mark.parametrize("name", ["conservative", "blind"])
def test_cautious_presets_have_no_memory(name: str) -> None:
    policy = AwarenessPolicy.preset(name)
    assert policy.noticed is None
    assert policy.filter.noticed_memory_s == 0.0


@pytest.mark.parametrize(
    "track",
    [person(status="tentative"), person(status="coasting"), person(unseen_s=0.3)],
    ids=["tentative", "coasting", "unseen"],
)
def test_it_counts_for_people_in_sight_alone(track: PersonTrack) -> None:
    assert numbers(constraints(noticing(track))) == numbers(constraints(track))


def test_with_stale_data_it_counts_nothing() -> None:
    adapter = NavAdapter(NOTICED, ROBOT)
    for tick in range(5):
        now = 0.1 * tick
        adapter.update([noticing(person(now))], robot_at(now), now, perception_stamp_s=now)
    assert adapter.watchdog(0.4).obstacles[0].awareness_lower == 0.6
    assert adapter.watchdog(0.4 + 0.3).obstacles[0].awareness_lower == 0.0  # no longer fresh
    assert adapter.watchdog(0.4 + 0.6).obstacles[0].awareness_lower == 0.0


def test_at_first_sight_and_after_a_jump_the_speed_is_that_for_the_unaware() -> None:
    adapter = NavAdapter(NOTICED, ROBOT)
    first = adapter.update([noticing(person(0.0))], robot_at(), 0.0)
    unaware = NavAdapter(NOTICED, ROBOT).update([person(0.0)], robot_at(), 0.0)
    assert first.speed_limit_mps == unaware.speed_limit_mps
    for tick in range(1, 6):
        now = 0.1 * tick
        settled = adapter.update([noticing(person(now))], robot_at(now), now)
    assert settled.speed_limit_mps > unaware.speed_limit_mps
    elsewhere = noticing(person(0.6, position=(0.5, 2.9)))
    jumped = adapter.update([elsewhere], robot_at(0.6), 0.6)
    stranger = NavAdapter(NOTICED, ROBOT).update(
        [person(0.6, position=(0.5, 2.9))], robot_at(0.6), 0.6
    )
    assert jumped.speed_limit_mps <= stranger.speed_limit_mps


def test_it_holds_no_hysteresis() -> None:
    """Hysteresis is held by looks: what one remembers must not prolong itself."""
    speed = BALANCED.speed.model_copy(update={"shape": "hysteresis"})
    inflation = BALANCED.inflation.model_copy(update={"shape": "hysteresis"})
    policy = with_rule(BALANCED.model_copy(update={"speed": speed, "inflation": inflation}))
    adapter = NavAdapter(policy, ROBOT)
    for tick in range(8):
        now = 0.1 * tick
        adapter.update([noticing(person(now))], robot_at(now), now)
    # A little awareness above unaware_below would hold somebody who was held before.
    left = adapter.update([person(0.8, awareness_lower=0.2)], robot_at(0.8), 0.8)
    never = constraints(person(awareness_lower=0.2), policy=policy)
    assert left.speed_limit_mps == never.speed_limit_mps


@pytest.mark.parametrize(
    ("settings_", "message"),
    [({"at_least": 0.0}, "at_least"), ({"counts_as_awareness": 1.1}, "counts_as_awareness")],
)
def test_settings_out_of_range_are_refused(settings_: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        NoticedPeople(**settings_)


@settings(max_examples=60, deadline=None)
@given(
    policy=policies(),
    robot=robots(),
    tracks=crowds(),
    belief=st.floats(0.0, 1.0),
    level=st.floats(0.0, 1.0),
)
def test_it_never_allows_more_than_that_awareness_itself(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    tracks: tuple[PersonTrack, ...],
    belief: float,
    level: float,
) -> None:
    rule = NoticedPeople(at_least=0.5, counts_as_awareness=level)
    ruled = with_rule(policy, rule)
    remembered = [noticing(track, belief) for track in tracks]
    raised = [replace(track, awareness_lower=max(track.awareness_lower, level)) for track in tracks]
    without = settled_update(tracks, policy=ruled, robot=robot)
    with_belief = settled_update(remembered, policy=ruled, robot=robot)
    as_aware = settled_update(raised, policy=ruled, robot=robot)
    slack = 1e-9
    assert with_belief.speed_limit_mps >= without.speed_limit_mps - slack
    assert with_belief.speed_limit_mps <= as_aware.speed_limit_mps + slack
    if belief < 0.5:
        assert numbers(with_belief) == numbers(without)
