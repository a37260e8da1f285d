"""The planner of a ROS 2 stack: the robot's topics go out, and its commands come in."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
from filelock import FileLock, Timeout

from nav_adapter import NavConstraints, PersonObstacle, RobotProfile, RobotState
from nav_adapter.ros2 import Frames, SpeedMaskSettings, SpeedMaskStream, outgoing
from nav_adapter.ros2.conversions import odometry_of, to_time
from nav_adapter.ros2.messages.geometry_msgs import Twist
from nav_adapter.ros2.messages.rosgraph_msgs import Clock
from perception.arrays import FloatArray, finite_number
from tracking import PersonTrack

from ....world.camera import CameraTiming, CoarseSceneryRenderer, FrameClock
from ....world.errors import SimError
from ....world.scanner import ScanScene, SimulatedScanner, scan_all
from ..._stage import Stage
from ...sensors import hall_grid, motion_of
from ._actions import Actions, actions_of, python_with_ros
from ._link import Link, link_to
from ._messages import (
    CAMERA,
    ODOM,
    base_transform,
    goal_pose,
    map_message,
    people_of,
    picture_messages,
    scan_message,
    static_transforms,
)

#: Ways to send the goal.
GOALS: Final = ("auto", "goal_pose", "follow_path", "navigate_to_pose")
#: What is published of limit and people.
LIMITS: Final = ("policy", "nobody", "outside")
_TOPIC: Final = "goal_pose"
# A reader of goal_pose is found within this time.
_FOUND_S: Final = 3.0
# The base of a robot stops when commands have been silent for so long.
_SILENT_S: Final = 0.5
# After everybody is there, costmaps get scans for so long before the goal.
_SETTLES_S: Final = 1.5
# An adapter outside takes a robot that was silent for so long for one that begins anew; one that
# jumps back to the start has odometry that contradicts itself.
_PUT_BACK_S: Final = 2.0
_WAITING_PERIOD_S: Final = 0.05
# A stack that is asked to drive and sends no command for so long does not drive.
_FIRST_COMMAND_S: Final = 15.0
# Limits and people are published as often as the bridge does.
_PUBLISHED_HZ: Final = 20.0
# A cycle later than this is not made up for; all later ones begin later.
_MADE_UP_S: Final = 0.2
# In lockstep, a command that has not come after so long is not waited for.
_GIVEN_UP_S: Final = 2.0
_STREAM: Final = 0x205
_STILL: Final = Twist()


class Ros2Planner:
    """A ROS 2 stack outside, which sees the crossing as its robot and sends ``cmd_vel``.

    Published are ``/clock``, ``/odom``, ``/tf``, ``/tf_static``, ``/map``, the scans of the
    scenario's scanners, the goal, and what the bridge publishes of the constraints. A command
    counts from the beginning of a control cycle if it comes in the first half of it.

    Args:
        robot: the robot of the episode.
        reference_path_odom_m: (M, 2) straight way from start to goal.
        seed: of the episode.
        domain: ``ROS_DOMAIN_ID`` of the stack; None for that of the environment, else 0.
        goal: ``"goal_pose"``, a topic; or the action ``"follow_path"`` (with paths of the planner
            server, if there is one) or ``"navigate_to_pose"``, which need rclpy. ``"auto"`` is the
            topic where somebody reads it, else ``"follow_path"``.
        limit: ``"policy"`` publishes the constraints; ``"nobody"`` those of a robot that meets
            nobody, with which the stack drives as without this library; ``"outside"`` none, for
            something else that does, such as ``awarenav bridge``. Frames have what the stack is
            told: with ``"outside"``, limit and people as they are heard on ``/speed_limit`` and
            ``/people``.
        pace: simulated seconds per second; 1 is real time. Another pace needs ``use_sim_time``.
        command_hz: rate at which the stack sends commands, in simulated time: the clock then waits
            for each of them (lockstep), but goes no faster than the pace; 0 does not wait.
        scans: names of the topics of scans, in the order of the scanners.
        camera_hz: images of the camera per simulated second, on ``camera/image_raw``; 0 for none.
        wait_s: time to wait for the stack.

    Attributes:
        late_s: how much later than its time the last control cycle began.

    Raises:
        SimError: a setting out of bounds, or no Python with rclpy for an action.
        NavError: the extra ``ros2`` is missing.
    """

    #: The same episode differs from run to run, and one stack drives one robot at a time.
    outside: ClassVar = True

    def __init__(
        self,
        robot: RobotProfile,
        reference_path_odom_m: FloatArray,
        seed: int = 0,
        *,
        domain: int | None = None,
        goal: str = GOALS[0],
        limit: str = LIMITS[0],
        pace: float = 1.0,
        command_hz: float = 0.0,
        scans: str = "scan scan_2",
        camera_hz: float = 0.0,
        wait_s: float = 30.0,
    ) -> None:
        from nav_adapter.ros2 import DdsNode  # noqa: F401, PLC0415 - says what is missing

        if goal not in GOALS:
            raise SimError(f"goal must be one of {', '.join(GOALS)}, got {goal!r}")
        if limit not in LIMITS:
            raise SimError(f"limit must be one of {', '.join(LIMITS)}, got {limit!r}")
        if goal in GOALS[2:]:
            python_with_ros()
        self._robot, self._way_m, self._seed = robot, np.asarray(reference_path_odom_m), seed
        own = os.environ.get("ROS_DOMAIN_ID", "") or "0"
        self._domain = int(
            finite_number("domain", float(own if domain is None else domain), SimError)
        )
        self._goal, self._limit = goal, limit
        self._pace = finite_number("pace", pace, SimError, minimum=0.05, maximum=100.0)
        self._command_hz = finite_number("command_hz", command_hz, SimError, minimum=0.0)
        self._scans = tuple(str(scans).split())
        self._camera_hz = finite_number("camera_hz", camera_hz, SimError, minimum=0.0)
        self._wait_s = finite_number("wait_s", wait_s, SimError, minimum=1.0)
        self.late_s = self._given_up_s = 0.0
        self._publish_robot: Callable[[RobotState, float], None] | None = None
        self._command, self._command_s = _STILL, -math.inf
        self._driven = False
        self._told: tuple[NavConstraints, tuple[PersonTrack, ...]]
        self._told = self._constraints(robot.max_speed_mps), ()
        self._actions: Actions | None = None

    @contextlib.contextmanager
    def seated(self, stage: Stage) -> Iterator[None]:
        """Wait for the stack, send it the goal; it has the robot until the block ends.

        Raises:
            SimError: the stack is not there, or not whole.
        """
        count = len(stage.scenario.scanners)
        if count > len(self._scans):
            raise SimError(
                f"the robot has {count} scanners; give a topic for each, such as "
                f"scans='scan_front scan_rear', got {' '.join(self._scans)!r}"
            )
        with self._alone_with_the_stack():
            self._link = link = link_to(self._domain, self._scans[:count])
            if self._limit == LIMITS[2]:
                silent_s = time.time() - link.latest_s
                time.sleep(min(max(_PUT_BACK_S - silent_s, 0.0), _PUT_BACK_S))
            self._publish_robot = self._robots_publisher(stage, link)
            self._mask = SpeedMaskStream(SpeedMaskSettings(), ODOM)
            self._next_publication_s = 0.0
            try:
                self._wait(stage, link)
                self._send_goal(link)
                self._start_s = self._stamp()
                self._began = time.monotonic()
                yield
            finally:
                if self._actions is not None:
                    self._actions.stop()

    @contextlib.contextmanager
    def _alone_with_the_stack(self) -> Iterator[None]:
        """Keep other crossings of this computer from the stack; raise SimError if one has it."""
        lock = FileLock(Path(tempfile.gettempdir()) / f"awarenav_ros2_{self._domain}.lock")
        try:
            lock.acquire(timeout=self._wait_s)
        except Timeout as cause:
            raise SimError(
                f"another crossing has the stack on ROS_DOMAIN_ID {self._domain}: give 1 worker, "
                "or a domain with a stack of its own"
            ) from cause
        try:
            yield
        finally:
            lock.release()

    def told(
        self, constraints: NavConstraints, tracks: tuple[PersonTrack, ...]
    ) -> tuple[NavConstraints, tuple[PersonTrack, ...]]:
        """Return what the stack is told of limit and people, by the setting ``limit``."""
        if self._limit == LIMITS[0]:
            return constraints, tracks
        self._hear()
        own, tracks = self._told
        return replace(own, stamp_s=constraints.stamp_s), tracks

    def _hear(self) -> None:
        """Take what an adapter outside says; a controller keeps the last limit."""
        if self._limit != LIMITS[2]:
            return
        (before, tracks), (limit, people) = self._told, self._link.heard()
        obstacles, limit_mps = before.obstacles, before.speed_limit_mps
        maximum_mps = self._robot.max_speed_mps
        if limit is not None:
            value_mps = limit.speed_limit * (maximum_mps / 100.0 if limit.percentage else 1.0)
            limit_mps = min(value_mps or maximum_mps, maximum_mps)  # 0 removes all limits
        if people is not None:
            obstacles, tracks = people_of(people)
        self._told = self._constraints(limit_mps, obstacles), tracks

    def _constraints(
        self, limit_mps: float, obstacles: tuple[PersonObstacle, ...] = ()
    ) -> NavConstraints:
        """Return constraints for the base; they have no limit of the fastest point."""
        return NavConstraints(
            0.0, obstacles, limit_mps, self._limit, False, fastest_point_limit_mps=math.inf
        )

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, ...]:
        """Publish the present cycle when its time has come; return the stack's command.

        Raises:
            SimError: the stack sends no command, or the planner has no seat in a crossing.
        """
        if self._publish_robot is None:
            raise SimError("the planner ros2 drives in crossings only, where it has a seat")
        t_s = robot_state.stamp_s
        late_s = self._sleep_until(t_s)
        if self._command_hz:  # the clock waits, so that no cycle is late but for lost commands
            self._began += late_s
            late_s = self._given_up_s
        self.late_s = late_s
        self._began += max(late_s - _MADE_UP_S, 0.0)
        self._take(t_s)
        if self._limit != LIMITS[2] and t_s + 1e-6 >= self._next_publication_s:
            self._next_publication_s += 1.0 / _PUBLISHED_HZ
            self._publish_constraints(constraints, robot_state)
        self._publish_robot(robot_state, self._start_s)
        self._link.latest_s = self._start_s + t_s
        self._await_command(t_s, dt_s)
        if not self._driven and t_s > _FIRST_COMMAND_S:
            refused = self._actions.refused if self._actions is not None else ""
            raise SimError(
                f"the stack has sent no cmd_vel in {t_s:.0f} s after its goal"
                f"{f', which {refused} has refused' if refused else ''}: are its lifecycle nodes "
                "active (ros2 lifecycle get /controller_server), and does it find the frames map, "
                "odom and base_link?"
            )
        if t_s - self._command_s > _SILENT_S:
            return 0.0, 0.0
        linear, turn = self._command.linear, self._command.angular.z
        if self._robot.drive == "holonomic":
            return linear.x, linear.y, turn
        return linear.x, turn

    def _sleep_until(self, t_s: float) -> float:
        """Sleep until a simulated time; return how late it is, seconds."""
        left_s = self._began + t_s / self._pace - time.monotonic()
        time.sleep(max(left_s, 0.0))
        return max(-left_s, 0.0)

    def _await_command(self, t_s: float, dt_s: float) -> None:
        """Take what comes in the first half of the cycle; in lockstep, wait for what is due."""
        self._sleep_until(t_s + 0.5 * dt_s)
        self._take(t_s)
        if not (self._command_hz and t_s - self._command_s < _SILENT_S):
            return
        asked = time.monotonic()
        waited_s = 0.0
        while t_s - self._command_s > 1.0 / self._command_hz - 1e-6 and waited_s < _GIVEN_UP_S:
            time.sleep(5e-4)
            self._take(t_s)
            waited_s = time.monotonic() - asked
        self._given_up_s = waited_s if waited_s >= _GIVEN_UP_S else 0.0

    def _take(self, t_s: float) -> None:
        """Take the newest command."""
        command = self._link.command()
        if command is not None:
            self._command, self._command_s, self._driven = command, t_s, True

    def _publish_constraints(self, constraints: NavConstraints, state: RobotState) -> None:
        """Publish what the bridge does, on topics that somebody reads."""
        stamp_s = self._start_s + constraints.stamp_s
        stamped = replace(constraints, stamp_s=stamp_s)
        state = replace(state, stamp_s=self._start_s + state.stamp_s)
        read_by = self._link.read_by
        for messages in (
            outgoing(stamped, (), self._robot, state, Frames(), wanted=read_by),
            () if self._limit == LIMITS[1] else self._mask.messages(stamped, state, read_by),
        ):
            for key, message in messages:
                self._link.publish(key, message)

    def _wait(self, stage: Stage, link: Link) -> None:
        """Let the robot stand until the stack is there; raise SimError if it is not in time."""
        assert self._publish_robot is not None
        began = time.monotonic()
        settled = 0.0
        while not settled or time.monotonic() < settled:
            self._publish_robot(stage.amr.state(0.0), self._stamp())
            link.command()  # those of the goal before
            self._hear()
            time.sleep(_WAITING_PERIOD_S)
            waited_s = time.monotonic() - began
            missing = [] if link.is_driven else ["nobody publishes cmd_vel"]
            if text := self._no_goal(link, waited_s):
                missing.append(text)
            if missing and waited_s > self._wait_s:
                raise SimError(
                    f"no stack drives the robot on ROS_DOMAIN_ID {self._domain}: after "
                    f"{self._wait_s:g} s {' and '.join(missing)}. Start and activate the stack "
                    "with that domain, on a network that CYCLONEDDS_URI lets this process reach"
                )
            if missing:
                settled = 0.0
            elif not settled:
                settled = time.monotonic() + _SETTLES_S

    def _no_goal(self, link: Link, waited_s: float) -> str:
        """Return why the goal cannot be sent yet; empty if it can."""
        if self._actions is None and self._goal in GOALS[:2]:
            if link.read_by(_TOPIC):
                return ""
            nobody = "nobody reads goal_pose, as bt_navigator does"
            if self._goal == _TOPIC or waited_s < _FOUND_S:
                return nobody
            try:
                python_with_ros()
            except SimError as cause:
                return f"{nobody} ({cause})"
        if self._actions is None:
            kind = GOALS[2] if self._goal == GOALS[0] else self._goal
            self._actions = actions_of(self._domain, kind)
            self._actions.begin()
        return self._actions.missing()

    def _send_goal(self, link: Link) -> None:
        (x0, y0), (x, y) = self._way_m[[0, -1]].tolist()
        yaw = math.atan2(y - y0, x - x0)
        if self._actions is not None:
            self._actions.go(x=x, y=y, yaw=yaw, path=self._way_m.tolist())
        else:
            link.publish(_TOPIC, goal_pose(self._stamp(), (x, y), yaw))

    def _stamp(self) -> float:
        """Return the time on the clock of the topics: the computer's, and it never goes back."""
        self._link.latest_s = max(self._link.latest_s + 1e-3, time.time())
        return self._link.latest_s

    def _robots_publisher(self, stage: Stage, link: Link) -> Callable[[RobotState, float], None]:
        """Publish map and mounts; return what publishes the robot's state and scans."""
        specs = stage.scenario.scanners
        scene = ScanScene(stage.warehouse.layout, stage.warehouse.variant, stage.warehouse.actors)
        generators = np.random.default_rng([_STREAM, self._seed]).spawn(2 * len(specs))
        scanners = [SimulatedScanner(scene, s, g) for s, g in zip(specs, generators, strict=False)]
        clocks = [
            FrameClock(s.timing, g) for s, g in zip(specs, generators[len(specs) :], strict=True)
        ]
        mounts = {
            name: each.mounting.T_base_scanner
            for name, each in zip(self._scans, scanners, strict=False)
        }
        spec = stage.scenario.camera
        camera, renderer = spec.camera(spec.picture_scale), None
        if self._camera_hz:
            renderer = CoarseSceneryRenderer(stage.warehouse, spec.scenery_divisor)
            mounts[CAMERA] = np.linalg.inv(stage.amr.T_odom_base) @ stage.amr.T_odom_camera
        images = FrameClock(CameraTiming(rate_hz=self._camera_hz or None), np.random.default_rng(0))
        stamp_s = self._stamp()
        link.publish("map", map_message(stamp_s, *hall_grid(stage.warehouse)))
        link.publish("tf_static", static_transforms(stamp_s, mounts))

        def publish(known: RobotState, start_s: float) -> None:
            """Publish the state that the robot knows; its stamp counts from ``start_s``."""
            now_s = start_s + known.stamp_s
            stamped = replace(known, stamp_s=now_s)
            link.publish("tf", base_transform(stamped))
            due = [n for n, clock in enumerate(clocks) if clock.tick(now_s)[1] is not None]
            true = stage.amr.state(known.stamp_s)
            motion = motion_of(true)
            for number, scan in zip(due, scan_all([scanners[n] for n in due], motion), strict=True):
                period_s = 1.0 / (specs[number].timing.rate_hz or stage.scenario.control_hz)
                message = scan_message(scan, start_s, self._scans[number], period_s)
                link.publish(f"scan {number}", message)
            if renderer is not None and images.tick(now_s)[0]:
                rgb = renderer.render(camera, stage.amr.T_odom_camera).rgb
                image, about = picture_messages(now_s, CAMERA, camera, rgb)
                link.publish("image", image)
                link.publish("camera_info", about)
            link.publish("odom", odometry_of(stamped))
            # Last: what begins with the time finds the rest of it.
            link.publish("clock", Clock(to_time(now_s)))

        return publish
