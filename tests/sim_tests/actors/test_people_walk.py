"""Walkers without a reaction to a robot: routes, stops, delays, racks, other people, feet."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from staged_people import run_stage

from sim_tests import SimError
from sim_tests.actors.behaviour import (
    ALONE,
    DECISION_PERIOD_S,
    WALKER_RADIUS_M,
    MovingBody,
    Person,
    PersonOutcome,
    PersonSpec,
    RobotBody,
    Surroundings,
)
from sim_tests.world.hall import WarehouseLayout

NO_BOXES = np.empty((0, 4))
HALL = WarehouseLayout.named("crossing").obstacle_boxes_odom


def walker(route, boxes=NO_BOXES, seed: int = 0, **fields) -> Person:
    points = [{"x_m": x, "y_m": y} for x, y in route]
    spec = PersonSpec.model_validate({"name": "walker", "route": points, **fields})
    return Person(spec, np.random.default_rng(seed), boxes)


def walk(person: Person, seconds: float, around=ALONE, hz: float = 20.0) -> np.ndarray:
    """Return rows t, x, y, vx, vy, heading."""
    rows = []
    for n in range(round(seconds * hz) + 1):
        m = person.step(n / hz, around)
        rows.append((n / hz, *m.position_odom_m, *m.velocity_odom_mps, m.heading_odom_rad))
    return np.array(rows)


def test_an_undisturbed_walk_takes_the_free_time_exactly():
    for fields in (
        {},
        {"start_s": 1.33},
        {"pauses": [{"at_m": 2.0, "for_s": 1.5}]},
        {"turns_back_at_m": 3.0},
        {"backwards": True},
        {"speed_mps": 2.0, "heading_deg": 170.0},
    ):
        person = walker([(0, 0), (4, 0), (6, 3)], **fields)
        walk(person, 20.0)
        outcome = person.outcome()
        assert person.arrived
        assert outcome.time_s == pytest.approx(outcome.free_time_s, abs=1e-9)
        assert outcome.length_m == pytest.approx(outcome.free_length_m, abs=1e-9)


def test_a_person_who_turns_back_ends_at_the_start_and_faces_back():
    rows = walk(walker([(0, 0), (8, 0)], turns_back_at_m=3.0), 12.0)
    assert rows[:, 1].max() == pytest.approx(3.0, abs=0.15)
    assert rows[-1, 1] == pytest.approx(0.0, abs=0.1)
    assert math.cos(rows[-1, 5]) == pytest.approx(-1.0, abs=0.01)


def test_people_face_where_a_pause_and_the_end_of_the_route_say():
    pauses = [{"at_m": 2.0, "for_s": 3.0, "heading_deg": -90.0}, {"at_m": 4.0, "for_s": 3.0}]
    rows = walk(walker([(0, 0), (6, 0)], pauses=pauses, end_heading_deg=135.0), 16.0)
    standing = np.hypot(rows[:, 3], rows[:, 4]) < 0.01
    for x_m, heading_deg in ((2.0, -90.0), (4.0, 0.0), (6.0, 135.0)):
        there = standing & (np.abs(rows[:, 1] - x_m) < 0.15)
        assert math.degrees(rows[there][-1, 5]) == pytest.approx(heading_deg, abs=1.0)


@pytest.mark.parametrize("speed", [0.5, 1.34, 2.0, 3.0])
def test_starts_and_stops_are_smooth_and_within_the_free_speed(speed):
    rows = walk(walker([(0, 0), (10, 0)], speed_mps=speed), 10.0 / speed + 4.0)
    v = np.hypot(rows[:, 3], rows[:, 4])
    assert v.max() <= speed + 1e-9
    assert v.max() > 0.97 * speed
    assert np.abs(np.diff(v)).max() <= 3.0 * DECISION_PERIOD_S + 1e-9
    assert rows[-1, 1] == pytest.approx(10.0, abs=0.1)


def test_the_walk_does_not_depend_on_how_often_it_is_sampled():
    route = [(4.5, -4.0), (6.0, 0.0), (7.0, 5.0)]
    other = Surroundings(None, (MovingBody(5.5, -1.0, 0.0, -0.5),), lambda: False)
    rare = walk(walker(route, HALL), 6.0, other, hz=20.0)
    often = walk(walker(route, HALL), 6.0, other, hz=60.0)[::3]
    np.testing.assert_allclose(often, rare, atol=1e-9)


coordinate = st.floats(-4.0, 4.0)


@settings(max_examples=25, deadline=None)
@given(
    corners=st.lists(
        st.tuples(st.floats(-3.0, 15.0), st.floats(-7.5, 7.5)), min_size=2, max_size=4
    ),
    movers=st.lists(
        st.tuples(st.floats(-2, 2), st.floats(-2, 2), coordinate, coordinate), max_size=4
    ),
    speed=st.floats(0.5, 3.0),
    seed=st.integers(0, 5),
)
def test_no_force_pushes_a_walker_into_a_rack(corners, movers, speed, seed):
    try:
        person = walker(corners, HALL, seed=seed, speed_mps=speed)
    except SimError:
        return  # a route into a rack is refused
    x, y = corners[0]
    least = min(WALKER_RADIUS_M, float(_distances(np.array([[x, y]])).min()))
    for n in range(140):
        t = 0.1 * n
        # People who stay near the walker and come from all sides.
        crowd = tuple(
            MovingBody(x + dx * math.cos(t), y + dy * math.cos(t), vx, vy)
            for dx, dy, vx, vy in movers
        )
        robot = RobotBody(x - 0.5, y, 0.0, 1.0, 0.0, 0.36, 0.25, (x, y, 1.4))
        person.advance(t, Surroundings(robot, crowd, lambda: True))
        x, y = person.place_odom_m
        assert float(_distances(np.array([[x, y]])).min()) >= least - 1e-6


def _distances(points: np.ndarray) -> np.ndarray:
    nearest = np.clip(points[:, None], HALL[None, :, :2], HALL[None, :, 2:])
    return np.linalg.norm(points[:, None] - nearest, axis=2)


def test_two_people_who_meet_head_on_pass_each_other():
    left, right = walker([(0, 0), (8, 0)]), walker([(8, 0), (0, 0)])
    nearest = math.inf
    states = [(0.0, 0.0, 0.0, 0.0), (8.0, 0.0, 0.0, 0.0)]
    for n in range(240):
        around = [Surroundings(None, (MovingBody(*states[1 - i]),), lambda: False) for i in (0, 1)]
        motions = [
            p.step(n * DECISION_PERIOD_S, a) for p, a in zip((left, right), around, strict=True)
        ]
        states = [(*m.position_odom_m, *m.velocity_odom_mps) for m in motions]
        nearest = min(nearest, math.dist(states[0][:2], states[1][:2]))
    assert nearest > 0.4
    assert left.arrived
    assert right.arrived


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"speed_mps": 0.5},
        {"speed_mps": 2.0},
        {"backwards": True, "speed_mps": 0.8},
        {"pauses": [{"at_m": 2.0, "for_s": 1.0}]},
        {"turns_back_at_m": 2.0},
    ],
)
def test_stance_feet_stay_and_legs_reach_them(fields):
    person = walker([(0, 0), (4, 0), (5, 2)], **fields)
    before = None
    steps = [0, 0]
    standing_m = person.step(0.0, ALONE).feet.feet[0][2]
    for n in range(1, 480):
        m = person.step(n / 60.0, ALONE)
        x, y = m.position_odom_m
        for side, foot in enumerate(m.feet.feet):
            assert foot[2] >= standing_m - 0.01
            assert math.hypot(foot[0] - x, foot[1] - y) < 0.85
            if before is None:
                continue
            last = before.feet[side]
            flat = all(abs(f[4]) < 1e-6 and f[2] < standing_m + 1e-6 for f in (foot, last))
            if flat:
                assert math.dist(foot[:2], last[:2]) < 1e-6
            steps[side] += foot[2] > standing_m + 0.02 >= last[2]
        before = m.feet
        assert 0.4 < m.feet.hip_height_m < 1.1
    assert min(steps) >= 3
    # At the end the feet stand side by side.
    (ax, ay, *_), (bx, by, *_) = m.feet.feet
    assert math.hypot(ax - bx, ay - by) < 0.4


# An aisle in which a robot and a person cannot pass each other.
AISLE = {"x_min_m": -8.0, "x_max_m": 14.0, "y_min_m": -0.6, "y_max_m": 0.6, "racks": []}


def met_in_the_aisle(seconds: float) -> PersonOutcome:
    """Somebody walks towards a robot that stands."""
    towards = {"name": "blocked", "route": [{"x_m": 8.0, "y_m": 0.0}, {"x_m": -4.0, "y_m": 0.0}]}
    run = run_stage([towards], robot_mps=0.0, seconds=seconds, layout=AISLE)  # type: ignore[arg-type]
    return run.outcomes[0]


def test_somebody_who_is_blocked_is_later_by_every_second():
    soon, later = met_in_the_aisle(12.0), met_in_the_aisle(20.0)
    assert soon.time_s is later.time_s is None
    assert soon.late_s is not None
    assert soon.late_s > 4.0
    assert later.late_s == pytest.approx(soon.late_s + 8.0, abs=0.5)


@pytest.mark.parametrize(
    "fields",
    [{}, {"start_s": 1.0, "turns_back_at_m": 4.0, "pauses": [{"at_m": 6.0, "for_s": 3.0}]}],
)
def test_somebody_who_walks_alone_is_never_late(fields):
    route = [{"x_m": 0.0, "y_m": 0.0}, {"x_m": 6.0, "y_m": 0.0}]
    spec = PersonSpec.model_validate({"name": "alone", "route": route, **fields})
    person = Person(spec, np.random.default_rng(0), np.empty((0, 4)))
    assert person.outcome().late_s is None
    for tick in range(600):
        person.advance(0.05 * tick, ALONE)
        outcome = person.outcome()
        before = 0.05 * tick < spec.start_s
        if before or person.arrived:
            assert outcome.late_s is None
        else:
            assert outcome.late_s == pytest.approx(0.0, abs=1e-6)
    assert person.arrived
