"""Refusals by name, which change nothing: policies, robots, updates, exports, motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nav_policies import Own
from nav_scenes import ROBOT, constraints_of, numbers, person, robot_at, settled_update

from nav_adapter import (
    Alert,
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    NavError,
    PersonObstacle,
    RobotProfile,
    RobotState,
    max_speed_mps,
    paint_costmap,
    points,
    protective_separation_m,
)
from nav_adapter.exporters import (
    CostmapPainter,
    SpeedMap,
    half_planes,
    people_cost,
    predicted_circles,
    speed_limit_at,
    time_cost,
)
from nav_adapter.motion import (
    clip_twists,
    clip_twists_ahead,
    control_point,
    differential_drive,
    twist_envelope,
)
from nav_adapter.ros2 import RobotFile
from perception import PerceptionError
from perception.arrays import finite_number
from sim_tests.actors.robot import RobotModel, shipped_robots
from tracking import PersonTrack, TrackerConfig, TrackingError
from tracking.prediction import FITTED

ONE = constraints_of((2, 0, 0, 0, 0.5))
ALONE = NavConstraints(0.0, (), 1.0, "a test", False)
SETTLED = settled_update([person()])
PLACES = np.zeros((2, 3, 2))
STEERS = replace(ROBOT, drive="ackermann", min_turning_radius_m=1.4)
OUTLINE_M = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
CIRCLE = PersonObstacle(1, (3.0, 0.0), (0.0, 0.0), 0.5, 1.7, 0.0, ONE.obstacles[0].polygon)


def adapted(**policy: Any) -> NavAdapter:
    return NavAdapter(AwarenessPolicy(**policy), ROBOT)


def painted(**changes: Any) -> None:
    """Paint into a map that stays as it is."""
    costmap = np.zeros((50, 50), dtype=np.uint8)
    arguments = {"costmap": costmap, "origin_odom_m": (0.0, 0.0), "resolution_m": 0.1} | changes
    try:
        paint_costmap(constraints=ONE, **arguments)
    finally:
        assert not costmap.any()


def cost(**changes: Any) -> Any:
    return people_cost(ONE, **({"positions_odom_m": np.zeros((1, 1, 2)), "dt_s": 0.1} | changes))


def planes(**changes: Any) -> Any:
    valid = {"position_odom_m": (0, 0), "velocity_odom_mps": (0, 0), "robot_radius_m": 0.4}
    return half_planes(ONE, **(valid | changes))


def field(**changes: Any) -> Any:
    valid = {"constraints": SETTLED, "positions_odom_m": PLACES, "dt_s": 0.1}
    return speed_limit_at(**(valid | changes))


def ahead(twists: Any = (0.1, 0.1), dt_s: float = 0.05, **changes: Any) -> Any:
    return clip_twists_ahead(SETTLED, robot_at(), twists, dt_s, **changes)


READ_ONLY = np.zeros((5, 5), dtype=np.uint8)
READ_ONLY.setflags(write=False)

#: Robots in another unit, or in the frame of a map, and what is said of them.
OUTLINES: list[tuple[Any, str]] = [
    (OUTLINE_M * 1000.0, "within 10 m of the base .*, got a corner at 438.292 m; .*millimetres"),
    (OUTLINE_M * 100.0, "within 10 m of the base .*, got a corner at 43.8292 m; .*centimetres"),
    (OUTLINE_M + np.array([12.0, 40.0]), "within 10 m of the base origin"),
    (OUTLINE_M * 0.01, "at least 0.002 m², got 3.6e-05 m²; its corners are in metres"),
    (OUTLINE_M * [1.0, 0.001], "at least 0.002 m², got 0.00036 m²"),
]
SPEEDS: list[tuple[str, float, str]] = [
    ("max_speed_mps", 150.0, "at most 15 m/s, got 150 m/s; is it in mm/s, cm/s or km/h"),
    ("max_acceleration_mps2", 100.0, "at most 10 m/s², got 100 m/s²"),
    ("max_deceleration_mps2", 1000.0, "at most 10 m/s², got 1000 m/s²; is it in mm/s²"),
    ("reaction_time_s", 300.0, "at most 5 s, got 300 s; is it in milliseconds"),
    ("max_yaw_rate_radps", 90.0, "at most 20 rad/s, got 90 rad/s; is it in degrees per second"),
    ("max_yaw_acceleration_radps2", 180.0, "at most 100 rad/s², got 180 rad/s²"),
    ("min_turning_radius_m", 1500.0, "at most 100 m, got 1500 m; is it in millimetres"),
]

SEPARATION = {"deceleration_mps2": 0.0, "reaction_time_s": 0.3, "clearance_m": 0.1}

#: Calls, and what is said of their arguments.
CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: NavAdapter({}, ROBOT), "policy must be an AwarenessPolicy, got dict"),
    (lambda: NavAdapter(AwarenessPolicy(), ()), "robot must be a RobotProfile, got tuple"),
    (
        lambda: NavAdapter(AwarenessPolicy(), ROBOT, prediction="prediction.yaml"),
        "prediction must be a PredictionModel or None, got str",
    ),
    (lambda: adapted(inflation=Own(lambda _: math.nan)), r"radius_m\(0\) must be finite, got nan"),
    (lambda: adapted(inflation=Own(lambda a: 2.0 + a)), "not grow with awareness, got 2 m"),
    (lambda: adapted(inflation=Own(lambda a: math.inf if a else 1.0)), "must be finite, got inf"),
    (lambda: adapted(speed=Own(speed=-0.1)), r"human_speed_mps\(0\) must lie in .*, got -0.1"),
    (lambda: adapted(speed=Own(speed=None)), "must be a number, got NoneType"),
    (lambda: adapted().watchdog(10**400), "stamp_s"),
    (lambda: RobotState(10**400, np.zeros(2), 0.0, 0.0, 0.0), "stamp_s"),
    (lambda: RobotState(0.0, [10**400, 0], 0.0, 0.0, 0.0), "position_odom_m"),
    (lambda: replace(robot_at(), velocity_base_mps=np.array([0.5, 0.2])), "first number of velo"),
    (lambda: replace(robot_at(), velocity_base_mps=np.array([0.0, math.nan])), "must be finite"),
    (lambda: replace(robot_at(), velocity_base_mps=np.zeros(3)), "velocity_base_mps"),
    (lambda: replace(ROBOT, drive="tracked"), "drive must be 'differential', 'ackermann', 'h"),
    *(
        (lambda outline=outline: replace(ROBOT, footprint_m=outline), f"^footprint_m must .*{text}")
        for outline, text in OUTLINES
    ),
    *(
        (lambda name=name, value=value: replace(STEERS, **{name: value}), f"{name} must be {text}")
        for name, value, text in SPEEDS
    ),
    (lambda: replace(ROBOT, max_yaw_rate_radps=0.0), "max_yaw_rate_radps"),
    (lambda: replace(ROBOT, max_yaw_acceleration_radps2=math.inf), "max_yaw_acceleration_radps2"),
    (lambda: replace(STEERS, min_turning_radius_m=None), "min_turning_radius_m must"),
    (lambda: replace(STEERS, drive="differential"), "min_turning_radius_m must"),
    (lambda: replace(STEERS, drive=None), "min_turning_radius_m must"),
    (lambda: replace(STEERS, brakes_on_curve=1), "brakes_on_curve must be True or False"),
    (lambda: replace(STEERS, min_turning_radius_m=0.0), "min_turning_radius_m must"),
    (lambda: replace(STEERS, min_turning_radius_m=math.inf), "min_turning_radius_m must"),
    (lambda: Alert(1, "siren", 1.0, 0.0, ""), "kind must be one of light, voice, horn, attent"),
    (lambda: Alert(1, "horn", -1.0, 0.0, ""), "time_to_closest_s must lie in"),
    (lambda: Alert(1, "attention", 1.0, 0.0, ""), "means must be light, voice, horn with kind"),
    (lambda: Alert(1, "horn", 1.0, 0.0, "", means="light"), "means must be horn .*, got 'light'"),
    (lambda: Alert(1, "attention", 1.0, 0.0, "", means="voice", wins_s=-1.0), "wins_s must lie in"),
    (lambda: painted(costmap=np.zeros((5, 5))), "uint8 array of shape .H, W., got float64"),
    (lambda: painted(costmap=np.zeros((5, 5, 1), dtype=np.uint8)), r"got uint8 of shape \(5, 5, 1"),
    (lambda: painted(costmap=[[0]]), "got list"),
    (lambda: painted(costmap=READ_ONLY), "writable"),
    (lambda: painted(resolution_m=0.0), "resolution_m must lie in"),
    (lambda: painted(resolution_m=math.nan), "resolution_m must be finite"),
    (lambda: painted(origin_odom_m=(0.0, math.inf)), "origin_odom_m must be finite"),
    (lambda: painted(origin_odom_m=(0.0, 0.0, 0.0)), r"origin_odom_m must have shape \(2,\)"),
    (lambda: painted(ring_m=-0.1), "ring_m must lie in"),
    (lambda: painted(decay_per_m=0.0), "decay_per_m must lie in"),
    (lambda: CostmapPainter(np.zeros((5, 5)), (0, 0), 0.1), "uint8 array of shape"),
    (
        lambda: CostmapPainter(READ_ONLY.copy(), (0, 0), 0.1, inscribed_radius_m=-0.1),
        "inscribed_radius_m must lie in",
    ),
    (lambda: CostmapPainter(READ_ONLY.copy(), (0, 0), 0.0), "resolution_m must lie in"),
    *(
        (lambda spacing_m=spacing_m: points(ONE, spacing_m), "spacing_m must")
        for spacing_m in (0.0, -1.0, 1e-9, math.nan, math.inf)
    ),
    (lambda: cost(positions_odom_m=np.zeros((3, 2))), r"must have shape \(K, T, 2\)"),
    (lambda: cost(positions_odom_m=np.full((1, 1, 2), math.nan)), "positions_odom_m must be fin"),
    (lambda: cost(dt_s=0.0), "dt_s must lie in"),
    (lambda: cost(decay_m=0.0), "decay_m must lie in"),
    (lambda: cost(inside_cost=1.0), "inside_cost must lie in"),
    (lambda: cost(robot_radius_m=-1.0), "robot_radius_m must lie in"),
    (lambda: predicted_circles(ONE, [0.0, -0.1]), "times_s must not be negative, got -0.1 s"),
    (lambda: predicted_circles(ONE, 0.5), r"times_s must have shape \(T,\)"),
    (lambda: predicted_circles(ONE, [0.0], growth_mps=-0.1), "growth_mps must lie in"),
    (
        lambda: predicted_circles(ONE, [0.0], slots=0, robot_position_odom_m=(0, 0)),
        "slots must be a whole number",
    ),
    (lambda: predicted_circles(ONE, [0.0], slots=2), "slots needs robot_position_odom_m"),
    (lambda: predicted_circles(SETTLED, [0.0], model=FITTED, sigmas=-1.0), "sigmas"),
    (lambda: predicted_circles(ONE, [0.0], model=FITTED), r"\[0\] has covariance_odom=None"),
    (lambda: replace(CIRCLE, covariance_odom=-np.eye(4)), "covariance_odom"),
    (lambda: planes(position_odom_m=(0.0, math.nan)), "position_odom_m must be finite"),
    (lambda: planes(velocity_odom_mps=(0.0,)), r"velocity_odom_mps must have shape \(2,\)"),
    (lambda: planes(robot_radius_m=-0.1), "robot_radius_m must lie in"),
    (lambda: planes(horizon_s=0.0), "horizon_s must lie in"),
    (lambda: planes(resolve_s=math.inf), "resolve_s must be finite"),
    (lambda: planes(share=0.4), "share must lie in"),
    (lambda: field(constraints=ALONE), "must come from NavAdapter.update"),
    (lambda: field(positions_odom_m=PLACES[0]), "positions_odom_m"),
    (lambda: field(positions_odom_m=PLACES + math.nan), "positions_odom_m"),
    (lambda: field(dt_s=0.0), "dt_s"),
    (lambda: field(first_s=-1.0), "first_s"),
    (lambda: field(headings_odom_rad=np.zeros(3)), "headings_odom_rad"),
    (lambda: field(speeds_mps=np.zeros((2, 3, 3))), "speeds_mps"),
    (lambda: field(yaw_rates_radps=np.zeros((3, 2))), "yaw_rates_radps"),
    (lambda: field(aware_for_s=-1.0), "aware_for_s"),
    (lambda: time_cost(SETTLED, PLACES, dt_s=0.1, slowest_mps=-1.0), "slowest_mps"),
    (lambda: SpeedMap.around(SETTLED, [0, 0], times_s=(-1.0,)), "times_s"),
    (lambda: SpeedMap.around(SETTLED, [0, 0], resolution_m=0.001), "1 to 4000000 cells"),
    (lambda: ALONE.yaw_rate_limit_radps(0.5), r"constraints with a robot.*robot=None"),
    (lambda: clip_twists(ALONE, [0.1, 0.1]), r"constraints with a robot.*robot=None"),
    (lambda: twist_envelope(ALONE), r"constraints with a robot.*robot=None"),
    (lambda: SETTLED.yaw_rate_limit_radps(math.nan), "speed_mps must be finite"),
    *(
        (lambda twists=twists: clip_twists(SETTLED, twists), "twists must be finite")
        for twists in (1.0, [1.0], [[0.0, math.nan]], np.zeros((3, 4)))
    ),
    (lambda: clip_twists(SETTLED, [0.1, 0.1], slack_mps=-0.01), "slack_mps must"),
    (lambda: replace(ALONE, fastest_point_limit_mps=math.nan), "fastest_point_limit_mps"),
    (lambda: ahead(slack_mps=math.nan), "slack_mps must"),
    (lambda: ahead(cycles=-1), "cycles must be a whole number >= 0, got -1"),
    (lambda: ahead(dt_s=0.0), "dt_s must"),
    (lambda: ahead([0.1]), "twists must be finite"),
    (lambda: differential_drive((math.nan, 0.0), robot_at(), ROBOT), "velocity_odom_mps"),
    (lambda: differential_drive((1.0, 0.0), robot_at(), ROBOT, dt_s=0.0), "dt_s"),
    (lambda: differential_drive((1.0, 0.0), robot_at(), ROBOT, ahead_m=0.0), "ahead_m"),
    (lambda: control_point(robot_at(), -1.0), "ahead_m"),
    *(
        (
            lambda a=a: max_speed_mps(3, 1.6, **(SEPARATION | {"deceleration_mps2": a})),
            "must be > 0 m",
        )
        for a in (0.0, -1.0, math.nan)
    ),
    (lambda: protective_separation_m(1.0, 1.6, **SEPARATION), "deceleration_mps2"),
]


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_what_cannot_be_is_refused_by_name(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(NavError, match=message):
        call()


#: Arguments of ``update`` at 0.5 s that differ from valid ones, and what is said of them.
UPDATES: list[tuple[dict[str, Any], str]] = [
    ({"tracks": [person(0.5), "person"]}, r"tracks\[1\] must be a PersonTrack, got str"),
    ({"tracks": None}, "tracks must be an iterable of PersonTrack, got NoneType"),
    ({"tracks": [person(0.5), person(0.5)]}, "distinct ids, got id 1 twice"),
    ({"tracks": [person(0.6)]}, r"tracks\[0\].stamp_s must not lie after stamp_s"),
    # Negative ids are those of the stop polygon, and of people who are kept.
    ({"tracks": [person(0.5, track_id=-1)]}, "ids of at least 0, got -1"),
    ({"robot_state": None}, "robot_state must be a RobotState, got NoneType"),
    ({"robot_state": robot_at(0.7)}, "robot_state.stamp_s must not lie after stamp_s"),
    ({"stamp_s": math.nan}, "stamp_s must be finite, got nan"),
    ({"stamp_s": math.inf}, "stamp_s must be finite, got inf"),
    ({"stamp_s": 10**400}, "stamp_s must be"),
    ({"stamp_s": "now"}, "stamp_s must be a number, got str"),
    ({"stamp_s": 0.1}, "must not go backward, got 0.100000 s after 0.400000 s"),
    ({"perception_stamp_s": math.nan}, "perception_stamp_s must be finite"),
    ({"perception_stamp_s": 0.8}, "perception_stamp_s must not lie after stamp_s"),
    # Stamps that were never a time.
    ({"tracks": [person(-1e13)]}, r"tracks.*more than 1e\+12 s before stamp_s"),
    ({"robot_state": robot_at(-1e155)}, r"robot_state.*more than 1e\+12 s before stamp_s"),
    ({"perception_stamp_s": -1e308}, r"perception.*more than 1e\+12 s before stamp_s"),
    (
        {"tracks": [replace(person(0.5), covariance_odom=np.diag([0.01, 0.01, 1.7e308, 1.7e308]))]},
        "velocity's variance",
    ),
]


def scene(now: float) -> dict[str, Any]:
    return {
        "tracks": (person(now, awareness_lower=0.9), person(now, track_id=4)),
        "robot_state": robot_at(now, speed_mps=0.5),
        "stamp_s": now,
    }


@pytest.mark.parametrize(("bad", "message"), UPDATES)
def test_refused_input_leaves_no_trace(bad: dict[str, Any], message: str) -> None:
    adapter, twin = adapted(), adapted()
    for now in (0.0, 0.2, 0.4):
        adapter.update(**scene(now))
        twin.update(**scene(now))
    with pytest.raises(NavError, match=message):
        adapter.update(**(scene(0.5) | bad))
    for now in (0.5, 0.6):
        after, expected = adapter.update(**scene(now)), twin.update(**scene(now))
        assert numbers(after) == numbers(expected)
        assert after.alerts == expected.alerts


@pytest.mark.parametrize(
    "huge",
    [
        person(velocity=(1e308, 0.0)),
        person(position=(-1e308, 0.0), velocity=(-1e308, 0.0)),
        person(position=(1e200, 0.0)),
        person(sigma_m=1e150),
        replace(person(), covariance_odom=np.eye(4) * 1e308),
        replace(person(), covariance_odom=np.diag([0.01, 0.01, 1e308, 1e308])),
    ],
)
def test_numbers_that_overflow_are_refused_and_change_nothing(huge: PersonTrack) -> None:
    """A track's numbers may be finite while its prediction for 30 s, or its polygon, is not."""
    adapter, twin = adapted(), adapted()
    adapter.update(**scene(0.0))
    twin.update(**scene(0.0))
    with np.errstate(all="ignore"), pytest.raises(NavError, match=r"track 7: .* must be at most"):
        adapter.update([person(), replace(huge, id=7)], robot_at(30.0), 30.0)
    assert numbers(adapter.update(**scene(30.1))) == numbers(twin.update(**scene(30.1)))


