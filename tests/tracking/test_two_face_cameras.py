"""Two cameras that see faces, whose frames come almost at once: neither lost nor counted twice."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from fusion_scenes import REMEMBERS
from tracking_scenes import camera_at, observe

from perception import PersonObservation
from tracking import PersonTrack, PersonTracker, SensorConfig

REAR = "rear"
PERIOD_S = 1.0 / 15.0
LAG_S = 0.001
Sees = Callable[[int], bool]


def always(_step: int) -> bool:
    return True


def never(_step: int) -> bool:
    return False


def run(
    front: Sees,
    rear: Sees | None,
    *,
    alpha: Callable[[int], float] = lambda _step: 0.9,
    steps: int = 30,
    period_s: float = PERIOD_S,
    lag_s: float = LAG_S,
) -> list[PersonTrack]:
    """Return the track of one person after each pair of frames; no ``rear`` is one camera."""
    faces = SensorConfig(sees_faces=True, measures_range=False, alignment_std_rad=0.0)
    # A scanner, so that noticing counts; it is silent.
    sensors = {"laser": SensorConfig(alignment_std_rad=0.0)}
    if rear is not None:
        sensors[REAR] = faces
    tracker = PersonTracker(REMEMBERS, sensors=sensors)
    results = []
    for step in range(steps):
        now = step * period_s
        frames = [("camera", now, front)]
        if rear is not None:
            frames.append((REAR, now + lag_s, rear))
        for sensor, stamp_s, sees in frames:
            seen: list[PersonObservation] = []
            if sees(step):
                seen = [observe((3.0, 0.0), stamp_s, awareness=alpha(step), awareness_std=0.1)]
            tracks = tracker.update(seen, stamp_s, camera_at(), sensor=sensor)
        results.append(tracks[0])
    return results


def looked_s(track: PersonTrack) -> float:
    """Return the time of looking behind ``noticed``, half a second of which is a half."""
    return -0.5 * math.log2(1.0 - track.noticed)


@pytest.mark.parametrize("rate_hz", [5.0, 15.0, 30.0])
@pytest.mark.parametrize(
    ("front", "rear"), [(always, always), (always, never), (never, always)], ids=["both", "1", "2"]
)
def test_two_cameras_are_worth_as_much_as_one(front: Sees, rear: Sees, rate_hz: float) -> None:
    """Whichever of them sees the person."""
    period_s = 1.0 / rate_hz
    two, one = run(front, rear, period_s=period_s), run(always, None, period_s=period_s)
    for ours, single in zip(two[8:], one[8:], strict=True):
        assert ours.awareness_lower == pytest.approx(single.awareness_lower, abs=0.01)
        # Two cameras confirm a person up to two frames sooner, from when on looks count.
        assert looked_s(ours) == pytest.approx(looked_s(single), abs=2.1 * period_s)
    assert two[-1].awareness_lower > 0.6
    assert looked_s(two[-1]) > 0.3


@pytest.mark.parametrize("lag_s", [0.0, 1e-4, 1e-3, 0.01, 0.033])
def test_the_lag_between_the_cameras_does_not_matter(lag_s: float) -> None:
    only_second, one = run(never, always, lag_s=lag_s), run(always, None)
    assert only_second[-1].awareness_lower == pytest.approx(one[-1].awareness_lower, abs=0.01)


@pytest.mark.parametrize("rate_hz", [5.0, 15.0])
@pytest.mark.parametrize("rear", [always, never], ids=["both", "front"])
def test_a_missed_pair_of_frames_costs_no_more_than_with_one_camera(rear, rate_hz) -> None:
    def sees(step: int) -> bool:
        return step != 20

    period_s = 1.0 / rate_hz
    two = run(sees, rear if rear is never else sees, period_s=period_s)
    one = run(sees, None, period_s=period_s)
    for step in (20, 21, 22):
        assert two[step].awareness_lower == pytest.approx(one[step].awareness_lower, abs=0.02)
        assert two[step].awareness_lower < two[19].awareness_lower + 0.01


def test_a_camera_that_sees_the_face_turned_away_ends_awareness() -> None:
    aware = run(always, always)
    away = run(always, always, alpha=lambda step: 0.9 if step < 20 else 0.1)
    assert away[19].awareness_lower == aware[19].awareness_lower
    assert away[24].awareness_lower < 0.1
