"""An episode's row: every field from what is known of the crossing, and what it must not see."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_scenes import ALONG_M, BODY_RADIUS_M, contact, crossing, straight, track_at, walking

from nav_adapter import Alert
from sim_tests import run_crossing
from sim_tests.actors.behaviour import PersonOutcome
from sim_tests.study.measures import measure
from sim_tests.study.measures._awareness import awareness_class, matched_tracks, nearest_person

T_S = np.arange(0.0, 8.001, 0.05)


def test_zones_are_timed_by_the_surfaces():
    """At 0.5 m/s towards somebody: from 1.2 m to 0.45 m takes 1.5 s, and on to 0.05 m 0.8 s."""
    gap = 4.05
    person = walking((gap + ALONG_M + BODY_RADIUS_M, 0.0), (0.0, 0.0))
    record = measure(crossing(T_S, straight(0.5), [person], reached=False))
    assert record.min_separation_m == pytest.approx(0.05, abs=1e-6)
    assert record.personal_s == pytest.approx(2.3, abs=0.051)
    assert record.intimate_s == pytest.approx(0.8, abs=0.051)
    assert record.speed_at_min_separation_mps == 0.5
    assert record.min_time_to_collision_s == pytest.approx(0.05 / 0.5, abs=1e-6)


EMPTY = {"time_without_people_s": 6.5, "length_without_people_m": 7.6}


def test_way_and_time_against_the_same_task_without_people():
    result = crossing(T_S, straight(1.0), time_to_goal_s=8.0, **EMPTY)
    record = measure(result)
    assert record.path_length_m == pytest.approx(8.0)
    assert record.spl == pytest.approx(7.6 / 8.0)
    assert record.time_lost_s == pytest.approx(1.5)
    assert record.min_separation_m is record.min_margin_m is record.post_encroachment_s is None
    unknown = measure(crossing(T_S, straight(1.0), time_to_goal_s=8.0))
    assert unknown.time_lost_s is unknown.spl is None


def test_a_printed_result_has_its_main_figures():
    text = repr(crossing(T_S, straight(1.0), [walking((20.0, 0.0), (0.0, 0.0))]))
    assert "success=True, contact_by='', min_separation_m=11." in text
    assert f"frames=<{len(T_S)} CrossingFrame>" in text


def test_not_reaching_the_goal_loses_all_of_the_time():
    record = measure(crossing(T_S, straight(1.0), reached=False, **EMPTY))
    assert (record.time_lost_s, record.spl, record.time_to_goal_s) == (8.0, 0.0, None)


def test_contacts_are_split_and_a_contact_is_no_separation():
    touches = (
        contact(1.0, 0, "person", 0.9),
        contact(2.0, 0, "robot", 0.4),
        contact(3.0, 0, "robot", 0.2),
    )
    person = walking((20.0, 0.0), (0.0, 0.0))
    record = measure(crossing(T_S, straight(1.0), [person], contacts=touches))
    assert (record.contacts, record.robot_contacts, record.person_contacts) == (3, 2, 1)
    assert record.contact_speed_mps == 0.4
    assert (record.moving_contacts, record.moving_contact_mps) == (3, 0.9)
    assert (record.min_separation_m, record.speed_at_min_separation_mps) == (0.0, 0.9)
    assert not record.success
    by_person = measure(crossing(T_S, straight(1.0), [person], contacts=touches[:1]))
    assert by_person.contact_speed_mps is None
    assert (by_person.moving_contacts, by_person.moving_contact_mps) == (1, 0.9)
    assert by_person.success
    standing = (contact(1.0, 0, "person", 0.02),)
    walked_into = measure(crossing(T_S, straight(0.02), [person], contacts=standing))
    assert (walked_into.contacts, walked_into.moving_contacts) == (1, 0)
    assert walked_into.moving_contact_mps is None


def test_contacts_and_margins_are_counted_by_what_people_have_noticed():
    """The person looks from 2 s to 3 s, and faces the robot all the time."""

    def record(*touches):
        result = crossing(
            T_S,
            straight(1.0),
            [walking((20.0, 0.0), (0.0, 0.0))],
            awareness=lambda t, person: 0.9,
            looks=lambda t, person: 2.0 <= t <= 3.0,
            contacts=touches,
        )
        return measure(result)

    def counts(record):
        return tuple(
            (
                getattr(record, f"moving_contacts_{each}"),
                getattr(record, f"moving_contact_{each}_mps"),
            )
            for each in ("never", "past", "looking")
        )

    before, looking = contact(1.0, 0, "person", 0.9), contact(2.5, 0, "robot", 1.2)
    shortly, later = contact(4.0, 0, "robot", 0.7), contact(4.2, 0, "robot", 0.3)
    found = record(before, looking, shortly, later)
    assert (found.moving_contacts, found.moving_contact_mps) == (4, 1.2)
    assert counts(found) == ((1.0, 0.9), (1.0, 0.3), (2.0, 1.2))
    # The robot comes nearer all the time.
    assert found.min_margin_past_m == found.min_margin_m < found.min_margin_looking_m
    assert found.min_margin_looking_m < found.min_margin_never_m
    # A standing robot has stopped for everybody.
    assert counts(record(contact(1.0, 0, "person", 0.02))) == ((0.0, None),) * 3


def test_warnings_are_counted_as_they_are_asked_for():
    def alerts(t):
        return (Alert(1, "horn", 1.0, 0.1, "close"),) if t in (1.0, 2.0) else ()

    assert measure(crossing(T_S, straight(1.0), alerts=alerts)).warnings == 2


def outcome(**values):
    return PersonOutcome(name="somebody", **values)


def human_cost(*people):
    record = measure(crossing(T_S, straight(1.0), people=people))
    return record.human_delay_s, record.human_detour_m


def test_people_are_delayed_by_what_is_over_their_free_walk():
    done = outcome(time_s=12.0, free_time_s=10.0, length_m=14.5, free_length_m=13.0)
    early = outcome(time_s=9.5, free_time_s=10.0, length_m=13.0, free_length_m=13.0)
    not_started = outcome(free_time_s=10.0, free_length_m=13.0)
    standing = outcome()
    assert human_cost(done, early, not_started, standing) == (1.5, 1.5)
    assert human_cost(not_started, standing) == (None, None)


def test_somebody_who_is_blocked_for_good_costs_more_than_somebody_who_is_delayed():
    delayed = outcome(time_s=15.0, free_time_s=10.0, length_m=13.0, free_length_m=13.0)
    blocked = outcome(late_s=24.0, free_time_s=10.0, length_m=5.0, free_length_m=13.0)
    assert human_cost(delayed) == (5.0, 0.0)
    assert human_cost(blocked) == (24.0, None)
    assert human_cost(delayed, blocked) == (29.0, 0.0)


def test_the_reaction_is_that_of_who_came_nearest():
    """People of the scenario come first, then replayed ones, who have no outcome."""
    places = [(5.0, 3.0), (5.0, 1.0), (5.0, 2.0)]
    people = [walking(place, (0.0, 0.0)) for place in places]
    outcomes = (outcome(reaction="wait"), outcome(reaction="hurry"))

    def reaction(outcomes):
        return measure(crossing(T_S, straight(1.0), people, people=outcomes)).reaction

    assert reaction(outcomes) == "hurry"
    assert reaction(outcomes[:1]) == ""  # a replayed one came nearest


def test_the_error_of_awareness_is_over_those_with_a_track():
    people = [walking((4.0, 2.0), (0.0, 0.0)), walking((4.0, -2.0), (0.0, 0.0))]
    record = measure(
        crossing(
            T_S,
            straight(0.5),
            people,
            awareness=lambda t, person: 0.7,
            tracked=lambda t, person: (0.5, 0.2) if person == 1 else None,
        )
    )
    assert record.awareness_error == pytest.approx(0.2)
    assert measure(crossing(T_S, straight(0.5), people)).awareness_error is None


def test_tracks_go_to_people_within_a_metre_by_the_least_sum():
    people = np.array([[0.0, 0.0], [0.8, 0.0], [9.0, 0.0]])
    tracks = np.array([[0.7, 0.0], [-0.5, 0.0], [10.1, 0.0]])
    track, person = matched_tracks(tracks, people)
    assert sorted(zip(track.tolist(), person.tolist(), strict=True)) == [(0, 1), (1, 0)]
    assert len(matched_tracks(np.zeros((0, 2)), people)[0]) == 0


@pytest.mark.parametrize(
    ("looking", "lower", "expected"),
    [
        (True, 0.6, "aware"),
        (True, 0.3, "missed_aware"),
        (True, math.nan, "missed_aware"),
        (False, 0.6, "falsely_aware"),
        (False, 0.1, "unaware"),
        (False, math.nan, "unaware"),
        (True, 0.5, "aware"),
    ],
)
def test_four_classes_of_awareness(looking, lower, expected):
    looks, lowers = np.full(len(T_S), looking), np.full(len(T_S), lower)
    assert awareness_class(T_S, looks, lowers, 100) == expected


def test_only_the_last_three_seconds_count_and_half_of_them_suffices():
    row = 120  # t = 6 s: the window has 61 instants from 3 s on
    looks = T_S > 4.5 - 1e-9  # 31 of them
    assert awareness_class(T_S, looks, np.zeros(len(T_S)), row) == "missed_aware"
    later = T_S > 4.55 - 1e-9  # 30 of them
    assert awareness_class(T_S, later, np.zeros(len(T_S)), row) == "unaware"
    before = T_S < 3.0 - 1e-9
    assert awareness_class(T_S, before, before, row) == "unaware"
    assert awareness_class(T_S, before, before, 20) == "aware"  # all there is


def test_nobody_beyond_three_point_six_metres_was_encountered():
    apart = np.array([[5.0, 4.0], [3.7, 3.9]])
    assert nearest_person(apart) is None
    assert nearest_person(apart - 0.2) == (1, 0)
    # While both stand, micrometres do not choose the instant.
    assert nearest_person(np.array([[2.0], [1.0 + 1e-6], [1.0]])) == (1, 0)
    assert nearest_person(np.zeros((3, 0))) is None


def turned(function, angle, shift):
    """A pose (x, y, heading, speed) or a walk (x, y, vx, vy) of another odom frame."""
    cos, sin = math.cos(angle), math.sin(angle)

    def moved(t, is_robot):
        x, y, third, fourth = function(t)
        place = (cos * x - sin * y + shift[0], sin * x + cos * y + shift[1])
        if is_robot:
            return (*place, third + angle, fourth)
        return (*place, cos * third - sin * fourth, sin * third + cos * fourth)

    return moved


def curve(t):
    """A robot that weaves and slows."""
    speed = 1.0 - 0.1 * t
    return (t - 0.05 * t * t, 0.3 * math.sin(t), 0.3 * math.cos(t), speed)


PEOPLE = (walking((3.0, -3.0), (0.1, 0.9)), walking((5.0, 1.2), (-0.6, -0.1)))


def seen(t, person):
    return (0.6, 0.4) if person == 0 else None


@settings(max_examples=10)
@given(st.floats(-math.pi, math.pi), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_the_row_does_not_depend_on_the_odom_frame(angle, x, y):
    record = measure(crossing(T_S, curve, PEOPLE, tracked=seen, time_without_people_s=5.0))
    robot = turned(curve, angle, (x, y))
    people = [turned(person, angle, (x, y)) for person in PEOPLE]
    other = measure(
        crossing(
            T_S,
            lambda t: robot(t, True),
            [lambda t, person=person: person(t, False) for person in people],
            tracked=seen,
            time_without_people_s=5.0,
        )
    )
    for name in record.__dataclass_fields__:
        mine, yours = getattr(record, name), getattr(other, name)
        assert mine == (pytest.approx(yours, abs=3e-6) if isinstance(mine, float) else yours), name


def test_the_row_does_not_depend_on_the_order_of_people_and_tracks():
    result = crossing(T_S, curve, PEOPLE, awareness=lambda t, person: 0.2, tracked=seen)
    swapped = crossing(
        T_S,
        curve,
        PEOPLE[::-1],
        awareness=lambda t, person: 0.2,
        tracked=lambda t, person: seen(t, 1 - person),
    )
    ghost = track_at((50.0, 50.0), 0.9, 0.9, ident=9)
    frames = tuple(
        replace(frame, tracks=(ghost, *reversed(frame.tracks))) for frame in swapped.frames
    )
    assert measure(replace(swapped, frames=frames)) == measure(result)


def test_a_real_crossing_says_in_frames_what_the_meter_said():
    crossed = run_crossing("crossing_attentive", policy="balanced", perception="truth", seed=2)
    result = replace(crossed, time_without_people_s=10.0, length_without_people_m=12.8)
    record = measure(result)
    assert record.min_separation_m == pytest.approx(result.min_separation_m, abs=1e-6)
    nearest = min(result.frames, key=lambda frame: frame.separations_m[0])
    speed = nearest.approaches[0].robot_speed_mps
    assert record.speed_at_min_separation_mps == pytest.approx(speed, abs=1e-6)
    assert 0.9 < record.spl <= 1.0
    assert 0.5 < record.peak_deceleration_mps2 < 1.3
    assert record.awareness != ""
    assert record.time_lost_s == pytest.approx(result.time_to_goal_s - 10.0)
