"""People who have noticed the robot and look at it no more: whom it counts for, how much."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, numbers, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from tracking import PersonTrack


def with_rule(policy: AwarenessPolicy, counts_as: float | None = 0.6) -> AwarenessPolicy:
    return policy.model_copy(update={"noticed_counts_as": counts_as})


NOTICED = with_rule(AwarenessPolicy())


def noticing(track: PersonTrack, noticed: float = 0.9) -> PersonTrack:
    return replace(track, noticed=noticed)


def constraints(*tracks: PersonTrack, policy: AwarenessPolicy = NOTICED) -> NavConstraints:
    """Return the constraints for people who have been seen for 0.4 s."""
    return settled_update(tracks, policy=policy)


def test_it_counts_as_that_awareness_and_never_lowers_it() -> None:
    near = person(position=(2.0, 0.0))
    aware = constraints(replace(near, awareness_lower=0.6))
    assert numbers(constraints(noticing(near))) == numbers(aware)
    assert aware.speed_limit_mps > constraints(near).speed_limit_mps + 0.2
    for belief, lower in ((0.49, 0.0), (0.5, 0.6)):
        (obstacle,) = constraints(noticing(near, belief)).obstacles
        assert obstacle.awareness_lower == lower
    half = with_rule(AwarenessPolicy(), 0.4)
    assert numbers(constraints(noticing(near), policy=half)) == numbers(
        constraints(replace(near, awareness_lower=0.4), policy=half)
    )
    looks = replace(near, awareness_lower=0.9)
    assert numbers(constraints(noticing(looks), policy=half)) == numbers(
        constraints(looks, policy=half)
    )


@pytest.mark.parametrize("name", ["conservative", "assertive", "blind"])
def test_policies_without_the_rule_ignore_it_and_cautious_presets_have_no_memory(name: str) -> None:
    preset = AwarenessPolicy.preset(name)
    without = with_rule(preset, None)
    with_belief = constraints(noticing(person()), policy=without)
    assert numbers(with_belief) == numbers(constraints(person(), policy=without))
    if name != "assertive":
        assert (preset.noticed_counts_as, preset.filter.noticed_memory_s) == (None, 0.0)


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


@settings(max_examples=30, deadline=None)
@given(
    policy=policies(),
    robot=robots(),
    tracks=crowds(),
    belief=st.floats(0.0, 1.0),
    level=st.floats(0.0, 1.0),
)
def test_it_never_allows_more_than_that_awareness_itself(policy, robot, tracks, belief, level):
    ruled = with_rule(policy, level)
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
