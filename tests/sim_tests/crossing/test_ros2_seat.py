"""A crossing as a ROS 2 robot, with a stack of our own over DDS."""

from __future__ import annotations

import ast
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from local_dds import own_domain

pytest.importorskip("pybullet", reason="the crossings need the extra sim")
pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from paths import ROOT
from ros2_peer import Peer

from awarenav.errors import AwarenavError
from nav_adapter import AwarenessPolicy
from nav_adapter.policies import AttentionRules
from nav_adapter.ros2 import camera_of, picture_of
from nav_adapter.ros2.conversions import pose_matrix
from nav_adapter.ros2.messages.geometry_msgs import Point, Twist, TwistStamped
from sim_tests import Scenario, SimError, run_crossing
from sim_tests.crossing.planner import is_outside, make_planner, planner_label
from sim_tests.study.measures import Conduct, measure, nondeterminism_notes
from sim_tests.study.runs import plan_jobs, run_jobs
from sim_tests.world.scanner import DIAGONAL_SCANNERS

WAY_M = 5.0
WATCHED = Scenario.model_validate(
    {
        "name": "watched",
        "description": "A short way past somebody who stands and sees nobody.",
        "duration_s": 16.0,
        "layout": {"x_min_m": -3.0, "y_min_m": -3.0, "x_max_m": 9.0, "y_max_m": 4.0},
        "robot": {"goal_x_m": WAY_M, "goal_tolerance_m": 0.25},
        "people": [{"name": "bystander", "route": [{"x_m": 4.5, "y_m": 2.4}], "heading_deg": 90.0}],
        "scanners": [{}, {"x_m": -0.375, "yaw_deg": 180.0}],
    }
)
#: Simulated time waits for each command and runs as fast as it can.
LOCKSTEP = "pace=20, command_hz=20"


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    return own_domain(monkeypatch)


def cross(domain: int, settings: str = LOCKSTEP, policy: str = "blind"):
    planner = f"ros2(domain={domain}, {settings})"
    return run_crossing(WATCHED, policy=policy, planner=planner)


@pytest.mark.parametrize("kind", [Twist, TwistStamped])
def test_a_stack_drives_to_the_goal_within_the_limit_that_it_hears(domain, kind) -> None:
    with Peer(domain, kind) as peer:
        result = cross(domain)
    assert result.time_to_goal_s is not None
    assert result.planner == f"ros2(domain={domain}, {LOCKSTEP})"
    # It heard the limits of the bridge, which slowed it down beside a person who sees nobody.
    speeds = np.array([each.robot_state.speed_mps for each in result.frames])
    limits = np.array([each.constraints.speed_limit_mps for each in result.frames])
    assert min(peer.limits_mps) < 0.6 * max(peer.limits_mps)
    assert min(peer.limits_mps) <= limits.min() + 1e-6
    braking = 1.0 * 0.1
    assert (speeds[1:] <= limits[:-1] + braking).all()
    row = measure(result)
    assert row.late_share == 0.0
    assert row.late_worst_s == 0.0


@pytest.mark.parametrize("limit", ["nobody", "outside"])
def test_a_stack_that_is_not_told_of_people_is_faster(domain, limit) -> None:
    with Peer(domain) as peer:
        untold = cross(domain, f"{LOCKSTEP}, limit={limit!r}")
        heard = tuple(peer.limits_mps)
        told = cross(domain)
    # A robot that meets nobody has its own maximum; DWB ignores a limit that is not below it.
    assert set(heard) == ({0.999 * 1.5} if limit == "nobody" else set())
    assert untold.time_to_goal_s < told.time_to_goal_s - 0.5


@contextmanager
def bridge_outside(domain: int) -> Iterator[None]:
    """A bridge with the robot of the docs, which reads the scans; in a process of its own."""
    words = ["--robot", str(ROOT / "docs/nav2/robot.yaml"), "--no-camera", "--domain", str(domain)]
    words += ["--scan", "scan", "--scan", "scan_2", "--map", "map"]
    process = subprocess.Popen(
        [sys.executable, "-m", "awarenav", "bridge", *words], stderr=subprocess.PIPE, text=True
    )
    try:
        for line in process.stderr:
            if "limit" in line:
                break
        yield
    finally:
        process.terminate()
        process.communicate()
    assert process.returncode == 0


