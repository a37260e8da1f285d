"""Step-out impacts: closed forms, what must not change them, and what must stop them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from measured_scenes import ACROSS_M, ALONG_M, BODY_RADIUS_M, crossing, straight, walking

from nav_adapter import RobotProfile
from sim_tests import NOVA_CARTER
from sim_tests.study.measures import measure
from sim_tests.study.measures._step_out import FASTER_STEP_OUT, STEP_OUT, StepOut, step_out_impacts

T_S = np.arange(0.0, 6.001, 0.05)
BRIEF_S = np.array([0.0, 0.05, 0.1, 0.15])  # two instants of 0.1 s, of which the second lasts 0.05
RATES_HZ = -np.log(1.0 - np.array([0.23, 0.26, 0.09, 0.10]))
HOLDS_S = NOVA_CARTER.reaction_time_s + 0.2
LASTS_S = float(BRIEF_S[-1])


def standing(x_m, y_m):
    return walking((x_m, y_m), (0.0, 0.0))


def found_of(result, model=STEP_OUT):
    """The impacts with people who have never noticed the robot, who are all people."""
    found = step_out_impacts(result, model)
    assert found["never"] == found["all"]
    return found["never"]


def unaware(robot, *people, times=T_S, **values):
    return found_of(crossing(times, robot, people, **values)).impacts


@pytest.mark.parametrize(
    ("gap_m", "speed_mps"), [(0.4, 0.6), (0.8, 1.0), (1.2, 1.0), (2.0, 1.4), (2.6, 1.5)]
)
def test_somebody_ahead_is_hit_in_the_directions_of_a_closed_form(gap_m, speed_mps):
    """A frozen person (time constant of an hour) is met in all directions, or in none."""
    frozen = StepOut(time_constant_s=3600.0)
    stops_m = speed_mps * HOLDS_S + speed_mps**2 / (2.0 * NOVA_CARTER.max_deceleration_mps2)
    person = standing(gap_m + ALONG_M + BODY_RADIUS_M, 0.0)
    # At an instant: the robot has not moved in the log.
    result = crossing(BRIEF_S, lambda t: (0.0, 0.0, 0.0, speed_mps), [person])
    found = found_of(result, frozen)
    hit = stops_m > gap_m
    assert found.impacts == pytest.approx(1000.0 * RATES_HZ[3] * LASTS_S * hit)
    if hit:
        a = NOVA_CARTER.max_deceleration_mps2
        brakes_m = max(gap_m - speed_mps * HOLDS_S, 0.0)
        impact_mps = math.sqrt(speed_mps**2 - 2.0 * a * brakes_m)
        assert found.worst_mps == pytest.approx(impact_mps, abs=0.01)
        assert (found.fast > 0.0) == (impact_mps > 0.25)


@given(st.floats(0.3, 1.5), st.floats(0.3, 1.4), st.floats(0.5, 3.0))
def test_directions_beside_a_straight_path_are_those_of_a_fine_simulation(v, aside_m, ahead_m):
    """Written out anew: one direction and millisecond after the other, for a rectangle."""
    person = standing(ahead_m, aside_m + ACROSS_M + BODY_RADIUS_M)
    result = crossing(BRIEF_S, lambda t: (0.0, 0.0, 0.0, v), [person])
    found = found_of(result)
    share, worst, unclear = simulated_share(v, ahead_m, aside_m + ACROSS_M + BODY_RADIUS_M)
    expected = 1000.0 * RATES_HZ[3] * LASTS_S
    assert abs(found.impacts - expected * share) <= expected * unclear / 16 + 1e-6
    if not unclear:
        assert found.worst_mps == pytest.approx(worst, abs=0.02)


def simulated_share(v, x_m, y_m):
    a, tau, fastest = NOVA_CARTER.max_deceleration_mps2, 0.54, 1.34
    t = np.arange(0.0, HOLDS_S + v / a + 0.1, 1e-3)
    brakes = np.clip(t - HOLDS_S, 0.0, v / a)
    driven = v * np.minimum(t, HOLDS_S) + v * brakes - 0.5 * a * brakes**2
    speed = v - a * brakes
    way = fastest * (t - tau * (1.0 - np.exp(-t / tau)))
    hits, worst, unclear = 0, 0.0, 0
    for phi in np.arange(16) * math.pi / 8.0:
        dx, dy = x_m + math.cos(phi) * way - driven, y_m + math.sin(phi) * way
        low_x, high_x = NOVA_CARTER.footprint_m[:, 0].min(), NOVA_CARTER.footprint_m[:, 0].max()
        apart = np.hypot(
            np.maximum(np.maximum(low_x - dx, dx - high_x), 0.0),
            np.maximum(np.abs(dy) - ACROSS_M, 0.0),
        )
        unclear += abs(float(apart.min()) - BODY_RADIUS_M) < 0.02
        if (apart <= BODY_RADIUS_M).any():
            k = int(np.argmax(apart <= BODY_RADIUS_M))
            closing = speed[k] * dx[k] / math.hypot(dx[k], dy[k])
            unclear += abs(closing - 0.03) < 0.02
            hits += closing > 0.03
            worst = max(worst, closing if closing > 0.03 else 0.0)
    return hits / 16, worst, unclear


def test_a_robot_that_stands_meets_nobody():
    near = standing(ALONG_M + BODY_RADIUS_M + 0.02, 0.0)
    assert unaware(lambda t: (0.0, 0.0, 0.0, 0.0), near) == 0.0
    assert unaware(lambda t: (0.0, 0.0, 0.0, 0.029), near) == 0.0
    assert unaware(lambda t: (0.0, 0.0, 0.0, 0.04), near) > 0.0


def curve(t):
    """A robot on a curve of 2 m, which it leaves sideways as well."""
    angle = 0.4 * t
    return 2.0 * math.sin(angle), 2.0 * (1.0 - math.cos(angle)), angle, 0.8, 0.1


def with_yaw_rate(result, yaw_rate):
    frames = tuple(
        replace(frame, robot_state=replace(frame.robot_state, yaw_rate_radps=yaw_rate))
        for frame in result.frames
    )
    return replace(result, frames=frames)


def test_the_robot_keeps_its_curve_and_its_drift():
    """Frozen people on the way of a curve to the left, or of a drift, are met there alone."""
    frozen = StepOut(time_constant_s=3600.0)
    left, right = standing(1.3, 0.9), standing(1.3, -0.9)

    def impacts(person, yaw_rate=0.0, drift=0.0):
        result = crossing(BRIEF_S, lambda t: (0.0, 0.0, 0.0, 1.2, drift), [person])
        return found_of(with_yaw_rate(result, yaw_rate), frozen).impacts

    assert impacts(left) == impacts(right) == 0.0
    for change in ({"yaw_rate": 1.0}, {"drift": 0.7}):
        opposite = {name: -value for name, value in change.items()}
        assert impacts(left, **change) > 0.0 == impacts(right, **change)
        assert impacts(right, **opposite) == pytest.approx(impacts(left, **change))


@settings(max_examples=20, deadline=None)
@given(st.floats(0.6, 1.5), st.floats(-math.pi, math.pi), st.floats(0.05, 0.6))
@example(1.4375, 1.484375, 0.125)  # somebody is grazed, and touched later
def test_a_robot_that_turns_on_the_spot_strikes_as_in_a_fine_simulation(turn, where, gap_m):
    """Written out anew: corners whose speeds are taken from their places, one after the other."""
    radius_m, a = NOVA_CARTER.circumscribed_radius_m, NOVA_CARTER.max_deceleration_mps2
    place = (radius_m + BODY_RADIUS_M + gap_m) * np.array([math.cos(where), math.sin(where)])
    result = crossing(BRIEF_S, lambda t: (0.0, 0.0, 0.0, 0.0, 0.0, turn), [standing(*place)])
    found, dt_s = found_of(result), 0.004
    brakes_s = turn * radius_m / a

    def closing_mps(angle, touch_m):
        heading = 0.0
        for t in np.arange(0.0, HOLDS_S + brakes_s, dt_s):
            lag_s = 0.54 * (1.0 - math.exp(-t / 0.54))
            way_m = 1.34 * (t - lag_s)
            x, y = place + way_m * np.array([math.cos(angle), math.sin(angle)])
            rate = turn * (1.0 - max(t - HOLDS_S, 0.0) / brakes_s)
            ahead = math.cos(heading) * x + math.sin(heading) * y
            aside = math.cos(heading) * y - math.sin(heading) * x
            near = np.clip([ahead, aside], [-ALONG_M, -ACROSS_M], [ALONG_M, ACROSS_M])
            gap = np.array([ahead, aside]) - near
            if math.hypot(*gap) <= touch_m:
                return rate * (near[0] * gap[1] - near[1] * gap[0]) / math.hypot(*gap)
            heading += rate * dt_s
        return 0.0

    # Touches are looked for every 0.05 s, in which somebody who grazes the robot goes 4 mm deep:
    # the first touch may be either of these. A speed near the least that counts is unclear as well.
    radii_m = (BODY_RADIUS_M - 0.01, BODY_RADIUS_M + 0.01)
    touches = [
        sorted(closing_mps(angle, each) for each in radii_m)
        for angle in np.arange(16) * math.tau / 16.0
    ]
    least, most = sum(low > 0.04 for low, _ in touches), sum(high > 0.02 for _, high in touches)
    one = 1000.0 / 16.0 * RATES_HZ[3] * LASTS_S
    assert least * one - 1e-6 <= found.impacts <= most * one + 1e-6
    assert max(low for low, _ in touches) - 0.03 <= found.worst_mps
    assert found.worst_mps <= max(high for _, high in touches) + 0.03


def test_racks_block_and_the_box_that_somebody_stands_in_does_not():
    person = standing(2.0, 1.1)
    result = crossing(T_S, straight(1.0), [person])
    free = found_of(result).impacts
    assert free > 0.0

    def behind(*box):
        return found_of(replace(result, obstacle_boxes_odom_m=np.array([box]))).impacts

    assert behind(-10.0, 0.6, 12.0, 0.7) == 0.0
    assert 0.0 < behind(1.0, 0.6, 1.9, 0.7) < free
    assert behind(-10.0, 1.5, 12.0, 3.0) == pytest.approx(free)  # behind their back
    assert behind(1.5, 0.9, 2.5, 1.3) == pytest.approx(free)


@pytest.mark.parametrize(
    ("since_look_s", "share", "group"),
    [(0.0, 0.23, "looking"), (0.9, 0.26, "looking"), (1.2, 0.09, "past"), (3.9, 0.09, "past"),
     (4.2, 0.10, "past"), (None, 0.10, "never")],
)  # fmt: skip
def test_the_last_look_gives_the_rate_and_the_group(since_look_s, share, group):
    """The robot moves at one instant, towards somebody whom it meets in each direction."""
    moves_s = 5.0
    looked_s = -math.inf if since_look_s is None else moves_s - since_look_s

    def robot(t):
        return 0.0, 0.0, 0.0, 1.0 if t > moves_s - 1e-6 else 0.0

    frozen = StepOut(time_constant_s=3600.0)
    person = standing(ALONG_M + BODY_RADIUS_M + 0.1, 0.0)
    times = np.arange(0.0, moves_s + 0.051, 0.05)  # the last instant lasts 0.05 s
    result = crossing(times, robot, [person], looks=lambda t, i: t <= looked_s + 1e-6)
    found = step_out_impacts(result, frozen)
    expected = -1000.0 * math.log(1.0 - share) * 0.05
    assert found["all"] == found[group]
    assert found[group].impacts == pytest.approx(expected)
    assert found[group].worst_mps > 0.0
    for other in {"never", "past", "looking", "answered"} - {group}:
        assert found[other] == (0.0, 0.0, 0.0)


looks_of_two = st.lists(st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 2.0)), max_size=4)


@settings(max_examples=25, deadline=None)
@given(looks_of_two, looks_of_two, st.booleans())
def test_everybody_is_in_one_group_and_the_groups_add_up(first, second, faces):
    """Whoever a head faces: α changes no group."""
    both = first, second
    walks = [walking((3.0, 1.2), (0.0, 0.0)), walking((4.0, -1.0), (-0.3, 0.1))]
    result = crossing(
        T_S,
        straight(0.9),
        walks,
        awareness=lambda t, i: 0.9 * faces,
        looks=lambda t, i: any(start <= t <= start + lasts for start, lasts in both[i]),
    )
    groups = result.noticed
    assert (np.sum(list(groups.values()), axis=0) == 1).all()
    found = step_out_impacts(result)
    parts = [found[name] for name in groups]
    for figure in ("impacts", "fast"):
        assert sum(getattr(each, figure) for each in parts) == pytest.approx(
            getattr(found["all"], figure)
        )
    assert max(each.worst_mps for each in parts) == found["all"].worst_mps


def test_any_footprint_counts_by_its_hull_and_people_behind_are_not_met():
    """A long vehicle whose base origin lies at the rear, with a notch in front."""
    corners = np.array(
        [(-0.3, -0.4), (1.6, -0.4), (1.6, -0.2), (1.0, 0.0), (1.6, 0.2), (1.6, 0.4), (-0.3, 0.4)]
    )
    truck = RobotProfile(corners, 2.0, 1.0, 0.5, 0.4)
    frozen = StepOut(time_constant_s=3600.0)

    def impacts(x_m, y_m=0.0):
        result = crossing(BRIEF_S, lambda t: (0.0, 0.0, 0.0, 1.0), [standing(x_m, y_m)])
        return found_of(replace(result, robot=truck), frozen).impacts

    stops_m = 0.4 + 0.2 + 1.0
    assert impacts(1.6 + BODY_RADIUS_M + stops_m - 0.03) > 0.0
    assert impacts(1.6 + BODY_RADIUS_M + stops_m + 0.03) == 0.0
    assert impacts(1.6 + BODY_RADIUS_M - 0.05) > 0.0  # time 0 counts, in the notch as well
    assert impacts(-0.3 - BODY_RADIUS_M + 0.05) == 0.0
    assert impacts(2.5, 0.4 + BODY_RADIUS_M + 0.03) == 0.0


def test_the_row_has_both_models_and_nothing_without_people():
    walk = walking((3.0, 1.2), (0.0, 0.0))
    result = crossing(T_S, straight(1.2), [walk])
    record = measure(result)
    for name, found in step_out_impacts(result, STEP_OUT).items():
        assert getattr(record, f"step_out_{name}") == pytest.approx(found.impacts, abs=1e-6)
        assert getattr(record, f"step_out_{name}_fast") == pytest.approx(found.fast, abs=1e-6)
        worst_mps = getattr(record, f"step_out_{name}_worst_mps")
        assert worst_mps == pytest.approx(found.worst_mps, abs=1e-6)
    stress = found_of(result, FASTER_STEP_OUT)
    assert record.step_out_stress_never == pytest.approx(stress.impacts, abs=1e-6)
    assert record.step_out_stress_never_worst_mps == pytest.approx(stress.worst_mps, abs=1e-6)
    assert stress.impacts > record.step_out_never > record.step_out_never_fast > 0.0
    assert record.step_out_looking == record.step_out_answered == 0.0
    alone = measure(crossing(T_S, straight(1.2)))
    assert alone.step_out_never is alone.step_out_stress_all_worst_mps is None
