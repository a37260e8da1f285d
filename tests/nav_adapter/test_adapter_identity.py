"""Identities: whatever a tracker does with its ids, people keep their limits and their requests."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import histories, policies, robots
from nav_scenes import ROBOT, finite, numbers, person, robot_at

from nav_adapter import Alert, AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.policies import AttentionRules
from tracking import PersonTrack

PERIOD_S = 0.05
ROUNDING = 1e-9
FEW = settings(max_examples=25)
Places = list[tuple[float, float]]


def frame(
    adapter: NavAdapter, now: float, tracks: Sequence[PersonTrack], speed_mps: float = 0.6
) -> NavConstraints:
    state = robot_at(now, speed_mps=speed_mps)
    return adapter.update(tracks, state, now, perception_stamp_s=now)


def places(least_apart_m: float) -> st.SearchStrategy[Places]:
    """Two to four places around the robot, so far apart that nobody can be mistaken."""
    place = st.tuples(finite(-4.0, 6.0), finite(-4.0, 4.0))
    return st.lists(place, min_size=2, max_size=4).filter(
        lambda all_: all(
            math.dist(a, b) > least_apart_m for i, a in enumerate(all_) for b in all_[:i]
        )
    )


def seen(at: Places, now: float, ids: Sequence[int], lowers: Sequence[float]) -> list[PersonTrack]:
    return [
        person(now, track_id=i, position=place, sigma_m=0.05, awareness_lower=lower)
        for place, i, lower in zip(at, ids, lowers, strict=False)
    ]


@FEW
@given(
    at=places(1.0),
    order=st.permutations(range(4)),
    lowers=st.lists(st.sampled_from([0.0, 0.3, 0.9]), min_size=4, max_size=4),
)
def test_exchanged_ids_never_raise_the_limit_nor_lose_anybody(at, order, lowers) -> None:
    ids = [i for i in order if i < len(at)]
    honest, exchanging = NavAdapter(AwarenessPolicy(), ROBOT), NavAdapter(AwarenessPolicy(), ROBOT)
    for k in range(30):
        now = k * PERIOD_S
        right = frame(honest, now, seen(at, now, range(4), lowers))
        wrong = frame(exchanging, now, seen(at, now, ids if k >= 15 else range(4), lowers))
        assert wrong.speed_limit_mps <= right.speed_limit_mps + ROUNDING
        centers = sorted(tuple(each.center_odom_m) for each in wrong.obstacles)
        assert centers == sorted(at)


@FEW
@given(
    at=places(2.5),
    lost_for=st.integers(0, 50),
    gone=st.sampled_from(["missing", "coasting"]),
    status=st.sampled_from(["tentative", "confirmed"]),
)
def test_a_reused_id_frees_nobody(at: Places, lost_for: int, gone: str, status: str) -> None:
    """It counts as a new one, whoever had it: shown until now, missing or lost."""
    results = {}
    for new_id in (1, 7):
        adapter, results[new_id] = NavAdapter(AwarenessPolicy(), ROBOT), []
        for k in range(30 + lost_for + 30):
            now, late = k * PERIOD_S, k - 30
            unseen_s = max(0.0, late * PERIOD_S)
            tracks = [person(now, track_id=1, position=at[0], sigma_m=0.05)] if late < 0 else []
            if gone == "coasting" and 0 <= late < lost_for:
                coasting = person(now, track_id=1, position=at[0], sigma_m=0.05, unseen_s=unseen_s)
                tracks = [replace(coasting, status="coasting")]
            if late >= lost_for:
                # Farther off than anybody walks in that time.
                far = at[1][0] + 40.0, at[1][1]
                tracks = [person(now, track_id=new_id, position=far, status=status)]
            results[new_id].append(frame(adapter, now, tracks, 0.2))
    for reused, fresh in zip(results[1], results[7], strict=True):
        assert reused.speed_limit_mps == fresh.speed_limit_mps
        mine, other = (
            sorted((*each.center_odom_m, each.radius_m) for each in result.obstacles)
            for result in (reused, fresh)
        )
        assert mine == other


@FEW
@given(policy=policies(), robot=robots(), walk=histories(8), ids=st.permutations(range(40, 80)))
def test_other_ids_change_the_ids_alone(policy, robot, walk, ids) -> None:
    one, other, now = NavAdapter(policy, robot), NavAdapter(policy, robot), 0.0
    for dt, speed_mps, _, people in walk:
        now += dt
        tracks = [replace(each, stamp_s=each.stamp_s + now) for each in people]
        mine = frame(one, now, tracks, speed_mps)
        theirs = frame(other, now, [replace(each, id=ids[each.id]) for each in tracks], speed_mps)
        assert theirs.speed_limit_mps == mine.speed_limit_mps
        assert theirs.braking_suffices == mine.braking_suffices
        shown, renamed = (
            {each.track_id: (*each.center_odom_m, each.radius_m) for each in result.obstacles}
            for result in (mine, theirs)
        )
        assert {(ids[i] if i >= 0 else i): values for i, values in shown.items()} == renamed
        assert [(ids[each.track_id], each.kind) for each in mine.alerts] == [
            (each.track_id, each.kind) for each in theirs.alerts
        ]


@FEW
@given(
    policy=policies(),
    robot=robots(),
    walk=histories(8),
    calls=st.lists(st.lists(finite(0.0, 1.0), max_size=3), min_size=8, max_size=8),
)
def test_a_watchdog_between_updates_changes_none_of_them(policy, robot, walk, calls) -> None:
    watched, alone, now = NavAdapter(policy, robot), NavAdapter(policy, robot), 0.0
    for (dt, speed_mps, _, people), between in zip(walk, calls, strict=False):
        for share in sorted(between):
            result = watched.watchdog(now + share * dt)
            assert (result.alerts, result.answers) == ((), ())
        now += dt
        tracks = [replace(each, stamp_s=each.stamp_s + now) for each in people]
        mine, other = (frame(each, now, tracks, speed_mps) for each in (watched, alone))
        assert numbers(mine) == numbers(other)
        assert (mine.alerts, mine.answers) == (other.alerts, other.answers)


BESIDE, FAR = (3.5, 1.3), (-4.0, 5.0)


def requests(tracks_at: Callable[[float], list[PersonTrack]], until_s: float) -> list[Alert]:
    """The requests of a robot at 1 m/s, at 10 Hz."""
    adapter = NavAdapter(AwarenessPolicy(attention=AttentionRules()), ROBOT)
    return [
        alert
        for k in range(round(until_s / 0.1))
        for alert in frame(adapter, 0.1 * k, tracks_at(0.1 * k), 1.0).alerts
        if alert.kind == "attention"
    ]


def beside(now: float, track_id: int, place: tuple[float, float] = BESIDE) -> PersonTrack:
    return replace(person(now, track_id=track_id, position=place, sigma_m=0.02), awareness=0.3)


@pytest.mark.parametrize("exchanged_s", [0.55, 1.15, 1.25, 2.05])
def test_requests_follow_the_person_whose_id_is_exchanged(exchanged_s: float) -> None:
    """Somebody far off gets the id of the person who limits the robot, and the other way round."""

    def tracks_at(now: float) -> list[PersonTrack]:
        own, other = (1, 2) if now < exchanged_s else (2, 1)
        return [beside(now, own), beside(now, other, FAR)]

    asked = requests(tracks_at, 3.0)
    # Nobody is asked before frames have shown them for 1 s; after the exchange it counts anew.
    due = [1] if exchanged_s > 1.05 else [2]
    assert [each.track_id for each in asked] == due
    assert len(requests(lambda now: [beside(now, 1), beside(now, 2, FAR)], 3.0)) == 1


def test_a_person_whose_id_is_gone_is_not_asked_as_somebody_else() -> None:
    def tracks_at(now: float) -> list[PersonTrack]:
        return [beside(now, 1, BESIDE if now < 1.15 else FAR)]

    assert [each.track_id for each in requests(tracks_at, 3.0)] == [1]
