"""Time to collision and post-encroachment time against closed forms and shapely."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from measured_scenes import ACROSS_M, ALONG_M, BODY_RADIUS_M, crossing, straight, walking
from shapely.geometry import Point, Polygon
from shapely.ops import nearest_points

from sim_tests import NOVA_CARTER
from sim_tests.study.measures._conflict import Outline, min_time_to_collision_s, post_encroachment_s

CARTER = Outline(NOVA_CARTER.footprint_m)
HALL_S = np.arange(0.0, 20.0, 0.05)
coordinates = st.floats(-3.0, 3.0)
speeds = st.floats(-2.0, 2.0)


def ttc(robot, *people, times=(0.0,)):
    return min_time_to_collision_s(crossing(times, robot, people))


def pet(robot, *people, times=HALL_S):
    return post_encroachment_s(crossing(times, robot, people))


@given(st.floats(1.0, 8.0), st.floats(0.1, 1.5), st.floats(0.0, 2.0), st.floats(-math.pi, math.pi))
def test_head_on_the_time_to_collision_is_the_gap_over_the_closing_speed(gap, v, v_h, heading):
    ahead = np.array([math.cos(heading), math.sin(heading)])
    place = (gap + ALONG_M + BODY_RADIUS_M) * ahead
    time = ttc(straight(v, heading=heading), walking(place, -v_h * ahead))
    assert time == pytest.approx(gap / (v + v_h), abs=1e-9)


def test_the_smallest_time_of_all_instants_and_people_counts():
    near, far = walking((4.0, 0.0), (0.0, 0.0)), walking((9.0, 0.0), (0.0, 0.0))
    times = np.arange(0.0, 2.01, 0.05)
    gap = 4.0 - 2.0 - ALONG_M - BODY_RADIUS_M
    assert ttc(straight(1.0), far, near, times=times) == pytest.approx(gap, abs=1e-9)


@pytest.mark.parametrize(
    ("place", "velocity"),
    [
        ((3.0, 0.0), (1.5, 0.0)),  # walks ahead, faster
        ((-2.0, 0.0), (0.0, 0.0)),  # behind
        ((3.0, 1.0), (0.0, 0.0)),  # beside the way
        ((3.0, 0.0), (1.0, 0.0)),  # keeps the distance
    ],
)
def test_courses_that_never_meet_have_no_time_to_collision(place, velocity):
    assert ttc(straight(1.0), walking(place, velocity)) is None


def test_nobody_there_means_no_figure():
    assert ttc(straight(1.0)) is None
    assert pet(straight(1.0)) is None


@given(coordinates, coordinates, speeds, speeds)
@example(x=0.0, y=0.0, vx=2.2250738585e-313, vy=1.0)
def test_discs_first_touch_the_outline_then_and_not_before(x, y, vx, vy):
    """Against shapely, on an outline without symmetry whose corners are given clockwise."""
    corners = np.array([[-0.4, -0.2], [-0.3, 0.3], [0.2, 0.4], [0.6, 0.0], [0.1, 0.0]])
    hull = Polygon(corners).convex_hull
    radius = 0.3
    centre, velocity = np.array([[x, y]]), np.array([[vx, vy]])
    assume(abs(hull.distance(Point(x, y)) - radius) > 1e-6)
    assume(math.hypot(vx, vy) > 1e-3)
    time = float(Outline(corners).time_to_disc(centre, velocity, radius)[0])

    def distance(t):
        return hull.distance(Point(x + vx * t, y + vy * t))

    assert Outline(corners).distance(centre)[0] == pytest.approx(distance(0.0), abs=1e-9)
    if distance(0.0) < radius:
        nearest, _ = nearest_points(hull, Point(x, y))
        parting_mps = np.dot((x - nearest.x, y - nearest.y), (vx, vy)) / max(distance(0.0), 1e-9)
        # Rounding may decide between nearing and parting; exact cases have a test of their own.
        assume(distance(0.0) == 0.0 or abs(parting_mps) > 1e-12)
        nearer = distance(0.0) == 0.0 or parting_mps < 0.0
        assert time == (0.0 if nearer else math.inf)
    elif math.isinf(time):
        reach = (math.hypot(x, y) + 2.0) / math.hypot(vx, vy)
        assert min(distance(t) for t in np.linspace(0.0, reach, 400)) > radius - 1e-9
    else:
        assert distance(time) == pytest.approx(radius, abs=1e-7)
        assert all(distance(t) > radius - 1e-9 for t in np.linspace(0.0, time, 50)[:-1])


@pytest.mark.parametrize(
    ("vx", "expected"), [(-2.86e-175, 0.0), (0.0, math.inf), (2.86e-175, math.inf)]
)
def test_beside_a_corner_the_least_nearing_counts_and_going_past_does_not(vx, expected):
    diamond = Outline(np.array([[0.6, 0.0], [0.0, 0.6], [-0.6, 0.0], [0.0, -0.6]]))
    time = diamond.time_to_disc(np.array([[0.75, 0.0]]), np.array([[vx, 1.0]]), 0.3)
    assert time[0] == expected


def perpendicular(v, w, x, y):
    """Closed form for a robot along x from 0 at v, and a person from (x, −y) upwards at w.

    The robot's tail and the person's front pass the corner of a place at times that the body disc's
    roundness brings nearer by r √(1/v² + 1/w²); and the other way round for who comes first.
    """
    rounding = BODY_RADIUS_M * math.hypot(1.0 / v, 1.0 / w)
    robot_first = (y - ACROSS_M) / w - (x + ALONG_M) / v - rounding
    person_first = (x - ALONG_M) / v - (y + ACROSS_M) / w - rounding
    return max(robot_first, person_first, 0.0)


@settings(max_examples=40)
@given(st.floats(0.5, 1.5), st.floats(0.5, 2.0), st.floats(2.0, 5.0), st.floats(1.5, 8.0))
def test_perpendicular_paths_have_the_closed_form_post_encroachment_time(v, w, x, y):
    found = pet(straight(v), walking((x, -y), (0.0, w)))
    assert found == pytest.approx(perpendicular(v, w, x, y), abs=0.021)


def test_paths_that_do_not_cross_have_no_post_encroachment_time():
    beside = walking((5.0, ACROSS_M + BODY_RADIUS_M + 0.01), (0.0, 1.0))
    assert pet(straight(1.0), beside) is None
    touching = walking((5.0, ACROSS_M + BODY_RADIUS_M - 0.01), (0.0, 1.0))
    assert pet(straight(1.0), touching) is not None


def test_following_at_the_same_speed_has_the_time_gap():
    gap = 2.0
    ahead = walking((gap + ALONG_M + BODY_RADIUS_M, 0.0), (1.0, 0.0))
    assert pet(straight(1.0), ahead) == pytest.approx(gap, abs=0.021)


def test_long_episodes_are_compared_in_pieces_with_the_same_result():
    times = np.arange(0.0, 60.0, 0.05)
    robot, person = straight(0.1), walking((4.0, -6.0), (0.0, 0.12))
    closed = perpendicular(0.1, 0.12, 4.0, 6.0)
    assert pet(robot, person, times=times) == pytest.approx(closed, abs=0.021)
