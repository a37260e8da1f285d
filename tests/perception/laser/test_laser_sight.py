"""Blind scanners: which rays of a scan show what is there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception.laser import LaserScan, Scanner, ScannerSight, SeenDirections, sight_of

STEP_RAD = math.radians(0.5)
ANGLES_DEG = np.arange(-135.0, 135.25, 0.5)
BODY_M = np.array([(0.36, 0.25), (-0.36, 0.25), (-0.36, -0.25), (0.36, -0.25)])
FRONT = Scanner.mounted(0.3, 0.0, 0.2, body_base_m=BODY_M)
AHEAD_RAD = np.radians(np.arange(-60.0, 61.0))
NO_ANSWERS = (0.0, math.nan, -math.inf, 65.5, 0.02, -1.0, 0.06)


def seen(ranges: np.ndarray | float, scanner: Scanner = FRONT) -> ScannerSight:
    filled = np.zeros(len(ANGLES_DEG)) + ranges
    scan = LaserScan(0.0, math.radians(ANGLES_DEG[0]), STEP_RAD, filled, 0.05, 20.0)
    return sight_of(scan, scanner)


def between(low_deg: float, high_deg: float, value: float, other: float = 5.0) -> np.ndarray:
    return np.where(inside(low_deg, high_deg), value, other)


def inside(low_deg: float, high_deg: float) -> np.ndarray:
    return np.clip(ANGLES_DEG, low_deg, high_deg) == ANGLES_DEG


def test_a_scanner_without_any_answer_shows_nothing_and_says_why() -> None:
    for value in (*NO_ANSWERS, math.inf):
        sight = seen(value)
        assert sight.nothing
        assert not sight.sees(AHEAD_RAD).any()
    assert "its rays end within 0.30 m, as under a cover" in seen(0.06).blind_text
    assert "its rays meet nothing" in seen(math.inf).blind_text
    assert seen(math.nan).blind_text == "blind (most of its rays have no answer)"
    outside = Scanner.mounted(0.3, 0.0, 0.2, field_of_view_rad=(2.6, 2.8))
    assert seen(5.0, outside).blind_text == "blind (none of its rays lies in its field of view)"


@pytest.mark.parametrize("first", [0, 1])
def test_every_other_ray_without_an_answer_is_half_whichever_it_is(first: int) -> None:
    ranges = np.full(len(ANGLES_DEG), 5.0)
    ranges[first::2] = 0.0
    assert seen(ranges).sees(AHEAD_RAD).all()
    ranges[200:330] = 0.0
    assert not seen(ranges).sees(np.zeros(1)).any()


@pytest.mark.parametrize(("low_deg", "high_deg"), [(-45, 45), (10, 34), (-12, 9)])
def test_a_sector_without_answers_is_blind(low_deg: int, high_deg: int) -> None:
    sight = seen(between(low_deg, high_deg, math.nan))
    assert sight.blind_text == f"blind from {low_deg}° to {high_deg}°"
    ((low, high),) = np.degrees(sight.blind_sectors_base_rad)
    assert (low, high) == pytest.approx((low_deg - 0.25, high_deg + 0.25))
    bearings = np.radians(np.arange(low_deg, high_deg + 1.0))
    assert not sight.sees(bearings).any()
    assert sight.sees(np.radians([low_deg - 1.0, high_deg + 1.0])).all()


def test_a_cover_all_around_may_hang_farther_away_than_a_thing_beside_the_robot() -> None:
    bare = Scanner.mounted(0.3, 0.0, 0.2)
    rng = np.random.default_rng(0)
    assert seen(rng.uniform(0.12, 0.28, len(ANGLES_DEG)), bare).nothing
    # A dock ahead and a wall beside: they are things, at which nobody can be.
    dock = 0.2 / np.maximum(np.cos(np.radians(ANGLES_DEG)), 0.05)
    assert seen(np.minimum(dock, 5.0), bare).blind_text == ""


def test_small_gaps_and_single_lost_rays_are_no_blindness() -> None:
    rng = np.random.default_rng(0)
    for share in (0.01, 0.05, 0.3):
        sight = seen(np.where(rng.random(len(ANGLES_DEG)) < share, np.nan, 5.0))
        assert sight.blind_text == ""
        assert sight.seen.all()
    # A black rack: a few degrees without a return.
    assert seen(between(20.0, 32.0, math.nan)).blind_text == ""
    # More than half of the rays, lost at random.
    assert seen(np.where(rng.random(len(ANGLES_DEG)) < 0.8, np.nan, 5.0)).nothing


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_nothing_within_range_is_an_answer_while_other_rays_meet_something(share: float) -> None:
    """A hall larger than the range: +inf is "nothing there", by REP 117."""
    sight = seen(between(-135.0, -135.0 + 270.0 * share, math.inf))
    assert sight.seen.all()
    assert sight.blind_text == ""
    # With a single stray return of all rays nothing shows that the scanner measures.
    assert seen(between(0.0, 0.0, 3.0, math.inf)).blind_text.startswith("blind")


def test_the_robots_own_body_hides_a_sector_and_is_no_fault() -> None:
    corner = Scanner.mounted(0.3, 0.2, 0.2, math.radians(45.0), body_base_m=BODY_M)
    # To the right and back the rays end on the body.
    sight = seen(between(-135.0, -100.0, 0.2), corner)
    assert sight.blind_text == ""
    assert not sight.sees(np.radians([-80.0, -70.0])).any()
    assert sight.sees(AHEAD_RAD[20:]).all()
    # A bag before the window is nearer than the outline, and no body.
    assert seen(between(-60.0, 60.0, 0.06)).blind_text == "blind from -60° to 60°"


@pytest.mark.parametrize("turned", [False, True], ids=["counter-clockwise", "clockwise"])
@pytest.mark.parametrize("upside_down", [False, True])
def test_sectors_are_in_the_base_frame_however_the_scanner_is_mounted(
    turned: bool, upside_down: bool
) -> None:
    scanner = Scanner.mounted(0.0, 0.0, 0.2, math.radians(90.0), upside_down=upside_down)
    # Blind from 30° to 80° to the left of the scanner's x axis.
    ranges = between(30.0, 80.0, math.nan)
    low, step = math.radians(-135.0), STEP_RAD
    if turned:
        ranges, low, step = ranges[::-1], -low, -step
    sight = sight_of(LaserScan(0.0, low, step, ranges, 0.05, 20.0), scanner)
    expected = "10° to 60°" if upside_down else "120° to 170°"
    assert sight.blind_text == f"blind from {expected}"


def test_a_sector_behind_a_scanner_that_sees_all_around_is_one() -> None:
    ranges = np.full(720, 5.0)
    ranges[:60] = ranges[-40:] = 0.0
    scan = LaserScan(0.0, -math.pi, STEP_RAD, ranges, 0.05, 20.0)
    sight = sight_of(scan, Scanner.mounted(0.0, 0.0, 0.2))
    assert sight.blind_text == "blind from 160° to -150°"
    assert sight.sees(np.array([math.pi, -math.pi, 0.0])).tolist() == [False, False, True]


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-135.0, 100.0),
    st.floats(21.0, 200.0),
    st.sampled_from(NO_ANSWERS),
    st.floats(0.0, 0.02),
    st.integers(0, 99),
)
def test_no_ray_in_a_dead_sector_is_seen(
    low_deg: float, width_deg: float, value: float, lost: float, seed: int
) -> None:
    ranges = between(low_deg, low_deg + width_deg, value)
    ranges[np.random.default_rng(seed).random(len(ranges)) < lost] = math.nan
    sight = seen(ranges, Scanner.mounted(0.0, 0.0, 0.2))
    assert not sight.seen[inside(low_deg, low_deg + width_deg)].any()
    # But for the seam, what lies outside is seen.
    far = ~inside(low_deg - 5.0, low_deg + width_deg + 5.0)
    if not sight.nothing and np.count_nonzero(far) > 60:
        assert sight.seen[far].mean() > 0.9


def test_directions_are_as_old_as_the_last_scan_that_saw_them() -> None:
    half = math.radians(60.0)
    directions = SeenDirections()
    assert directions.stamp_s(0.0, half) is None
    directions.note(seen(5.0), 1.0)
    directions.note(seen(between(-20.0, 10.0, math.nan)), 2.0)
    assert directions.stamp_s(0.0, half) == 1.0
    assert directions.stamp_s(math.radians(74.0), half) == 2.0
    assert directions.stamp_s(math.pi, half) is None
    # The other scanner looks there; a late scan makes nothing older.
    directions.note(seen(5.0), 1.5)
    assert directions.stamp_s(0.0, half) == 1.5
