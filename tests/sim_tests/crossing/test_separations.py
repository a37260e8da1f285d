import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_tests import CrossingFrame, CrossingResult
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing import ContactEvent, contact_by
from sim_tests.crossing._separations import CLEARANCE_M, Approach, margins_m

AHEAD = (1.0, 0.0)


def protective(v, v_h, a=1.0, reaction=0.3, clearance=CLEARANCE_M):
    return v_h * (reaction + v / a) + v * reaction + v * v / (2 * a) + clearance


def episode(*approaches):
    """An episode of a robot and people ahead of it, of whom each has a frame; or of nobody."""
    frames = []
    for step, each in enumerate(approaches or ((), ())):
        seen = [Approach(each[0], AHEAD, *each[1:])] if each else []
        moves = not each or each[1] != (0.0, 0.0)
        frames.append(
            CrossingFrame(
                *(0.05 * step, *[None] * 8),
                approaches=tuple(seen),
                margins_m=tuple(margins_m(seen, NOVA_CARTER, moves=moves)),
                robot_moves=moves,
            )
        )
    return CrossingResult("", 0, "", "", "truth", (), None, tuple(frames))


@given(st.floats(0.05, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 5.0))
def test_the_margin_is_the_separation_minus_the_protective_separation(speed, human, separation):
    now = separation, (speed, 0.0), (-human, 0.0)
    found = episode(now, now)
    (margin,) = found.frames[0].margins_m
    assert margin == pytest.approx(separation - protective(speed, human))
    assert found.min_margin_m == margin
    assert found.violation_time_s == pytest.approx(0.1 if margin < 0.0 else 0.0)


def test_only_motion_towards_each_other_needs_a_protective_separation():
    for robot_mps, person_mps in (((-1.0, 0.0), AHEAD), ((0.0, 1.0), (0.0, -1.0))):
        (now,) = episode((1.0, robot_mps, person_mps)).frames
        assert now.margins_m == pytest.approx([1.0 - CLEARANCE_M])


def test_a_standing_robot_violates_no_margin():
    found = episode((0.05, (0.0, 0.0), (-2.0, 0.0)))
    assert found.violation_time_s == 0.0
    assert found.min_margin_m == np.inf
    assert found.min_separation_m == 0.05


def test_the_top_speed_counts_only_near_people():
    found = episode((2.5, (1.4, 0.0)), (1.5, (0.6, 0.0)))
    assert found.max_speed_within_2m_mps == pytest.approx(0.6)


def test_nobody_about_gives_no_figure():
    alone = episode()
    assert alone.min_separation_m == alone.min_margin_m == np.inf
    assert alone.violation_time_s == alone.max_speed_within_2m_mps == 0.0


def test_a_contact_is_attributed_to_its_cause():
    into, aside, away = (
        ContactEvent(1.0, 0, Approach(0.0, AHEAD, velocity))
        for velocity in ((0.5, 0.0), (0.0, 0.5), (-0.5, 0.0))
    )
    assert [each.by for each in (into, aside, away)] == ["robot", "person", "person"]
    assert {each.robot_speed_mps for each in (into, aside, away)} == {0.5}
    assert contact_by(()) == ""
    assert contact_by((aside, away)) == "person"
    assert contact_by((aside, into, away)) == "robot"
