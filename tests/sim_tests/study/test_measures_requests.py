"""Requests for attention: what counts as a request, an answer and a nuisance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_scenes import crossing, straight, walking
from shapely.geometry import Point

from nav_adapter import Alert, PersonObstacle
from nav_adapter.alerts import Answer
from sim_tests.study.measures import EpisodeRecord, measure, summarise

T_S = np.round(np.arange(0.0, 10.001, 0.05), 2)
AHEAD, BESIDE = (6.0, 0.0), (6.0, 0.6)
COLUMNS = (
    "requests",
    "requests_answered",
    "requests_needless",
    "asked_twice",
    "requests_after_answer",
)


def asks(track_id):
    return Alert(track_id, "attention", 1.0, 0.1, "limits the robot", means="light", wins_s=1.0)


def obstacle(track_id, place):
    return PersonObstacle(track_id, place, (0.0, 0.0), 0.5, 1.75, 0.0, Point(place).buffer(0.6))


def measured(asked, *, looks=(), tracks=None, limits=(), answers=(), people=(AHEAD,), until=10.0):
    """The requests of a crossing past standing people.

    ``asked`` and ``answers`` hold (time, track); ``looks`` (from, to, person); ``limits`` (from,
    to, track); ``tracks`` the obstacles' places by track, by default each person's.
    """
    places = dict(enumerate(people, start=1)) if tracks is None else tracks

    def constraints(t):
        limiting = next((f"track {i}: reach" for a, b, i in limits if a <= t <= b), "robot maximum")
        return {
            "obstacles": tuple(obstacle(ident, place) for ident, place in places.items()),
            "limited_by": limiting,
            "alerts": tuple(asks(ident) for at, ident in asked if at == t),
            "answers": tuple(Answer(ident, 0.5) for at, ident in answers if at == t),
        }

    def looking(t, person):
        return any(a <= t <= b and person == who for a, b, who in looks)

    found = measure(
        crossing(
            T_S[until >= T_S],
            straight(0.4),
            [walking(place, (0.0, 0.0)) for place in people],
            looks=looking,
            constraints=constraints,
        )
    )
    return tuple(getattr(found, name) for name in COLUMNS)


STILL = [(0.0, 10.0, 1)]  # track 1 sets the limit throughout


@pytest.mark.parametrize(
    ("looks", "answered"),
    [
        ([], 0),
        ([(3.0, 3.5, 0)], 1),
        ([(4.5, 5.0, 0)], 1),  # 2.5 s after
        ([(4.55, 5.0, 0)], 0),
        ([(1.0, 3.5, 0)], 0),  # looked already
        ([(1.0, 1.5, 0), (2.5, 3.0, 0)], 0),  # 0.5 s before
        ([(1.0, 1.45, 0), (2.5, 3.0, 0)], 1),
        ([(2.0, 3.0, 0)], 0),  # at the instant of the request: nobody is as fast
        ([(3.0, 3.5, 1)], 0),  # somebody else
    ],
)
def test_an_answer_is_a_look_that_begins_after_the_request(looks, answered):
    found = measured([(2.0, 1)], looks=looks, limits=STILL, people=(AHEAD, (6.0, 3.0)))
    assert found[:2] == (1, answered)


@pytest.mark.parametrize(
    ("limits", "looks", "needless"),
    [
        ([(0.0, 10.0, 1)], [], 0),
        ([(0.0, 2.95, 1)], [], 1),
        ([(0.0, 3.0, 1)], [], 0),
        ([(0.0, 2.5, 1)], [(2.6, 2.8, 0)], 0),  # passed after a look: what asking is for
        ([(0.0, 2.5, 1)], [(3.05, 4.0, 0)], 1),
        ([(0.0, 2.5, 1), (2.55, 10.0, 2)], [], 1),  # somebody else is the obstacle
        ([(0.0, 2.5, 1), (2.55, 10.0, 12)], [], 1),  # track 12 is not track 1
    ],
)
def test_a_request_is_needless_if_the_person_is_no_obstacle_a_second_later(limits, looks, needless):
    people = (AHEAD, (6.0, 3.0))
    assert measured([(2.0, 1)], limits=limits, looks=looks, people=people)[2] == needless


def test_the_last_instant_judges_a_request_just_before_the_end():
    assert measured([(2.0, 1)], limits=STILL, until=2.3)[2] == 0
    assert measured([(2.0, 1)], limits=[(0.0, 2.1, 1)], until=2.3)[2] == 1


def test_a_new_track_of_the_same_person_is_the_same_person():
    both = {1: AHEAD, 7: (6.1, 0.1)}
    switched = [(0.0, 2.5, 1), (2.55, 10.0, 7)]
    assert measured([(2.0, 1)], tracks=both, limits=switched)[2] == 0
    assert measured([(2.0, 1), (6.0, 7)], tracks=both, limits=switched) == (2, 0, 0, 1, 0)


def test_a_request_is_for_the_nearest_of_two_people_side_by_side():
    def answers(track_place):
        tracks = {1: track_place}
        looks = [(3.0, 4.0, 1)]
        return measured(
            [(2.0, 1)], tracks=tracks, limits=STILL, looks=looks, people=(AHEAD, BESIDE)
        )[1]

    assert [answers((6.0, y)) for y in (0.0, 0.25, 0.35, 0.6)] == [0, 0, 1, 1]


def test_a_request_for_nobody_is_answered_by_nobody():
    looks = [(3.0, 4.0, 0)]
    ghost = {1: (6.0, 1.1)}  # farther than 1 m from everybody
    assert measured([(2.0, 1)], tracks=ghost, looks=looks) == (1, 0, 1, 0, 0)
    assert measured([(2.0, 1)], tracks=ghost, looks=looks, limits=STILL) == (1, 0, 0, 0, 0)
    assert measured([(2.0, 1), (5.0, 1)], tracks={}, people=()) == (2, 0, 2, 0, 0)


def test_people_asked_more_than_once_count_once_each():
    two = (AHEAD, (6.0, 3.0))
    asked = [(1.0, 1), (4.0, 1), (7.0, 1), (5.0, 2)]
    assert measured(asked, people=two, limits=STILL)[3] == 1
    assert measured([*asked, (8.0, 2)], people=two, limits=STILL)[3] == 2


def test_no_request_may_follow_a_measured_answer():
    assert measured([(2.0, 1), (6.0, 1)], answers=[(3.0, 1)], limits=STILL)[4] == 1
    assert measured([(2.0, 1), (3.0, 1)], answers=[(3.0, 1)], limits=STILL)[4] == 1
    assert measured([(2.0, 1), (2.5, 1)], answers=[(3.0, 1)], limits=STILL)[4] == 0
    assert measured([(2.0, 1), (6.0, 2)], answers=[(3.0, 1)], limits=STILL)[4] == 0


def test_a_request_is_no_warning_and_a_warning_no_request():
    def alerts(t):
        warns = Alert(1, "light", 1.0, 0.1, "close"), Alert(2, "voice", 1.0, 0.1, "close")
        return (*warns, asks(1)) if t == 2.0 else (asks(1),) if t == 5.0 else ()

    found = measure(crossing(T_S, straight(1.0), [walking(AHEAD, (0.0, 0.0))], alerts=alerts))
    assert (found.warnings, found.requests) == (2, 2)


@settings(max_examples=15)
@given(
    st.lists(st.tuples(st.sampled_from(T_S.tolist()), st.integers(1, 3)), max_size=6, unique=True),
    st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10), st.integers(0, 1)), max_size=3),
)
def test_no_part_is_larger_than_the_whole(asked, looks):
    requests, answered, needless, twice, after = measured(
        asked, looks=looks, people=(AHEAD, (6.0, 3.0)), limits=[(0.0, 5.0, 1)]
    )
    assert requests == len(asked)
    assert max(answered, needless, after) <= requests
    assert 2 * twice <= requests
    assert requests or not (answered or needless or twice or after)


def asking(seed, policy, duration_s, *counts):
    names = ("requests", "requests_answered", "requests_needless", "asked_twice")
    values = dict(zip(names, counts, strict=False))
    return EpisodeRecord(
        "late_glance", seed, policy, "Q", "truth", True, duration_s=duration_s, **values
    )


ASKED = [
    asking(0, "balanced", 10.0, 4, 1, 2, 1),
    asking(1, "balanced", 30.0, 0, 0, 0, 0),
    asking(2, "balanced", 50.0, 1, 1, 0, 0),
]
BLIND = [asking(seed, "blind", 20.0) for seed in range(3)]


def row_of(records, policy="balanced"):
    return next(row for row in summarise(records).policies if row.variant == policy)


def test_rates_and_shares_are_ratios_of_sums():
    row = row_of([*ASKED, *BLIND])
    values = {name: row.means[name].value for name in row.means}
    assert values["requests"] == pytest.approx(5 / 3)
    assert values["requests_per_hour"] == pytest.approx(5 * 3600 / 90)
    assert values["answered_share"] == pytest.approx(2 / 5)  # not the mean of 1/4 and 1
    assert values["needless_share"] == pytest.approx(2 / 5)
    assert values["asked_twice"] == pytest.approx(1 / 3)
    assert row.asked
    blind = row_of([*ASKED, *BLIND], "blind")
    assert not blind.asked
    assert blind.means["requests_per_hour"].value == 0.0
    assert not blind.means["answered_share"].known