def test_a_policy_that_fails_later_leaves_the_adapter_as_it_was() -> None:
    broken: list[bool] = []
    own = Own(lambda _: math.nan if broken else 0.7)
    adapter, twin = adapted(inflation=own), adapted(inflation=own)
    for one in (adapter, twin):
        one.update(**scene(0.0))
    broken.append(True)
    with pytest.raises(NavError, match="radius_m"):
        adapter.update(**scene(0.1))
    broken.clear()
    assert numbers(adapter.update(**scene(0.2))) == numbers(twin.update(**scene(0.2)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation: {aware_radius: 0.5}", "did you mean 'aware_radius_m'"),
        ("timming: {}", "did you mean 'timing'"),
        ("inflation: {aware_radius_m: 1.2}", "at most unaware_radius_m, got 1.2 m and 1 m"),
        ("speed: {aware_human_speed_mps: 2}", "at most unaware_human_speed_mps, got 2 m/s"),
        ("speed: {unaware_below: 0.7}", "aware_above must exceed unaware_below"),
        ("inflation: {unaware_radius_m: .nan}", "inflation.unaware_radius_m"),
        ("timing: {stop_after_s: 0.4}", "stale_after_s <= stop_after_s must hold"),
        ("timing: {lost_rise_mps2: on}", "must be a number, got True"),
        ("inflation: 3", "inflation"),
        ("reach: {turn: 30}", "did you mean 'turn_deg'"),
        ("noticed_counts_as: 1.5", "noticed_counts_as"),
        ("noticed_counts_as: .nan", "noticed_counts_as"),
        ("attention: {means: []}", "attention.means"),
        ("attention: {means: [horn]}", "attention.means"),
        ("inflation: {shape: linear}", "unknown key 'shape'"),
        ("rules: {standing: null}", "unknown key 'rules'"),
        ("[1, 2]", "got a list"),
        ("inflation: {", "not valid YAML"),
    ],
)
def test_a_bad_policy_file_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "policy.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(NavError) as refusal:
        AwarenessPolicy.from_yaml(path)
    assert message in str(refusal.value)
    assert "policy.yaml" in str(refusal.value)


