"""Refusals by name, which change nothing: frames, settings, views, predictions, paths."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fusion_scenes import LASER, both, laser_at
from pydantic import ValidationError
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, as_bytes, camera_at, observe, track_of

from perception import Camera
from tracking import (
    AwarenessFilterConfig,
    CameraView,
    PersonTracker,
    ScannerView,
    SensorConfig,
    SurroundView,
    TrackerConfig,
    TrackingError,
    View,
)
from tracking.prediction import PredictionModel, predict_ahead

NOW_S = 10 * PERIOD_S
LENS = Camera.from_fov(640, 480, 1.05)


@dataclass
class Answers:
    """A view that answers as it is told."""

    answer: Any = 1.0

    def visibility(self, positions_odom_m: FloatArray, _T: FloatArray) -> FloatArray:
        if self.answer == 1.0:
            return np.ones(len(positions_odom_m))
        return np.array(self.answer)


def watched(view: View | None = None) -> PersonTracker:
    """Return a tracker with a confirmed track and a tentative one."""
    tracker = PersonTracker(view=view)
    for step in range(10):
        now = step * PERIOD_S
        people = [observe((3.0 + now, 0.0), now, awareness=0.8)]
        if step == 9:
            people.append(observe((5.0, 2.0), now))
        tracker.update(people, now, CAMERA)
    return tracker


def altered(row: int, column: int, value: float) -> FloatArray:
    T = CAMERA.copy()
    T[row, column] = value
    return T


def seen(stamp_s: float = NOW_S) -> list[Any]:
    return [observe((3.5, 0.0), stamp_s, awareness=0.9), observe((7.0, 0.0), stamp_s)]


def far(place: tuple[float, float], **options: Any) -> list[Any]:
    return [*seen(), observe(place, NOW_S, **options)]


#: Arguments of ``update`` that differ from a valid frame, and what is said of them.
FRAMES: list[tuple[dict[str, Any], str]] = [
    ({"stamp_s": math.nan}, "stamp_s must be finite"),
    ({"stamp_s": math.inf}, "stamp_s must be finite"),
    ({"stamp_s": "now"}, "stamp_s must be a number"),
    (
        {"observations": seen(-0.1), "stamp_s": -0.1},
        r"the last frame was at 0.45\d* s, and a frame may come at most max_lag_s = 0.5 s late",
    ),
    ({"T_odom_camera": altered(0, 3, math.nan)}, "T_odom_camera must be finite"),
    ({"T_odom_camera": np.eye(3)}, r"T_odom_camera must have shape \(4, 4\), got \(3, 3\)"),
    ({"T_odom_camera": altered(1, 0, -2.0)}, r"T_odom_camera\[:3, :3\] must be a rotation"),
    ({"T_odom_camera": altered(1, 0, 1.0)}, r"T_odom_camera\[:3, :3\] must be a rotation"),
    ({"T_odom_camera": altered(3, 0, 0.5)}, "T_odom_camera must have the last row"),
    ({"observations": 3}, "observations must be an iterable of PersonObservation, got int"),
    ({"observations": [*seen(), None]}, r"observations\[2\] must be a Person.*, got NoneType"),
    ({"observations": [np.zeros(3)]}, r"observations\[0\] must be a Person.*, got ndarray"),
    (
        {"observations": [*seen(), observe((1.0, 0.0), 9 * PERIOD_S)]},
        r"observations\[2\].stamp_s = 0.45\d* s must be that of its frame, 0.5 s",
    ),
    ({"observations": far((1e300, 0.0))}, r"observations\[2\].position_camera_m must lie within"),
    (
        {"observations": [replace(seen()[0], range_lasting_relative_std=1.5)]},
        r"observations\[0\].range_lasting_relative_std must be at most 1, got 1.5",
    ),
    ({"T_odom_camera": altered(0, 3, 1e8)}, r"\[0\] must lie within 1e\+07 m of"),
    (
        {"observations": far((1.7e308, 1.7e308)), "T_odom_camera": camera_at(yaw_rad=0.8)},
        r"observations\[2\].position_camera_m must lie within",
    ),
    ({"observations": far((1.0, 0.0), covariance_odom_m2=1e200)}, r"\[2\].*_m2 must sum to at"),
    ({"pose_covariance_odom": np.eye(2)}, r"must have shape \(3, 3\), got \(2, 2\)"),
    ({"pose_covariance_odom": np.diag([1.0, 1.0, -1.0])}, "must be positive semi-definite"),
    ({"pose_covariance_odom": np.diag([1, 1, math.nan])}, "pose_covariance_odom must be finite"),
    ({"pose_covariance_odom": np.diag([1e200, 1.0, 1.0])}, "the pose's share included"),
    ({"sensor": "lidar"}, "sensor must be one of 'camera', got 'lidar'"),
    ({"sensor": ["laser"]}, "sensor must be one of 'camera', got \\['laser'\\]"),
    ({"view": 3}, "view must have a method visibility"),
    *(
        ({"observations": (), "view": Answers(answer)}, r"one number in \[0, 1\] per position")
        for answer in ([0.5] * 3, [[1.0] * 2], [2.0] * 2, [-0.1] * 2, [math.nan] * 2)
    ),
]


@pytest.mark.parametrize(("changes", "message"), FRAMES)
def test_a_refused_frame_is_named_and_changes_nothing(changes, message) -> None:
    tracker, twin = watched(Answers()), watched(Answers())
    frame = {"observations": seen(), "stamp_s": NOW_S, "T_odom_camera": CAMERA}
    with pytest.raises(TrackingError, match=message):
        tracker.update(**(frame | changes))
    assert tracker.last_stamp_s == twin.last_stamp_s
    assert as_bytes(tracker.predict(NOW_S)) == as_bytes(twin.predict(NOW_S))
    for step in range(10, 14):
        now = step * PERIOD_S
        people = [observe((3.0 + now, 0.0), now, awareness=0.9), observe((9.0, 1.0), now)]
        assert as_bytes(tracker.update(people, now, CAMERA)) == as_bytes(
            twin.update(people, now, CAMERA)
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
    assert tracker.predict(-1e9) == tracker.predict(1e9) == ()


def test_tracks_cannot_be_written_to() -> None:
    (track, *_) = watched().predict(NOW_S)
    with pytest.raises(AttributeError):
        track.awareness_lower = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        track.position_odom_m[0] = 0.0


#: Calls, and what is said of their arguments.
CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: PersonTracker().predict(math.nan), "stamp_s must be finite"),
    (lambda: watched().predict(0.1), r"predict at stamp_s = 0.1 s: the last frame was at 0.45\d*"),
    (lambda: PersonTracker({"max_coast_s": 2.0}), "config must be a TrackerConfig, got dict"),
    (lambda: both().update([], 0.0, laser_at(), sensor="lidar"), "'camera', 'laser', got 'lidar'"),
    (lambda: PersonTracker(sensors={"camera": SensorConfig()}), "names of their own, got 'cam"),
    (lambda: PersonTracker(sensors={LASER: ScannerView()}), "'laser'.* must be a Sensor.*, got Sc"),
    (lambda: PersonTracker(sensors=[SensorConfig()]), "mapping of names to SensorConfig, got list"),
    (lambda: PersonTracker(view=LENS), r"view must have a method visibility.*got Camera"),
    (lambda: SensorConfig(view=3), "view must have a method visibility"),
    (lambda: SensorConfig(sees_face=True), "did you mean 'sees_faces'"),
    (lambda: TrackerConfig(max_cost_s=2.0), "did you mean 'max_coast_s'"),
    (lambda: TrackerConfig(acceleration_density_m2ps3=0.0), "acceleration_density_m2ps3: "),
    (lambda: TrackerConfig(gate_probability=1.0), "gate_probability: "),
    (lambda: TrackerConfig(max_missed_s=0), r"^TrackerConfig: max_missed_s: [^\n]*, got 0$"),
    (lambda: TrackerConfig(max_coast_s=math.inf), "max_coast_s: "),
    (lambda: TrackerConfig(miss_cost=math.nan), "miss_cost: "),
    (lambda: TrackerConfig(gate_distance_m=1e300), "gate_distance_m: "),
    # A setting of 0.3 that nobody turned.
    (lambda: TrackerConfig(max_standing_coast_s=8.0), "'max_standing_coast_s'.*'max_coast_s'"),
    (lambda: AwarenessFilterConfig(prior_awareness=0.1), "unknown key 'prior_awareness'"),
    (lambda: AwarenessFilterConfig(lower_bound_confidence=1.0), "lower_bound_confidence"),
    # A hidden face must not keep awareness longer than being unseen.
    (
        lambda: AwarenessFilterConfig(no_face_time_constant_s=0.5, unseen_time_constant_s=0.3),
        "no_face_time_constant_s <= unseen",
    ),
    (lambda: CameraView(LENS, max_range_m=0.0), "max_range_m must lie in"),
    (lambda: CameraView(LENS, side_margin=0.7), "side_margin must lie in"),
    (lambda: CameraView(LENS, max_range_m=2.0, min_range_m=3.0), "min_range_m must lie in"),
    (lambda: CameraView("camera.yaml"), "camera must be a Camera, got str"),
    (lambda: CameraView(LENS).visibility([1.0, 2.0], CAMERA), "positions_odom_m must have shape"),
    (lambda: CameraView(LENS).visibility([[1.0, 0.0]], np.zeros((4, 4))), "T_odom_camera"),
    (lambda: ScannerView(field_rad=7.0), "field_rad must lie in"),
    (lambda: ScannerView(max_range_m=1.0, min_range_m=2.0), "min_range_m must lie in"),
    (lambda: ScannerView(points=np.zeros((3, 2))), "must be ScanPoints or None, got ndarray"),
    (lambda: ScannerView().passed(np.zeros((2, 2)), np.zeros(3), np.eye(4)), "radii_m"),
    (lambda: SurroundView((), ()), "of one length, at least 1, got 0 and 0"),
    (lambda: SurroundView((CameraView(LENS),) * 2, (np.eye(3),)), "got 2 and 1"),
    (
        lambda: SurroundView((CameraView(LENS),), (2.0 * np.eye(3),)),
        r"rotations_camera_view\[0\] must be a rotation",
    ),
    (lambda: SurroundView(("view",), (np.eye(3),)), "visibility"),
    (lambda: predict_ahead(track_of(), [-0.1]), "horizons_s"),
    (lambda: predict_ahead(track_of(), [math.nan]), "horizons_s"),
    (lambda: predict_ahead(track_of(), 1.0), "horizons_s"),
    (lambda: PredictionModel(horizons_s=[1.0]), "equally long, got 1 and 0 values"),
    (lambda: PredictionModel(horizons_s=[1.0, 0.5], std_factors=[1, 1]), "must increase from"),
    (lambda: PredictionModel(horizons_s=[0.0], std_factors=[1]), "must increase from above 0 s"),
    (lambda: PredictionModel(horizons_s=[1.0], std_factors=[20]), r"must lie in \[0.1, 10\]"),
    (lambda: PredictionModel(respons_s=1.0), "did you mean 'response_s'"),
]


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_what_cannot_be_is_refused_by_name(call: Callable[[], Any], message: str) -> None:
    with pytest.raises((TrackingError, ValidationError), match=message):
        call()


def test_an_unusable_file_is_refused_in_one_line_that_names_every_wrong_key(tmp_path: Path) -> None:
    path = tmp_path / "tracker.yaml"
    path.write_text("max_missed_s: 0\ngate_probability: x\nawareness: {noticed_memory: 0.1}\n")
    with pytest.raises(TrackingError) as caught:
        TrackerConfig.from_yaml(path)
    assert str(caught.value).splitlines() == [
        f"{path}: TrackerConfig: gate_probability: Input should be a valid number, unable to parse "
        "string as a number, got 'x'; max_missed_s: Input should be greater than or equal to "
        "0.0001, got 0; awareness: unknown key 'noticed_memory' in AwarenessFilterConfig; did you "
        "mean 'noticed_memory_s'?"
    ]
    path.write_text("gate_distance_m: 1.0e+300\n", encoding="utf-8")
    with pytest.raises(TrackingError, match=r"tracker\.yaml: (?s:.)*gate_distance_m"):
        TrackerConfig.from_yaml(path)


def test_a_view_is_not_lost_when_a_sensor_is_written(tmp_path: Path) -> None:
    sensor = SensorConfig(view=ScannerView(), sees_faces=True)
    path = tmp_path / "sensor.yaml"
    with pytest.raises(TrackingError, match="view of SensorConfig cannot be written as YAML"):
        sensor.to_yaml(path)
    assert not path.exists()
    sensor.model_copy(update={"view": None}).to_yaml(path)
    assert SensorConfig.from_yaml(path) == SensorConfig(sees_faces=True)
