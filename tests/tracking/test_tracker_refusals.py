"""Bad input is refused by name and changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tracking_scenes import CAMERA, PERIOD_S, as_bytes, camera_at, observe

from tracking import PersonTracker, TrackingError

LAST_S = 9 * PERIOD_S
NOW_S = 10 * PERIOD_S


def watched() -> PersonTracker:
    """Return a tracker with a confirmed track and a tentative one."""
    tracker = PersonTracker()
    for step in range(10):
        now = step * PERIOD_S
        people = [observe((3.0 + now, 0.0), now, awareness=0.8)]
        if step == 9:
            people.append(observe((5.0, 2.0), now))
        tracker.update(people, now, CAMERA)
    return tracker


def altered(row: int, column: int, value: float) -> np.ndarray:
    T = CAMERA.copy()
    T[row, column] = value
    return T


def seen(stamp_s: float = NOW_S) -> list[Any]:
    return [observe((3.5, 0.0), stamp_s, awareness=0.9), observe((7.0, 0.0), stamp_s)]


REFUSED: dict[str, tuple[Callable[[PersonTracker], Any], str]] = {
    "NaN stamp": (lambda t: t.update(seen(), np.nan, CAMERA), "stamp_s must be finite"),
    "infinite stamp": (lambda t: t.update(seen(), np.inf, CAMERA), "stamp_s must be finite"),
    "text stamp": (lambda t: t.update(seen(), "now", CAMERA), "stamp_s must be a number"),  # type: ignore[arg-type]
    "earlier stamp": (
        lambda t: t.update(seen(-0.1), -0.1, CAMERA),
        r"the last frame was at 0.45\d* s, and a frame may come at most max_lag_s = 0.5 s late",
    ),
    "predict the past": (
        lambda t: t.predict(0.1),
        r"predict at stamp_s = 0.1 s: the last frame was at 0.45\d* s",
    ),
    "predict NaN": (lambda t: t.predict(np.nan), "stamp_s must be finite"),
    "NaN in T": (
        lambda t: t.update(seen(), NOW_S, altered(0, 3, np.nan)),
        "T_odom_camera must be finite",
    ),
    "T of a wrong shape": (
        lambda t: t.update(seen(), NOW_S, np.eye(3)),
        r"T_odom_camera must have shape \(4, 4\), got \(3, 3\)",
    ),
    "T with a scale": (
        lambda t: t.update(seen(), NOW_S, altered(1, 0, -2.0)),
        r"T_odom_camera\[:3, :3\] must be a rotation",
    ),
    "T that mirrors": (
        lambda t: t.update(seen(), NOW_S, altered(1, 0, 1.0)),
        r"T_odom_camera\[:3, :3\] must be a rotation",
    ),
    "T that projects": (
        lambda t: t.update(seen(), NOW_S, altered(3, 0, 0.5)),
        "T_odom_camera must have the last row",
    ),
    "no iterable": (
        lambda t: t.update(3, NOW_S, CAMERA),  # type: ignore[arg-type]
        "observations must be an iterable of PersonObservation, got int",
    ),
    "None in the list": (
        lambda t: t.update([*seen(), None], NOW_S, CAMERA),
        r"observations\[2\] must be a PersonObservation, got NoneType",
    ),
    "an array in the list": (
        lambda t: t.update([np.zeros(3)], NOW_S, CAMERA),  # type: ignore[list-item]
        r"observations\[0\] must be a PersonObservation, got ndarray",
    ),
    "an observation of another frame": (
        lambda t: t.update([*seen(), observe((1.0, 0.0), LAST_S)], NOW_S, CAMERA),
        r"observations\[2\].stamp_s = 0.45\d* s must be that of its frame, 0.5 s",
    ),
    "a position off the Earth": (
        lambda t: t.update([*seen(), observe((1e300, 0.0), NOW_S)], NOW_S, CAMERA),
        r"observations\[2\] must lie within",
    ),
    "a position that overflows": (
        lambda t: t.update([observe((1.7e308, 1.7e308), NOW_S)], NOW_S, camera_at(yaw_rad=0.8)),
        r"observations\[0\] must lie within",
    ),
    "a position without bound": (
        lambda t: t.update([observe((1, 0), NOW_S, covariance_odom_m2=1e200)], NOW_S, CAMERA),
        r"observations\[0\].position_covariance_m2 must sum to at most",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_input_is_named_and_changes_nothing(case: str) -> None:
    call, message = REFUSED[case]
    tracker, twin = watched(), watched()
    with pytest.raises(TrackingError, match=message):
        call(tracker)
    assert tracker.last_stamp_s == twin.last_stamp_s
    assert as_bytes(tracker.predict(NOW_S)) == as_bytes(twin.predict(NOW_S))
    for step in range(10, 14):
        now = step * PERIOD_S
        frame = [observe((3.0 + now, 0.0), now, awareness=0.9), observe((9.0, 1.0), now)]
        assert as_bytes(tracker.update(frame, now, CAMERA)) == as_bytes(
            twin.update(frame, now, CAMERA)
        )


def test_a_generator_that_fails_changes_nothing() -> None:
    def failing() -> Any:
        yield observe((3.5, 0.0), NOW_S)
        raise ConnectionError("camera gone")

    tracker, twin = watched(), watched()
    with pytest.raises(ConnectionError):
        tracker.update(failing(), NOW_S, CAMERA)
    assert as_bytes(tracker.predict(NOW_S)) == as_bytes(twin.predict(NOW_S))


def test_before_the_first_frame_there_are_no_tracks_at_any_time() -> None:
    tracker = PersonTracker()
    assert tracker.last_stamp_s is None
    assert tracker.predict(-1e9) == ()
    assert tracker.predict(1e9) == ()
    with pytest.raises(TrackingError, match="stamp_s must be finite"):
        tracker.predict(float("nan"))


def test_tracks_cannot_be_written_to() -> None:
    (track, *_) = watched().predict(NOW_S)
    with pytest.raises(AttributeError):
        track.awareness_lower = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        track.position_odom_m[0] = 0.0
