"""docs/upgrading.md: the defaults, names and reactions that it states are those of the code."""

from __future__ import annotations

import importlib
import re

import numpy as np
import pytest
import yaml
from paths import ROOT

import awarenav
import nav_adapter
import perception
import tracking
from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from nav_adapter.policies import InterpolatedHumanSpeed
from perception import AwarenessPipeline, Camera, PersonObservation
from tracking import AwarenessFilterConfig, PersonTracker, TrackerConfig, TrackingError

TEXT = (ROOT / "docs" / "upgrading.md").read_text(encoding="utf-8")
NAMES_OF_0_1_0 = {
    "perception": "AttentionCone AwarenessPipeline Camera HeadPose HeadPoseEstimator "
    "PerceptionError PersonDetection PersonDetector PersonKeypoints PersonObservation "
    "PnpHeadPoseEstimator PoseEstimator",
    "tracking": "AwarenessFilterConfig PersonTrack PersonTracker TrackStatus TrackerConfig "
    "TrackingError",
    "nav_adapter": "AwarenessPolicy InflationPolicy NavAdapter NavConstraints NavError "
    "PersonObstacle RobotProfile RobotState SpeedPolicy boxes circles max_speed_mps paint_costmap "
    "points polygons protective_separation_m",
    "sim_tests": "CameraRenderer CrossingFrame CrossingResult KeypointNoise LocalPlanner "
    "NOVA_CARTER SamplingPlanner Scenario SimError StraightOn run_crossing shipped_scenarios",
}
#: The preset `balanced` as 0.1.0 shipped it.
POLICY_OF_0_1_0 = """
inflation: {unaware_below: 0.1, aware_above: 0.6, shape: smoothstep, unaware_radius_m: 1.0,
  aware_radius_m: 0.45}
speed: {unaware_below: 0.1, aware_above: 0.6, shape: smoothstep, unaware_human_speed_mps: 1.6,
  aware_human_speed_mps: 0.35}
margins: {minimum_clearance_m: 0.1, separation_clearance_m: 0.1, uncertainty_sigmas: 2.0}
timing: {shrink_rate_mps: 0.5, fresh_within_s: 0.25, hold_s: 1.0, stale_after_s: 0.5,
  stop_after_s: 1.5}
"""
T_ODOM_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1.0]])


def rows(heading: str) -> list[list[str]]:
    """Return the cells of the table whose header begins with these words."""
    (table,) = re.findall(
        rf"^\| {re.escape(heading)}.*\n\|[-| ]+\n((?:\|.*\n)+)", TEXT, re.MULTILINE
    )
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def policy_value(policy: AwarenessPolicy, path: str) -> object:
    value: object = policy
    for name in path.split("."):
        value = getattr(value, name)
    return value


@pytest.mark.parametrize("package", sorted(NAMES_OF_0_1_0))
def test_no_public_name_is_gone(package: str) -> None:
    if package == "sim_tests":
        pytest.importorskip("pybullet", reason="needs the extra sim")
    page = importlib.import_module(package)
    assert set(NAMES_OF_0_1_0[package].split()) <= set(page.__all__)


def test_changed_defaults_are_those_of_the_code() -> None:
    shipped = (TrackerConfig, AwarenessFilterConfig, InterpolatedHumanSpeed)
    models = {each.__name__: each for each in shipped}
    table = rows("setting | 0.1.0")
    assert len(table) == 5
    for setting, before, now, _ in table:
        model, field = setting.strip("`").split(".")
        default = models[model].model_fields[field].default
        if field == "aware_human_speed_mps":
            # Changed once more, as the table above says.
            assert f"`{field}` was {now} and is {default:g}" in TEXT
            continue
        assert default == float(now)
        assert default != float(before)
    config = TrackerConfig()
    assert (config.max_missed_s, config.max_standing_coast_s) == (1.2, 5.0)
    assert (config.max_lag_s, config.max_pause_s, config.new_clock_after_s) == (0.5, 10.0, 1.0)


def test_settings_of_0_2_are_there_or_named_as_gone() -> None:
    assert AwarenessPolicy() == AwarenessPolicy.preset("balanced")
    table, gone = (
        rows("setting | default"),
        " ".join(cells[0] for cells in rows("setting of 0.2.0")),
    )
    assert len(table) == 8
    kept = 0
    for setting, default, _, off in table:
        path = setting.strip("`")
        if path in gone or f"`{path}:" in gone:
            continue
        kept += 1
        assert policy_value(AwarenessPolicy(), path) == float(default), path
        chosen = yaml.safe_load(off.split(",")[0].strip("`"))
        data = AwarenessPolicy().model_dump()
        data[path.split(".")[0]][path.rpartition(".")[2]] = chosen
        assert policy_value(AwarenessPolicy.model_validate(data), path) == chosen
    assert kept == 2


def test_files_of_earlier_versions_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"minimum_clearance_m.*did you mean 'clearance_m'"):
        AwarenessPolicy.model_validate(yaml.safe_load(POLICY_OF_0_1_0))


def test_late_frames_are_sorted_in_and_early_ones_refused() -> None:
    tracker = PersonTracker()

    def update(stamp_s: float) -> None:
        place = np.array([0.0, 0.0, 3.0])
        seen = PersonObservation(stamp_s, place, 0.01 * np.eye(3), None, None, None, 0.9, None)
        tracker.update([seen], stamp_s, T_ODOM_CAMERA)

    for step in range(6):
        update(0.1 * step)
    update(0.3)
    with pytest.raises(TrackingError, match="max_pause_s = 10 s"):
        update(100.0)
    tracker.reset()
    update(0.0)


def test_the_pipeline_needs_no_networks_of_its_user() -> None:
    assert AwarenessPipeline(Camera.from_fov(64, 48, 1.0)) is not None


def test_every_error_is_an_awarenav_error() -> None:
    assert issubclass(awarenav.AwarenavError, ValueError)
    for error in (
        perception.PerceptionError,
        tracking.TrackingError,
        nav_adapter.NavError,
    ):
        assert issubclass(error, awarenav.AwarenavError)


def test_moved_modules_are_where_the_page_says() -> None:
    pytest.importorskip("pybullet", reason="needs the extra sim")
    table = rows("before")
    assert len(table) == 11
    for _, now in table:
        for name in re.findall(r"`([\w.]+)`", now):
            assert importlib.util.find_spec(name) is not None, name


def test_all_stands_for_as_many_scenarios_as_the_page_says() -> None:
    runs = pytest.importorskip("sim_tests.study.runs", reason="needs the extra sim")
    count = len(runs.plan_jobs(["all"], ["blind"], [0]))
    assert f"`--scenario all` runs {count} scenarios" in TEXT


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ("demo", "--out --seed --no-video"),
        ("crossings", "--scenario --policy --perception --episodes --out --seed --overwrite"),
        ("bench", "--baseline --out"),
    ],
)
def test_commands_keep_their_options(
    command: str, options: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert all(re.search(rf"^  {option}\b", shown, re.MULTILINE) for option in options.split())
