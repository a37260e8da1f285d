"""The curated surface: what each package exports, and the size of what lies behind it."""

from __future__ import annotations

import importlib
import inspect
from importlib import metadata

import pytest
from paths import ROOT

import awarenav

MAX_LINES = 500
MAX_NAMES = 17

# The fixed public contract: these names may gain company, and may not go.
CONTRACT = {
    "perception": {
        "AttentionCone": ("half_angle_rad",),
        "AwarenessPipeline": (
            *("camera", "detector", "pose_estimator", "head_pose_estimator", "cone"),
            "robot_points_camera_m",
        ),
        "Camera": ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion"),
        "HeadPose": (
            *("position_camera_m", "rotation_camera_head", "covariance", "reprojection_error_px"),
        ),
        "HeadPoseEstimator": None,
        "OnnxHeadPoseEstimator": ("path",),
        "OnnxPersonDetector": ("path",),
        "OnnxPoseEstimator": ("path",),
        "PersonDetection": ("box_xyxy_px", "score"),
        "PersonDetector": None,
        "PersonKeypoints": ("keypoints_px", "keypoints_root_m", "scores", "layout"),
        "PersonObservation": (
            *("stamp_s", "position_camera_m", "position_covariance_m2", "gaze_camera"),
            *("awareness", "awareness_std", "score", "box_xyxy_px"),
        ),
        "PnpHeadPoseEstimator": (),
        "PoseEstimator": None,
    },
    "tracking": {
        "PersonTrack": (
            *("id", "stamp_s", "status", "position_odom_m", "velocity_odom_mps"),
            *("covariance_odom", "awareness", "awareness_std", "awareness_lower", "height_m"),
            "time_since_seen_s",
        ),
        "PersonTracker": ("config",),
        "TrackerConfig": None,
    },
    "nav_adapter": {
        "AwarenessPolicy": None,
        "InflationPolicy": None,
        "NavAdapter": ("policy", "robot"),
        "NavConstraints": ("stamp_s", "obstacles", "speed_limit_mps", "limited_by", "stale"),
        "PersonObstacle": (
            *("track_id", "center_odom_m", "velocity_odom_mps", "radius_m", "height_m"),
            *("awareness_lower", "polygon"),
        ),
        "RobotProfile": (
            *("footprint_m", "max_speed_mps", "max_acceleration_mps2", "max_deceleration_mps2"),
            "reaction_time_s",
        ),
        "RobotState": (
            *("stamp_s", "position_odom_m", "heading_odom_rad", "speed_mps", "yaw_rate_radps"),
        ),
        "SpeedPolicy": None,
        "boxes": ("constraints",),
        "circles": ("constraints",),
        "paint_costmap": ("costmap", "origin_odom_m", "resolution_m", "constraints"),
        "points": ("constraints", "spacing_m"),
        "polygons": ("constraints",),
    },
    "sim_tests": {
        "LocalPlanner": None,
        "run_crossing": ("scenario", "policy", "planner", "perception", "seed"),
    },
}
PACKAGES = sorted(CONTRACT)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_exported_name_resolves_and_says_what_it_is(package: str) -> None:
    module = importlib.import_module(package)
    assert inspect.getdoc(module)
    names = module.__all__
    assert len(names) == len(set(names)) <= MAX_NAMES
    assert not [name for name in names if name.startswith("_")]
    for name in names:
        exported = getattr(module, name)
        if inspect.isclass(exported) or inspect.isfunction(exported):
            assert exported.__doc__, f"{package}.{name} has no docstring"
            assert exported.__module__.split(".")[0] == package, f"{name} is another package's"


@pytest.mark.parametrize("package", PACKAGES)
def test_contract_is_kept(package: str) -> None:
    module = importlib.import_module(package)
    for name, parameters in CONTRACT[package].items():
        assert name in module.__all__, f"{package} does not export {name}"
        if parameters is None:
            continue
        # Arguments keep their names and their order; more may follow.
        taken = tuple(inspect.signature(getattr(module, name)).parameters)
        assert taken[: len(parameters)] == parameters, f"{package}.{name} takes {taken}"


def test_awarenav_gives_the_names_of_the_contract() -> None:
    names = [
        (package, name)
        for package, contract in CONTRACT.items()
        if package != "sim_tests"
        for name in contract
    ]
    assert names
    for package, name in names:
        assert name in awarenav.__all__
        assert getattr(awarenav, name) is getattr(importlib.import_module(package), name)
    for package, error in (
        ("perception", "PerceptionError"),
        ("tracking", "TrackingError"),
        ("nav_adapter", "NavError"),
        ("sim_tests", "SimError"),
    ):
        assert issubclass(getattr(importlib.import_module(package), error), awarenav.AwarenavError)
    assert awarenav.__version__ == metadata.version("awarenav")
    with pytest.raises(AttributeError, match="no attribute 'NavAdaptor'"):
        awarenav.NavAdaptor  # noqa: B018


@pytest.mark.parametrize("package", [*PACKAGES, "awarenav"])
def test_modules_are_short_and_marked_as_typed(package: str) -> None:
    folder = ROOT / package
    lengths = {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for path in folder.rglob("*.py")
    }
    assert lengths
    assert {path: lines for path, lines in lengths.items() if lines > MAX_LINES} == {}
    assert (folder / "py.typed").is_file()
