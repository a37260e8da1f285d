"""Requests for attention: whom the adapter asks, how, how often, and the answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import robots
from nav_scenes import ROBOT, crowds, finite, numbers, person, robot_at

from nav_adapter import Alert, AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.policies import AttentionRules
from tracking import PersonTrack

DT_S = 0.1
#: Beside the lane of a robot at 1 m/s, where only an unaware person limits it.
BESIDE = (3.5, 1.3)
SILENT = AwarenessPolicy()
Scene = Callable[[float], Sequence[PersonTrack]]


def policy_of(**rules: Any) -> AwarenessPolicy:
    return AwarenessPolicy(attention=AttentionRules(**rules))


def _person(
    t_s: float,
    track_id: int,
    place: tuple[float, float],
    awareness: float = 0.3,
    awareness_std: float = 0.02,
    **options: Any,
) -> PersonTrack:
    track = person(t_s, track_id=track_id, position=place, **options)
    awareness = max(awareness, track.awareness_lower)
    return replace(track, awareness=awareness, awareness_std=awareness_std)


def standing(*places: tuple[float, float], **options: Any) -> Scene:
    """People who stand relative to the robot, as seen at each instant."""

    def tracks(t_s: float) -> list[PersonTrack]:
        return [
            _person(t_s, number, place, **options) for number, place in enumerate(places, start=1)
        ]

    return tracks


def driven(
    scene: Scene,
    for_s: float = 6.0,
    *,
    policy: AwarenessPolicy | None = None,
    speed_mps: float = 1.0,
    from_s: float = 0.0,
    adapter: NavAdapter | None = None,
) -> list[NavConstraints]:
    """The updates of a robot at the origin whose state says that it drives along x.

    Frames have shown the people of a drive from 0 s on for 0.8 s before, so that they may be asked
    from 0.2 s on.
    """
    adapter = adapter or NavAdapter(policy or policy_of(), ROBOT)
    first = -8 if from_s == 0.0 else 0
    times = (from_s + DT_S * step for step in range(first, round(for_s / DT_S)))
    results = [adapter.update(scene(t), robot_at(t, speed_mps=speed_mps), t) for t in times]
    return results[-first:]


def requests(results: Sequence[NavConstraints]) -> list[tuple[float, Alert]]:
    return [
        (round(result.stamp_s, 6), alert)
        for result in results
        for alert in result.alerts
        if alert.kind == "attention"
    ]


def test_who_limits_the_robot_and_has_not_looked_is_asked_the_quietest_means_first() -> None:
    results = driven(standing(BESIDE), 12.0)
    asked = requests(results)
    # Asked once seen for 1 s; the pause doubles: 2 s, then 4 s.
    assert [t for t, _ in asked] == pytest.approx([0.2, 2.2, 6.2])
    assert [alert.means for _, alert in asked] == ["light", "voice", "voice"]
    limit_mps = results[2].speed_limit_mps
    for _, alert in asked:
        assert alert.track_id == 1
        assert alert.reason == f"track 1: limits the robot to {limit_mps:.1f} m/s, has not looked"
        assert alert.wins_s >= AttentionRules().min_gain_s


def test_the_gain_is_the_time_behind_the_limit_less_the_same_with_a_look() -> None:
    """From a second after the request on: the robot is a metre further on."""
    ((_, alert),) = requests(driven(standing(BESIDE), 1.0))

    def passing_s(look_s: float) -> float:
        x_m, t_s, step_s = 1.0, 0.0, 0.5
        while True:
            lower = 0.6 if t_s < look_s else 0.0
            there = standing((BESIDE[0] - x_m, BESIDE[1]), awareness_lower=lower)
            limit_mps = driven(there, 1.0, policy=SILENT)[-1].speed_limit_mps
            left_m = BESIDE[0] - x_m + 0.3625 + 0.30  # until they are side by side no more
            if left_m <= limit_mps * step_s:
                return t_s + left_m / limit_mps
            x_m, t_s = x_m + limit_mps * step_s, t_s + step_s

    gain_s = passing_s(0.0) - passing_s(4.0)
    assert alert.wins_s == pytest.approx(gain_s, rel=1e-6)
    assert requests(driven(standing(BESIDE), 1.0, policy=policy_of(min_gain_s=gain_s + 0.01))) == []


def test_a_wait_of_both_is_worth_the_longest_time_less_the_way_past() -> None:
    """A robot that must stand beside somebody who stands would wait for ever."""
    beside = standing((0.0, 0.9))
    assert driven(beside, 1.0, policy=SILENT, speed_mps=0.0)[-1].speed_limit_mps < 0.3
    adapter = NavAdapter(policy_of(min_gain_s=5.0), ROBOT)
    driven(standing((20.0, 0.0)), 1.0, adapter=adapter)
    asked = requests(driven(beside, 2.0, speed_mps=0.0, from_s=2.0, adapter=adapter))
    assert asked[0][1].wins_s > 5.0


@pytest.mark.parametrize(
    ("scene", "options"),
    [
        (standing(BESIDE, awareness_lower=0.5), {}),
        (standing(BESIDE, status="tentative"), {}),
        (standing(BESIDE, unseen_s=0.4), {}),
        (standing((3.5, 5.0)), {}),
        (standing((-2.0, 0.8)), {}),
        (standing((1.6, 0.0)), {}),
        (standing(BESIDE), {"policy": SILENT}),
        (standing(BESIDE), {"policy": policy_of(within_m=3.0)}),
        (standing(BESIDE), {"policy": AwarenessPolicy.preset("blind")}),
        (standing(BESIDE), {"speed_mps": 0.0}),
    ],
    ids=[
        *("has looked", "tentative", "out of sight", "no limit", "behind"),
        *("in the path of an aware robot too", "off", "too far", "blind", "parked"),
    ],
)
def test_nobody_else_is_asked(scene: Scene, options: dict[str, Any]) -> None:
    assert requests(driven(scene, 1.0, **options)) == []


def test_a_robot_that_waits_asks_but_one_that_is_parked_does_not() -> None:
    adapter, far = NavAdapter(policy_of(), ROBOT), standing((20.0, 0.0))
    driven(far, 1.0, adapter=adapter)
    assert requests(driven(standing(BESIDE), 2.0, speed_mps=0.0, from_s=2.0, adapter=adapter))
    adapter = NavAdapter(policy_of(), ROBOT)
    driven(far, 1.0, adapter=adapter)
    driven(far, 10.0, speed_mps=0.0, from_s=1.0, adapter=adapter)
    assert not requests(driven(standing(BESIDE), 2.0, speed_mps=0.0, from_s=11.0, adapter=adapter))


def test_a_light_is_left_out_for_somebody_who_looks_far_past_the_robot() -> None:
    averted = standing(BESIDE, awareness=0.05)
    assert [alert.means for _, alert in requests(driven(averted, 1.0))] == ["voice"]
    assert requests(driven(averted, 1.0, policy=policy_of(means=("light",)))) == []


def test_nobody_is_asked_whose_answer_no_camera_would_see() -> None:
    """An α that is not measured is hardly more certain than that of anybody."""
    unseen = standing(BESIDE, awareness=0.05, awareness_std=0.18)
    assert requests(driven(unseen, 1.0)) == []


def test_nobody_is_asked_before_the_look_lasts_until_they_are_passed() -> None:
    """Three seconds of memory and one of looking: 4 s."""

    def ahead(start_m: float, speed_mps: float) -> Scene:
        def tracks(t_s: float) -> list[PersonTrack]:
            place = start_m + speed_mps * t_s, 1.3
            return [person(t_s, position=place, velocity=(speed_mps, 0.0))]

        return tracks

    anything = policy_of(min_gain_s=0.0)
    assert requests(driven(ahead(3.5, 0.0), 1.0, policy=anything))
    assert requests(driven(ahead(3.5, 0.3), 1.0, policy=anything))
    assert not requests(driven(ahead(7.0, 0.3), 1.0, policy=anything))
    # Beside somebody who walks on, a robot is held up for longer than that.
    assert not requests(driven(ahead(3.5, 0.5), 1.0, policy=anything))


def answering(at_s: float, for_s: float = 0.5) -> Scene:
    def tracks(t_s: float) -> list[PersonTrack]:
        looks = at_s - 1e-9 <= t_s < at_s + for_s
        return [_person(t_s, 1, BESIDE, awareness_lower=0.7 if looks else 0.0)]

    return tracks


def test_an_answer_is_reported_once_and_nobody_is_asked_again_for_a_minute() -> None:
    results = driven(answering(1.5), 70.0)
    answers = [(result.stamp_s, each) for result in results for each in result.answers]
    ((answered_s, answer),) = answers
    assert answered_s == pytest.approx(1.5)
    assert answer.track_id == 1
    assert answer.after_s == pytest.approx(1.3)
    assert [t for t, _ in requests(results)][:2] == pytest.approx([0.2, 60.2])


def test_a_look_long_after_the_request_is_no_answer() -> None:
    results = driven(answering(3.1, 0.05), 5.0, policy=policy_of(pause_s=2.0))
    assert [t for t, _ in requests(results)] == pytest.approx([0.2, 2.2])
    assert [each.after_s for r in results for each in r.answers] == [pytest.approx(0.9)]
    late = driven(answering(2.3, 0.05), 3.0, policy=policy_of(pause_s=2.0, per_minute=1))
    assert not any(result.answers for result in late)


@pytest.mark.parametrize(("after_s", "answers"), [(0.1, []), (0.2, []), (0.3, [0.3])])
def test_a_look_before_anybody_could_react_is_no_answer(after_s, answers) -> None:
    results = driven(answering(0.2 + after_s, 0.05), 2.0)
    assert [t for t, _ in requests(results)] == [0.2]
    assert [each.after_s for r in results for each in r.answers] == pytest.approx(answers)


@pytest.mark.parametrize(("picture_s", "answers"), [(0.1, 0), (0.45, 0), (0.55, 1), (None, 1)])
def test_scans_show_nobody_look(picture_s: float | None, answers: int) -> None:
    """A look in the picture of an instant; scans go on to show the person."""

    def tracks(t_s: float) -> list[PersonTrack]:
        looks = 0.55 < t_s < 1.05
        (track,) = standing(BESIDE, awareness_lower=0.7 if looks else 0.0)(t_s)
        return [replace(track, time_since_face_s=None if picture_s is None else t_s - picture_s)]

    def scanned(t_s: float) -> list[PersonTrack]:
        return tracks(t_s) if t_s >= 0.55 else standing(BESIDE)(t_s)

    results = driven(scanned, 2.0)
    assert sum(len(result.answers) for result in results) == answers


@pytest.mark.parametrize("noticed", [0.3, 0.6])
def test_an_answer_allows_no_more_than_any_other_look(noticed: float) -> None:
    """People look before they set off, so nobody who answers is expected to stay."""

    def looks(t_s: float) -> list[PersonTrack]:
        lower = 0.7 if 0.95 < t_s < 1.45 else 0.0
        (track,) = standing(BESIDE, awareness_lower=lower)(t_s)
        return [replace(track, noticed=noticed if 0.95 < t_s < 3.45 else 0.0)]

    asked, unasked = (driven(looks, 6.0, policy=each) for each in (policy_of(), SILENT))
    assert [len(each.answers) for each in asked].count(1) == 1
    assert [numbers(each) for each in asked] == [numbers(each) for each in unasked]


def test_two_side_by_side_are_asked_once_and_two_apart_one_after_the_other() -> None:
    beside = driven(standing((3.5, 1.3), (3.5, 1.9)), 2.0)
    assert [alert.track_id for _, alert in requests(beside)] == [1]
    # Nothing would be won if the one beside them had not looked either.
    apart = driven(standing((3.5, 1.3), (3.5, -1.3)), 2.0)
    assert requests(apart) == []
    looked = [1, 2]

    def one_looks(t_s: float) -> list[PersonTrack]:
        both = standing((3.5, 1.3), (3.5, -1.3))(t_s)
        return [replace(both[0], awareness_lower=0.7), both[1]]

    assert [alert.track_id for _, alert in requests(driven(one_looks, 2.0))] == looked[1:]


def test_a_neighbour_who_answered_is_not_asked_again_when_the_other_one_is() -> None:
    def pair(t_s: float) -> list[PersonTrack]:
        lower = 0.7 if 0.45 < t_s < 1.05 else 0.0
        return [_person(t_s, 1, BESIDE, awareness_lower=lower), _person(t_s, 2, (3.5, 1.9))]

    results = driven(pair, 20.0)
    assert [each.track_id for result in results for each in result.answers] == [1]
    assert [(t, alert.track_id) for t, alert in requests(results)][:1] == [(0.2, 1)]
    assert all(alert.track_id != 1 for t, alert in requests(results) if t > 0.5)


def test_warnings_of_collisions_stay_as_they_are_and_come_first() -> None:
    def towards(t_s: float) -> list[PersonTrack]:
        crossing = person(t_s, position=(3.5, 2.0 - 0.8 * t_s), velocity=(0.0, -0.8))
        return [crossing, person(t_s, track_id=2, position=(3.0, -1.2))]

    silent = driven(towards, 3.0, policy=SILENT)
    asking = driven(towards, 3.0)
    for without, with_requests in zip(silent, asking, strict=True):
        warnings = [alert for alert in with_requests.alerts if alert.kind != "attention"]
        assert tuple(warnings) == without.alerts
        assert list(with_requests.alerts[: len(warnings)]) == warnings
        for alert in with_requests.alerts[len(warnings) :]:
            assert alert.track_id not in {each.track_id for each in warnings}


@st.composite
def histories(draw: st.DrawFn) -> list[tuple[float, float, tuple[PersonTrack, ...]]]:
    """Time steps, speeds of the robot, and the same few people, who look now and then."""
    people = [replace(each, stamp_s=0.0, status="confirmed") for each in draw(crowds(max_size=3))]
    steps = draw(st.lists(st.sampled_from([0.1, 0.2, 1.0]), min_size=4, max_size=25))
    looks, beliefs = st.sampled_from([0.0, 0.0, 0.0, 0.4, 0.8]), st.sampled_from([0.0, 0.3, 0.7])
    return [
        (
            dt,
            draw(st.sampled_from([1.0, 1.0, 0.4, 0.0, -0.5])),
            tuple(
                replace(
                    each, awareness_lower=draw(looks), noticed=draw(beliefs), time_since_seen_s=0.0
                )
                for each in people
            ),
        )
        for dt in steps
    ]


@settings(max_examples=30)
@given(walk=histories(), robot=robots(), per_minute=st.integers(1, 3), gain_s=finite(0.0, 1.0))
def test_requests_change_no_limit_and_keep_to_their_budget(walk, robot, per_minute, gain_s) -> None:
    rules = AttentionRules(min_gain_s=gain_s, per_minute=per_minute)
    asks = NavAdapter(AwarenessPolicy(attention=rules), robot)
    silent = NavAdapter(SILENT, robot)
    now = 0.0
    made: list[tuple[float, int]] = []
    for dt, speed_mps, people in walk:
        now += dt
        tracks = tuple(replace(each, stamp_s=now) for each in people)
        state = robot_at(now, speed_mps=speed_mps)
        mine, other = asks.update(tracks, state, now), silent.update(tracks, state, now)
        assert numbers(mine) == numbers(other)
        assert mine.braking_suffices == other.braking_suffices
        lower = {each.track_id: each.awareness_lower for each in mine.obstacles}
        new = [alert for alert in mine.alerts if alert.kind == "attention"]
        assert len(new) <= 1
        for alert in new:
            assert mine.limited_by.startswith(f"track {alert.track_id}: ")
            assert mine.speed_limit_mps < robot.max_speed_mps
            assert lower[alert.track_id] < 0.5
            assert alert.wins_s >= gain_s
            earlier = [t for t, track_id in made if track_id == alert.track_id]
            for t in earlier[-1:]:
                assert now - t >= rules.pause_s * 2.0 ** (len(earlier) - 1) - 1e-9
            made.append((now, alert.track_id))
        assert sum(now - t < 60.0 - 1e-9 for t, _ in made) <= per_minute


def test_the_state_of_requests_is_forgotten_with_the_people() -> None:
    adapter = NavAdapter(policy_of(), ROBOT)
    assert len(requests(driven(standing(BESIDE), 1.0, adapter=adapter))) == 1
    adapter.reset()
    assert len(requests(driven(standing(BESIDE), 2.0, from_s=1.0, adapter=adapter))) == 1