def test_an_adapter_outside_slows_the_robot_and_the_frames_have_what_it_says(domain) -> None:
    scenario = WATCHED.model_copy(update={"scanners": DIAGONAL_SCANNERS})
    settings = f"ros2(domain={domain}, limit="
    with Peer(domain) as peer:
        with bridge_outside(domain):
            # No policy inside says so, and the truth about people is not used.
            outside = run_crossing(scenario, policy="scanner", planner=f"{settings}'outside')")
        heard = tuple(peer.limits_mps)
        alone = run_crossing(scenario, policy="blind", planner=f"{settings}'nobody')")
    assert outside.time_to_goal_s > alone.time_to_goal_s + 0.5
    limits = np.array([each.constraints.speed_limit_mps for each in outside.frames])
    assert set(limits) <= {*heard, 1.5}
    beside = [abs(each.robot_state.position_odom_m[0] - 4.0) < 1.0 for each in outside.frames]
    assert limits[beside].max() < 0.6 * limits.max()
    conduct = Conduct.of(outside)
    assert -0.2 < conduct.limit_excess_mps < 0.1
    assert conduct.fastest_point_excess_mps is None
    # The bridge saw the bystander's legs, and no face.
    seen = [each for frame in outside.frames for each in frame.constraints.obstacles]
    at_m = np.array([each.center_odom_m for each in seen])
    assert (np.hypot(*(at_m - (4.5, 2.4)).T) < 0.3).mean() > 0.8
    assert {each.awareness_lower for each in seen} == {0.0}
    assert {each.id for frame in outside.frames for each in frame.tracks}
    # Who is told of nobody knows of nobody.
    assert not any(frame.constraints.obstacles or frame.tracks for frame in alone.frames)


def test_a_stack_that_is_told_of_nobody_asks_nobody_to_look(domain) -> None:
    busy = "busy_in_aisle"
    asking = AwarenessPolicy.preset("balanced").model_copy(update={"attention": AttentionRules()})
    # The reference planner goes round these people; the one with a costmap passes near them.
    near = run_crossing(busy, policy=asking, planner="costmap")
    assert any(each.constraints.alerts for each in near.frames)
    with Peer(domain):
        planner = f"ros2(domain={domain}, {LOCKSTEP}, limit='nobody')"
        result = run_crossing(busy, policy=asking, planner=planner)
    assert not any(each.constraints.alerts for each in result.frames)


def test_in_lockstep_the_same_stack_gives_the_same_commands(domain) -> None:
    with Peer(domain):
        first, second = cross(domain), cross(domain)
    assert [each.command for each in first.frames] == [each.command for each in second.frames]


def test_the_robot_publishes_what_a_stack_needs(domain) -> None:
    with Peer(domain, tap=True) as peer:
        result = cross(domain)
    heard = peer.heard
    clock = [each.clock.sec + 1e-9 * each.clock.nanosec for each in heard["clock"]]
    assert (np.diff(clock) > 0.0).all()
    assert len(clock) > len(result.frames)
    frames = {
        (t.header.frame_id, t.child_frame_id) for m in heard["tf_static"] for t in m.transforms
    }
    assert frames == {("map", "odom"), ("base_link", "scan"), ("base_link", "scan_2")}
    (hall,) = heard["map"]
    cells = np.frombuffer(hall.data, dtype=np.int8)
    assert set(cells.tolist()) == {0, 100}
    assert len(cells) == hall.info.width * hall.info.height
    moved = heard["tf"][-1].transforms[0].transform.translation.x
    assert moved == pytest.approx(result.frames[-1].robot_state.position_odom_m[0], abs=0.2)
    # The person stands 2.4 m to the left of the way: the scanner ahead sees the legs there.
    first = heard["scan"][0]
    angles = first.angle_min + first.angle_increment * np.arange(len(first.ranges))
    x = 0.375 + np.array(first.ranges) * np.cos(angles)
    y = np.array(first.ranges) * np.sin(angles)
    assert (np.hypot(x - 4.5, y - 2.4) < 0.4).any()
    assert len(heard["scan_2"]) == len(heard["scan"]) > 20


def test_the_camera_of_the_robot_shows_what_is_ahead(domain) -> None:
    with Peer(domain, tap=True) as peer:
        cross(domain, f"{LOCKSTEP}, camera_hz=2")
    spec = WATCHED.camera
    camera = camera_of(peer.heard["camera_info"][0])
    assert (camera.width_px, camera.height_px) == (spec.width_px, spec.height_px)
    assert camera.fx_px == pytest.approx(spec.camera().fx_px)
    picture = picture_of(peer.heard["image"][-1])
    assert picture.shape == (spec.height_px, spec.width_px, 3)
    assert picture.std() > 10.0
    transforms = [each for message in peer.heard["tf_static"] for each in message.transforms]
    (mount,) = (each for each in transforms if each.child_frame_id == "camera_optical_frame")
    # An optical frame: its z axis points ahead.
    turn = pose_matrix(Point(), mount.transform.rotation)
    assert turn[0, 2] > 0.9


def test_the_robot_stops_when_commands_fall_silent(domain) -> None:
    with Peer(domain, silent_after_s=1.5):
        result = cross(domain, "pace=2")
    assert result.time_to_goal_s is None
    stands = [each.t_s for each in result.frames if each.command == (0.0, 0.0)]
    assert stands[-1] == result.frames[-1].t_s
    began_s = max(each.t_s for each in result.frames if each.command != (0.0, 0.0))
    assert began_s == pytest.approx(1.5 + 0.5, abs=0.3)
    assert abs(result.frames[-1].robot_state.speed_mps) < 0.02


def test_cycles_that_begin_late_are_counted(domain) -> None:
    def slow(frame, stage):
        if round(frame.t_s * 20) % 10 == 0:
            time.sleep(0.1)

    with Peer(domain):
        result = run_crossing(
            WATCHED, policy="blind", planner=f"ros2(domain={domain})", observer=slow
        )
    row = measure(result)
    assert row.late_share >= 0.1
    assert row.late_worst_s > 0.02
    (note,) = [each for each in nondeterminism_notes([row]) if "keep up" in each]
    assert "1 of 1 episode could not keep up" in note


