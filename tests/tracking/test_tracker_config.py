"""The settings: YAML, ranges and unknown keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from tracking import AwarenessFilterConfig, PersonTracker, TrackerConfig, TrackingError


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


def test_a_hidden_face_must_not_keep_awareness_longer_than_being_unseen() -> None:
    with pytest.raises(ValidationError, match="no_face_time_constant_s <= unseen"):
        AwarenessFilterConfig(no_face_time_constant_s=0.5, unseen_time_constant_s=0.3)


def test_the_tracker_accepts_only_a_tracker_config() -> None:
    assert PersonTracker(TrackerConfig(confirm_hits=2)).config.confirm_hits == 2
    with pytest.raises(TrackingError, match="config must be a TrackerConfig, got dict"):
        PersonTracker({"confirm_hits": 2})  # type: ignore[arg-type]
