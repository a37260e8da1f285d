"""The settings: YAML, ranges and unknown keys."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from tracking_scenes import CAMERA, observe

from tracking import (
    AwarenessFilterConfig,
    PersonTracker,
    ScannerView,
    SensorConfig,
    TrackerConfig,
    TrackingError,
)


def test_a_config_is_the_same_after_yaml(tmp_path: Path) -> None:
    config = TrackerConfig(
        max_coast_s=2.5, awareness=AwarenessFilterConfig(unseen_time_constant_s=0.25)
    )
    config.to_yaml(tmp_path / "tracker.yaml")
    assert TrackerConfig.from_yaml(tmp_path / "tracker.yaml") == config


def test_a_misspelt_key_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ValidationError, match="did you mean 'max_coast_s'"):
        TrackerConfig.model_validate({"max_cost_s": 2.0})


@pytest.mark.parametrize(
    "wrong",
    [
        {"acceleration_density_m2ps3": 0.0},
        {"position_noise_floor_m": 0.0},
        {"gate_probability": 1.0},
        {"confirm_hits": 0},
        {"max_coast_s": float("inf")},
        {"initial_velocity_std_mps": float("nan")},
        {"awareness": {"prior_awareness": 0.0}},
        {"awareness": {"prior_awareness": 0.9}},
        {"awareness": {"lower_bound_confidence": 1.0}},
    ],
)
def test_values_out_of_range_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        TrackerConfig.model_validate(wrong)


def test_an_unusable_file_is_refused_in_one_line_that_names_every_wrong_key(tmp_path: Path) -> None:
    path = tmp_path / "tracker.yaml"
    path.write_text("confirm_hits: 0\ngate_probability: x\nawareness: {prior_awarenes: 0.1}\n")
    with pytest.raises(TrackingError) as caught:
        TrackerConfig.from_yaml(path)
    lines = str(caught.value).splitlines()
    assert lines == [
        f"{path}: TrackerConfig: gate_probability: Input should be a valid number, unable to parse "
        "string as a number, got 'x'; confirm_hits: Input should be greater than or equal to 1, "
        "got 0; awareness: unknown key 'prior_awarenes' in AwarenessFilterConfig; did you mean "
        "'prior_awareness'?"
    ]
    with pytest.raises(TrackingError, match=r"^TrackerConfig: confirm_hits: [^\n]*, got 0$"):
        TrackerConfig(confirm_hits=0)


def test_a_hidden_face_must_not_keep_awareness_longer_than_being_unseen() -> None:
    with pytest.raises(ValidationError, match="no_face_time_constant_s <= unseen"):
        AwarenessFilterConfig(no_face_time_constant_s=0.5, unseen_time_constant_s=0.3)


def test_a_view_is_not_lost_when_a_sensor_is_written(tmp_path: Path) -> None:
    sensor = SensorConfig(view=ScannerView(), detection_probability=0.8)
    path = tmp_path / "sensor.yaml"
    with pytest.raises(TrackingError, match="view of SensorConfig cannot be written as YAML"):
        sensor.to_yaml(path)
    assert not path.exists()
    sensor.model_copy(update={"view": None}).to_yaml(path)
    assert SensorConfig.from_yaml(path) == SensorConfig(detection_probability=0.8)


def test_the_tracker_accepts_only_a_tracker_config() -> None:
    assert PersonTracker(TrackerConfig(confirm_hits=2)).config.confirm_hits == 2
    with pytest.raises(TrackingError, match="config must be a TrackerConfig, got dict"):
        PersonTracker({"confirm_hits": 2})  # type: ignore[arg-type]


@pytest.mark.parametrize("setting", ["gate_distance_m", "acceleration_density_m2ps3", "stature_m"])
def test_settings_that_would_overflow_are_refused_wherever_they_come_from(
    setting: str, tmp_path: Path
) -> None:
    with pytest.raises(TrackingError, match=f"{setting}: "):
        TrackerConfig(**{setting: 1e300})
    path = tmp_path / "tracker.yaml"
    path.write_text(f"{setting}: 1.0e+300\n", encoding="utf-8")
    with pytest.raises(TrackingError, match=rf"tracker\.yaml: (?s:.)*{setting}"):
        TrackerConfig.from_yaml(path)


def bounds(model: type[BaseModel], name: str) -> tuple[float, float]:
    """Return the least and the greatest value that a setting accepts."""
    low, high = -math.inf, math.inf
    for rule in model.model_fields[name].metadata:
        low = max(low, getattr(rule, "ge", -math.inf))
        high = min(high, getattr(rule, "le", math.inf))
        if (least := getattr(rule, "gt", None)) is not None:
            low = max(low, math.nextafter(least, math.inf))
        if (most := getattr(rule, "lt", None)) is not None:
            high = min(high, math.nextafter(most, -math.inf))
    return low, high


def numbers(model: type[BaseModel]) -> dict[str, tuple[float, float]]:
    """Return the bounds of every setting of a config that is a number."""
    return {
        name: bounds(model, name)
        for name, field in model.model_fields.items()
        if field.annotation is float
    }


def test_every_number_has_bounds() -> None:
    for model in (TrackerConfig, AwarenessFilterConfig):
        for name, (low, high) in numbers(model).items():
            assert np.isfinite([low, high]).all(), name


@st.composite
def extreme(draw: st.DrawFn, model: type[BaseModel]) -> dict[str, float]:
    """Draw some settings at or near their bounds."""
    found = numbers(model)
    chosen = draw(st.sets(st.sampled_from(sorted(found)), max_size=4))
    return {
        name: draw(st.sampled_from(found[name]) | st.floats(*found[name]))
        for name in sorted(chosen)
    }


@given(extreme(TrackerConfig), extreme(AwarenessFilterConfig))
def test_the_tracker_runs_with_any_settings_it_accepts(
    settings: dict[str, float], of_awareness: dict[str, float]
) -> None:
    try:
        awareness = AwarenessFilterConfig(**of_awareness)  # type: ignore[arg-type]
    except ValidationError:
        assume(False)
    tracker = PersonTracker(TrackerConfig(awareness=awareness, **settings))  # type: ignore[arg-type]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for step in range(12):
            now = 0.1 * step
            people = [
                observe((3.0 + 0.1 * step, 0.0), now, awareness=0.8),
                observe((4.0, 0.4), now),
            ]
            for track in tracker.update(people if step % 5 != 3 else [], now, CAMERA):
                assert np.isfinite(track.position_odom_m).all()
                assert np.isfinite(track.velocity_odom_mps).all()
                assert np.isfinite(track.covariance_odom).all()
                assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
        tracker.predict(now + 30.0)