ROBOT_FILE = """
footprint_m: [[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]]
max_speed_mps: 1.5
max_acceleration_mps2: 1.0
max_deceleration_mps2: 1.0
reaction_time_s: 0.3
camera: {position_base_m: [0.3, 0.0, 1.2]}
scanners: [{position_base_m: [0.37, 0.26, 0.2], upside_down: yes}]
"""


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("[0.3, 0.0, 1.2]", "[300, 0, 1200]", "camera.position_base_m: must lie within 10 m"),
        ("[0.37, 0.26, 0.2]", "[37, 26, 20]", "scanners.0.position_base_m: must lie within 10 m"),
        ("reaction_time_s: 0.3", "reaction_time_s: off", "reaction_time_s must be a number, got F"),
        ("max_speed_mps: 1.5", "max_speed_mps: yes", "max_speed_mps must be a number, got True"),
        ("[0.36, 0.25], [-", "[0.36, on], [-", "footprint_m must be a number, got "),
        ("[0.3, 0.0, 1.2]}", "[0.3, 0, 1], yaw_deg: no}", "yaw_deg must be a number, got False"),
        ("max_speed_mps: 1.5", "max_speed_mps: 150", "max_speed_mps must be at most 15 m/s"),
        ("camera:", "max_yaw_rate_radps: 0.0\ncamera:", "max_yaw_rate_radps"),
        ("camera:", "min_turning_radius_m: 1.0\ncamera:", "min_turning_radius_m must"),
        ("camera:", "drive: ackermann\ncamera:", "min_turning_radius_m must"),
        ("max_speed_mps", "max_sped_mps", "did you mean 'max_speed_mps'"),
        ("-0.36, -0.25], [0.36, -0.25]", "-0.36, 0.25]", "enclose"),
        ("[0.36, 0.25], ", "[0.36, 0.25, 0.0], ", "footprint_m"),
        ("max_speed_mps: 1.5", "max_speed_mps: 0.0", "max_speed_mps"),
        ("[0.3, 0.0, 1.2]", "[0.3, 0.0]", "position_base_m"),
    ],
)
def test_a_bad_robot_file_is_refused_by_name(old: str, new: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(ROBOT_FILE)
    robot = RobotFile.from_yaml(path)
    assert robot.profile().max_speed_mps == 1.5
    assert robot.scanners is not None
    assert robot.scanners[0].upside_down  # a key that holds a boolean takes one
    assert old in ROBOT_FILE
    path.write_text(ROBOT_FILE.replace(old, new))
    with pytest.raises(NavError, match=text):
        RobotFile.from_yaml(path).profile()


def test_small_large_and_shipped_robots_are_within_the_bounds() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    e_puck_m = 0.035 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert RobotProfile(e_puck_m, 0.15, 1.0, 1.0, 0.0).reaction_time_s == 0.0
    assert RobotProfile(OUTLINE_M * 12.0, 3.0, 2.0, 8.0, 1.0).max_deceleration_mps2 == 8.0
    for name in shipped_robots():
        assert RobotModel.shipped(name).profile.max_speed_mps <= 5.0


def test_a_boolean_is_no_number_anywhere(tmp_path: Path) -> None:
    for value in (True, np.False_):
        with pytest.raises(PerceptionError, match="x must be a number, got bool"):
            finite_number("x", value)
        with pytest.raises(NavError, match="reaction_time_s must be a number"):
            replace(ROBOT, reaction_time_s=value)
    (tmp_path / "tracker.yaml").write_text("awareness: {missed_frame_s: no}\n")
    with pytest.raises(TrackingError, match="missed_frame_s must be a number, got False"):
        TrackerConfig.from_yaml(tmp_path / "tracker.yaml")


@pytest.mark.parametrize(
    ("shift", "side"),
    [((0.5, 0), "ahead of"), ((-2, 0), "behind"), ((0, 1), "to the left"), ((0, -1), "right of")],
)
def test_a_footprint_wholly_beside_its_origin_is_refused(shift, side) -> None:
    with pytest.raises(NavError, match=rf"got one wholly .*{side}.*frame of a sensor"):
        replace(ROBOT, footprint_m=ROBOT.footprint_m + shift)
    at_its_end = ROBOT.footprint_m - ROBOT.footprint_m.min(axis=0)
    assert replace(ROBOT, footprint_m=at_its_end) is not None


@pytest.mark.parametrize(
    ("line", "cure"),
    [
        ("robot_radius: 0.3", "corners of the outline in footprint_m"),
        ("footprint: '[[0.3, 0.3], [0.3, -0.3], [-0.3, 0.0]]'", "as a list and not as text"),
        ("max_vel_theta: 1.0", "it is max_yaw_rate_radps here"),
    ],
)
def test_keys_of_nav2_in_a_robot_file_get_the_right_hint(tmp_path, line, cure) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(f"max_speed_mps: 1.0\n{line}\n")
    with pytest.raises(NavError, match=cure) as refused:
        RobotFile.from_yaml(path)
    assert "did you mean" not in str(refused.value)