def test_in_real_time_a_second_takes_a_second(domain) -> None:
    with Peer(domain):
        began = time.monotonic()
        result = cross(domain, "limit='nobody'")
        took_s = time.monotonic() - began
    assert result.time_to_goal_s < took_s


@pytest.mark.parametrize(
    ("peer", "settings", "text"),
    [
        (None, "wait_s=1", r"after 1 s nobody publishes cmd_vel and nobody reads goal_pose"),
        ({"reads_goal": False}, "wait_s=1.5, goal='goal_pose'", r"nobody reads goal_pose"),
    ],
)
def test_a_stack_that_is_not_there_is_an_error_that_says_what_is_missing(
    domain, peer, settings, text
) -> None:
    if peer is None:
        with pytest.raises(SimError, match=text):
            cross(domain, settings)
        return
    with Peer(domain, **peer), pytest.raises(SimError, match=text):
        cross(domain, settings)


def test_one_stack_drives_one_robot_at_a_time(domain) -> None:
    """A second crossing waits, and then says so."""
    answers: list[str] = []
    program = (
        "from sim_tests import run_crossing\n"
        "run_crossing('crossing_attentive', policy='blind', "
        f"planner='ros2(domain={domain}, wait_s=1)')"
    )

    def cross_too(frame, stage):
        if not answers:
            ran = subprocess.run(
                [sys.executable, "-c", program],
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                capture_output=True,
                text=True,
                check=False,
            )
            answers.append(ran.stderr)

    with Peer(domain):
        result = run_crossing(
            WATCHED,
            policy="blind",
            planner=f"ros2(domain={domain}, {LOCKSTEP})",
            observer=cross_too,
        )
    assert result.time_to_goal_s is not None
    assert "another crossing has the stack on ROS_DOMAIN_ID" in answers[0]


def test_a_stack_that_never_drives_is_an_error_that_says_what_to_look_at(domain) -> None:
    long = WATCHED.model_copy(update={"duration_s": 20.0})
    with (
        Peer(domain, silent_after_s=-math.inf),
        pytest.raises(SimError, match="has sent no cmd_vel in 15 s after its goal"),
    ):
        run_crossing(long, policy="blind", planner=f"ros2(domain={domain}, pace=10)")


def test_a_run_has_rows_like_any_other_and_one_worker(domain, tmp_path) -> None:
    text = WATCHED.model_dump_json()
    file = tmp_path / "watched.yaml"
    file.write_text(text)
    jobs = plan_jobs(
        [str(file)], ["blind"], [0], planners=["", f"ros2(domain={domain}, {LOCKSTEP})"],
        perception="truth",
    )  # fmt: skip
    with pytest.raises(SimError, match="give 1 worker"):
        run_jobs(jobs, tmp_path / "two", workers=2)
    with Peer(domain):
        reference, outside = run_jobs(jobs, tmp_path / "run")
    assert (reference.error, outside.error) == ("", "")
    assert (reference.nondeterministic, outside.nondeterministic) == (False, True)
    assert outside.time_to_goal_s is not None
    assert outside.time_lost_s is not None
    assert (reference.late_share, outside.late_share) == (None, 0.0)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ("goal='somewhere'", "goal must be one of auto, goal_pose"),
        ("limit='mine'", "limit must be one of policy, nobody, outside"),
        ("pace=0", "pace must lie in"),
        ("domain=300", "domain"),
        ("speed=2", "speed"),
        ("scans='scan'", "the robot has 2 scanners"),
    ],
)
def test_settings_out_of_bounds_are_refused(settings, text) -> None:
    with pytest.raises(AwarenavError, match=text):
        run_crossing(WATCHED, policy="blind", planner=f"ros2({settings})")


def test_known_planners_take_settings_too() -> None:
    assert all(is_outside(each) for each in ("ros2", "ros2(pace=2)"))
    assert not any(is_outside(each) for each in ("", "costmap", "my.ros2:Planner", "ros2x"))
    assert planner_label("ros2(pace=2)", WATCHED) == "ros2(pace=2)"
    with pytest.raises(SimError, match="has no argument 'speed'"):
        make_planner("costmap(speed=2)", WATCHED)
    planner = make_planner("ros2(pace=2)", WATCHED)
    with pytest.raises(SimError, match="drives in crossings only"):
        planner.plan(None, None, None, 0.05)


def test_the_client_of_actions_needs_nothing_of_the_project() -> None:
    """It runs in the Python of ROS, where the project need not be installed."""
    client = ROOT / "sim_tests" / "crossing" / "planner" / "ros2" / "_client.py"
    imported: set[str] = set()
    for node in ast.walk(ast.parse(client.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {each.name.partition(".")[0] for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(str(node.module).partition(".")[0])
    assert {"rclpy", "nav2_msgs"} <= imported
    assert imported <= {*sys.stdlib_module_names, "rclpy", "geometry_msgs", "nav_msgs", "nav2_msgs"}
