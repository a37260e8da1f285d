"""The assumed way of people who stand, against recorded people; docs/safety.md has the table."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from paths import ROOT, SHARED

from nav_adapter import protective_separation_m
from nav_adapter.policies import StandingPeople
from perception import PersonObservation
from perception.arrays import FloatArray
from tracking import PersonTracker

RECORDINGS = sorted((SHARED / "data").glob("citr_*.csv"))
RULE = StandingPeople()
FRAMES_PER_S = 29.97
STILL_S, STILL_M = 0.5, 0.1
TIMES_S = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0])

needs_recordings = pytest.mark.skipif(not RECORDINGS, reason="recorded people are not there")


def reach_m(time_s: FloatArray, acceleration_mps2: float, delay_s: float) -> FloatArray:
    """Return S_h of a person who stands: the part of S_p that a standing robot needs."""
    return protective_separation_m(
        0.0,
        1.6,
        deceleration_mps2=1.0,
        reaction_time_s=time_s,
        clearance_m=0.0,
        human_acceleration_mps2=acceleration_mps2,
        start_delay_s=delay_s,
    )


def walks() -> Iterator[tuple[FloatArray, FloatArray]]:
    """Stamps (N,) and positions (N, 2) of every recorded person."""
    for path in RECORDINGS:
        rows = np.genfromtxt(path, delimiter=",", names=True)
        for each in np.unique(rows["id"]):
            mine = np.sort(rows[rows["id"] == each], order="t_s")
            yield mine["t_s"], np.stack([mine["x_m"], mine["y_m"]], axis=1)


def seen_at(stamp_s: float, place_m: FloatArray, sigma_m: float) -> PersonObservation:
    """Return somebody at a place (2,) on the floor, known to this standard deviation."""
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.array([*place_m, 0.0]),
        position_covariance_m2=sigma_m**2 * np.eye(3),
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=1.0,
        box_xyxy_px=None,
    )


def recorded_m() -> list[FloatArray]:
    """Displacements after each time, of people within 0.1 m of their place for half a second."""
    found: list[list[float]] = [[] for _ in TIMES_S]
    back = round(STILL_S * FRAMES_PER_S)
    for stamps_s, places in walks():
        for row in range(back, len(stamps_s)):
            before = places[row - back : row + 1] - places[row]
            if stamps_s[row] - stamps_s[row - back] > 1.1 * STILL_S:
                continue
            if np.linalg.norm(before, axis=1).max() > STILL_M:
                continue
            for column, time_s in enumerate(TIMES_S):
                later = row + round(time_s * FRAMES_PER_S)
                if later < len(stamps_s):
                    found[column].append(float(np.linalg.norm(places[later] - places[row])))
    return [np.array(each) for each in found]


def row_of_docs(title: str) -> list[float]:
    text = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {title}")]
    cells = line.strip("|").split("|")[1:]
    return [
        float(re.findall(r"\d+\.\d+", c)[0]) if re.search(r"\d", c) else math.nan for c in cells
    ]


@pytest.mark.parametrize(
    ("title", "acceleration", "delay"),
    [
        ("**assumed at 2 m/s² and 0.25 s**", RULE.human_acceleration_mps2, RULE.start_delay_s),
        ("assumed at 2 m/s² and 0.1 s", 2.0, 0.1),
        ("assumed at 3 m/s² and 0.1 s", 3.0, 0.1),
    ],
)
def test_the_table_shows_the_assumed_way(title: str, acceleration: float, delay: float) -> None:
    np.testing.assert_allclose(
        row_of_docs(title), reach_m(TIMES_S, acceleration, delay), atol=0.006
    )
    np.testing.assert_allclose(row_of_docs("a walker"), 1.6 * TIMES_S, atol=0.006)


def test_the_suggested_way_is_above_what_was_measured_of_229_people_near_a_robot() -> None:
    """Above the 99th percentile with room, and above the maximum but at half a second."""
    assumed = reach_m(TIMES_S, RULE.human_acceleration_mps2, RULE.start_delay_s)
    common, farthest = row_of_docs("229 people, 99 %"), row_of_docs("229 people, maximum")
    known = np.isfinite(common)
    assert known.sum() == 4
    assert (assumed[known] > 1.8 * np.array(common)[known]).all()
    over = np.array(farthest)[known] - assumed[known]
    assert over[0] == pytest.approx(0.05, abs=0.005)
    assert (over[1:] < -0.12).all()


@needs_recordings
def test_the_suggested_way_is_beyond_all_recorded_people() -> None:
    assumed = reach_m(TIMES_S, RULE.human_acceleration_mps2, RULE.start_delay_s)
    recorded = recorded_m()
    assert min(len(each) for each in recorded) > 150
    for way, each in zip(assumed, recorded, strict=True):
        assert np.percentile(each, 99.9) < way
        assert each.max() < way
        assert np.percentile(each, 99) > 0.6 * way  # not far beyond either
    for title, share in (("8 people, 99 %", 99), ("8 people, 99.9 %", 99.9)):
        found = [np.percentile(each, share) for each in recorded]
        np.testing.assert_allclose(row_of_docs(title), found, atol=0.006)
    farthest = [each.max() for each in recorded]
    np.testing.assert_allclose(row_of_docs("8 people, maximum"), farthest, atol=0.006)


@needs_recordings
def test_two_metres_per_second_squared_after_a_tenth_of_a_second_are_too_little() -> None:
    recorded = recorded_m()[1]
    assert float(reach_m(np.array(0.5), 2.0, 0.1)) < np.percentile(recorded, 99) - 0.05


@needs_recordings
def test_whoever_the_tracker_shows_standing_gets_no_farther_than_assumed() -> None:
    """From the tracked place, less two standard deviations, with 3 cm of noise at 30 Hz."""
    rng, excess, standing = np.random.default_rng(0), [], 0
    assumed = reach_m(TIMES_S, RULE.human_acceleration_mps2, RULE.start_delay_s)
    for stamps_s, places in walks():
        tracker = PersonTracker()
        for row, (stamp_s, place) in enumerate(zip(stamps_s.tolist(), places, strict=True)):
            seen = seen_at(stamp_s, place + rng.normal(0.0, 0.03, 2), 0.03)
            tracks = tracker.update((seen,), stamp_s, np.eye(4))
            if len(tracks) != 1 or tracks[0].status != "confirmed":
                continue
            covariance = tracks[0].covariance_odom
            variance = float(np.linalg.eigvalsh(covariance[2:, 2:])[-1])
            if not RULE.is_standing(float(np.hypot(*tracks[0].velocity_odom_mps)), variance):
                continue
            standing += 1
            margin_m = 2.0 * math.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1])
            for way, time_s in zip(assumed, TIMES_S.tolist(), strict=True):
                later = row + round(time_s * FRAMES_PER_S)
                if later < len(places):
                    gone = np.linalg.norm(places[later] - tracks[0].position_odom_m)
                    excess.append(float(gone) - margin_m - way)
    assert standing > 100
    assert max(excess) < 0.0
