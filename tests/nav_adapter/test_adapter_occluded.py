"""People whom a scanner cannot see: their place is not empty before rays have passed it.

Hazard H24 and claim C31 of docs/safety.md.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT
from occluded_scenes import (
    ANGLES_RAD,
    POLICY,
    Ranges,
    after_vanishing,
    largest_rise_mps2,
    wall_between,
)

RISE_MPS2 = 0.7
PLACE_M = (2.0, 0.0)


def sector(low_deg: float, high_deg: float, value: float):
    inside = np.clip(ANGLES_RAD, np.radians(low_deg), np.radians(high_deg)) == ANGLES_RAD
    return lambda ranges, number: np.where(inside, value, ranges)


def side(at_m: float, low_m: float, high_m: float):
    return lambda ranges, number: np.minimum(ranges, wall_between(at_m, low_m, high_m))


def test_a_place_that_rays_have_passed_is_free_at_once() -> None:
    assert POLICY.timing.lost_rise_mps2 == RISE_MPS2
    cycles = after_vanishing(PLACE_M, lambda ranges, number: ranges, 2.0)
    assert largest_rise_mps2(cycles) > 10.0
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps
    assert any(each.place_empty for each in cycles)


@pytest.mark.parametrize(
    "change",
    [
        side(0.7, -1.5, 1.5),
        side(1.2, -2.5, 0.3),
        side(1.45, -0.4, 0.4),
        sector(-20.0, 20.0, math.nan),
        sector(-12.0, 9.0, 0.0),
        sector(-40.0, 5.0, 65.5),
        sector(-30.0, 30.0, -math.inf),
        sector(-20.0, 20.0, math.inf),
    ],
    ids=["truck", "its corner", "box", "NaN", "zero", "beyond", "too near", "dark clothes"],
)
def test_what_no_ray_has_passed_is_not_empty(change) -> None:
    cycles = after_vanishing(PLACE_M, change, 9.0)
    assert not any(each.place_empty for each in cycles)
    assert largest_rise_mps2(cycles) <= RISE_MPS2 + 1e-6
    # It costs time, and not for ever.
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps


def test_a_person_whose_legs_stop_the_rays_is_not_gone_though_the_detector_misses_them() -> None:
    def legs(ranges: Ranges, number: int) -> Ranges:
        inside = np.abs(np.tan(ANGLES_RAD) * 1.7) < 0.1
        return np.where(inside & (np.cos(ANGLES_RAD) > 0.0), 1.65, ranges)

    cycles = after_vanishing(PLACE_M, legs, 5.0)
    assert not any(each.place_empty for each in cycles)
    assert largest_rise_mps2(cycles) <= RISE_MPS2 + 1e-6


def test_hidden_people_are_kept_as_out_of_view_and_free_once_rays_pass() -> None:
    hidden = side(0.7, -1.5, 1.5)
    cycles = after_vanishing(
        PLACE_M, lambda ranges, number: hidden(ranges, number) if number < 120 else ranges, 5.5
    )
    # 3 s behind the truck, which then drives away: no longer than max_missed_s from there on.
    assert all(each.tracked for each in cycles[:60])
    assert not any(each.place_empty for each in cycles[:60])
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps
    assert largest_rise_mps2(cycles) > 10.0


def test_single_lost_rays_do_not_hide_that_a_place_is_empty() -> None:
    def lossy(ranges: Ranges, number: int) -> Ranges:
        return np.where(np.random.default_rng(number).random(len(ranges)) < 0.01, np.nan, ranges)

    assert largest_rise_mps2(after_vanishing(PLACE_M, lossy, 2.0)) > 10.0


@st.composite
def obstructions(draw: st.DrawFn):
    """Return what a scanner may meet or miss: blind sectors, sides, panes of glass, lost rays."""
    changes = []
    for _ in range(draw(st.integers(0, 2))):
        low = draw(st.floats(-60.0, 50.0))
        value = draw(st.sampled_from((math.nan, 0.0, math.inf, -math.inf, 65.5, 0.06)))
        changes.append(sector(low, low + draw(st.floats(1.0, 60.0)), value))
    for _ in range(draw(st.integers(0, 2))):
        left = draw(st.floats(-2.0, 1.5))
        right = left + draw(st.floats(0.05, 3.0))
        changes.append(side(draw(st.floats(0.3, 2.5)), left, right))
    if draw(st.booleans()):
        # Of a pane of glass only the rays that meet it squarely come back.
        left = draw(st.floats(-0.3, 0.2))
        changes.append(side(draw(st.floats(0.4, 1.5)), left, left + draw(st.floats(0.02, 0.2))))
    lost, seed = draw(st.sampled_from((0.0, 0.01, 0.3, 0.6))), draw(st.integers(0, 999))

    def change(ranges: Ranges, number: int) -> Ranges:
        for each in changes:
            ranges = each(ranges, number)
        dropped = np.random.default_rng([seed, number]).random(len(ranges)) < lost
        return np.where(dropped, math.inf, ranges)

    return change


@settings(max_examples=15, deadline=None)
@given(st.floats(1.2, 3.5), st.floats(-25.0, 25.0), obstructions())
def test_the_limit_rises_slowly_unless_rays_have_passed_the_place(
    range_m: float, bearing_deg: float, change
) -> None:
    bearing = math.radians(bearing_deg)
    place = (0.3 + range_m * math.cos(bearing), range_m * math.sin(bearing))
    cycles = after_vanishing(place, change, 8.0)
    for before, after in pairwise(cycles):
        # What is said of a place was seen in the cycle before; a body is 0.5 m wide.
        if before.gap_m > 0.12:
            assert not before.place_empty
            rise_mps2 = (
                after.constraints.speed_limit_mps - before.constraints.speed_limit_mps
            ) / 0.05
            assert rise_mps2 <= RISE_MPS2 + 1e-6
