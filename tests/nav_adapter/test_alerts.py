"""Alerts: the people, the kinds and the limit on how often."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at

from nav_adapter import Alert, AwarenessPolicy, NavAdapter, NavConstraints, NavError
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

# docs/policies.md: the same alert to the same person, and any two sounds.
REPEAT_AFTER_S, QUIET_S = 3.0, 1.0


def warned(
    *tracks: PersonTrack, speed_mps: float = 1.0, policy: AwarenessPolicy | None = None
) -> tuple[Alert, ...]:
    adapter = NavAdapter(policy or AwarenessPolicy(), ROBOT)
    return adapter.update(tracks, robot_at(speed_mps=speed_mps), 0.0).alerts


@pytest.mark.parametrize(
    ("x_m", "kind"), [(1.5, "horn"), (3.0, "voice"), (4.5, "light"), (5.5, None)]
)
def test_a_nearer_person_gets_a_louder_alert(x_m: float, kind: str | None) -> None:
    alerts = warned(person(position=(x_m, 0.0)))
    assert [alert.kind for alert in alerts] == ([] if kind is None else [kind])
    for alert in alerts:
        assert alert.track_id == 1
        assert alert.time_to_closest_s == pytest.approx(x_m)
        assert alert.closest_gap_m == 0.0
        assert alert.reason == (
            f"track 1: unaware (lower bound 0.00), closest approach of 0.0 m in {x_m:.1f} s"
        )


@pytest.mark.parametrize("gap_m", [0.45, 0.55])
def test_people_whom_the_robot_passes_within_half_a_metre_are_warned(gap_m: float) -> None:
    beside_m = ROBOT.circumscribed_radius_m + BODY_RADIUS_M + gap_m
    assert bool(warned(person(position=(2.0, beside_m)))) is (gap_m < 0.5)


def test_a_crossing_course_in_closed_form() -> None:
    """Robot along x at 1 m/s, person along −y at 1 m/s: nearest at 2.5 s, 0.71 m apart."""
    (alert,) = warned(person(position=(2.0, 3.0), velocity=(0.0, -1.0)))
    assert alert.time_to_closest_s == pytest.approx(2.5)
    gap = 0.5 * 2.0**0.5 - ROBOT.circumscribed_radius_m - BODY_RADIUS_M
    assert alert.closest_gap_m == pytest.approx(max(gap, 0.0))


@pytest.mark.parametrize(
    "track",
    [
        person(position=(2.0, 0.0), awareness_lower=0.3),
        person(position=(2.0, 0.0), status="tentative"),
        person(position=(-2.0, 0.0)),
        person(position=(2.0, 2.0)),
        person(position=(2.0, 0.0), velocity=(1.2, 0.0)),
        person(position=(2.0, 0.0), velocity=(1.0, 0.0)),
    ],
    ids=["aware", "tentative", "behind", "beside", "faster away", "same velocity"],
)
def test_people_without_a_conflict_are_not_warned(track: PersonTrack) -> None:
    assert warned(track) == ()


def test_a_standing_robot_a_policy_without_alerts_and_stale_data_warn_nobody() -> None:
    coming, moving = person(position=(2.0, 0.0), velocity=(-1.0, 0.0)), robot_at(1.0, speed_mps=1.0)
    assert len(warned(coming)) == 1
    assert warned(coming, speed_mps=0.0) == ()
    assert warned(coming, policy=AwarenessPolicy(alerts=None)) == ()
    late = NavAdapter(AwarenessPolicy(), ROBOT).update((coming,), moving, 1.0, perception_stamp_s=0)
    assert (late.stale, late.alerts) == (True, ())


def test_a_louder_sound_waits_for_no_softer_one() -> None:
    """Somebody gets the voice; then another one steps out, for whom only the horn is left."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    far, out = person(position=(3.0, 0.0)), person(position=(1.2, 0.1), track_id=2)
    given_: list[tuple[int, str]] = []
    for now, people in ((0.0, [far]), (0.4, [far, out]), (0.8, [far, out]), (1.3, [far])):
        tracks = [replace(each, stamp_s=now) for each in people]
        result = adapter.update(tracks, robot_at(now, speed_mps=1.0), now)
        given_ += [(alert.track_id, alert.kind) for alert in result.alerts]
    assert given_ == [(1, "voice"), (2, "horn")]
    other = replace(far, id=3, stamp_s=1.35)
    soft = adapter.update([other], robot_at(1.35, speed_mps=1.0), 1.35)
    assert soft.alerts == ()  # no voice within a second of the horn
    loud = adapter.update([replace(other, stamp_s=1.45)], robot_at(1.45, speed_mps=1.0), 1.45)
    assert [alert.kind for alert in loud.alerts] == ["voice"]


@given(people=crowds(max_size=3), rates=st.lists(finite(0.05, 0.4), min_size=1, max_size=20))
def test_alerts_are_limited_in_rate(people: tuple[PersonTrack, ...], rates: list[float]) -> None:
    adapter, now = NavAdapter(AwarenessPolicy(), ROBOT), 0.0
    given_s: dict[tuple[int, str], float] = {}
    loudness, sounded_s = {"light": 0, "voice": 1, "horn": 2}, {0: -100.0, 1: -100.0, 2: -100.0}
    for dt in rates:
        now += dt
        result: NavConstraints = adapter.update(
            people, robot_at(now, speed_mps=1.0), now, perception_stamp_s=now
        )
        times = [alert.time_to_closest_s for alert in result.alerts]
        assert times == sorted(times)
        assert len({alert.track_id for alert in result.alerts}) == len(result.alerts)
        for alert in result.alerts:
            key = (alert.track_id, alert.kind)
            assert now - given_s.get(key, -100.0) >= REPEAT_AFTER_S
            given_s[key] = now
            loud = loudness[alert.kind]
            if loud:
                assert all(now - sounded_s[each] >= QUIET_S for each in range(loud, 3))
                sounded_s[loud] = now


def test_a_refused_update_uses_up_no_alert() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    track, state = person(position=(2.5, 0.0)), robot_at(speed_mps=1.0)
    with pytest.raises(NavError, match="distinct ids"):
        adapter.update((track, track), state, 0.0)
    assert len(adapter.update((track,), state, 0.0).alerts) == 1
    assert adapter.update((track,), state, 0.0).alerts == ()
