"""The laser scanners of the bridge: from scan messages to the people in them, and to tracks."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception import PerceptionError, PersonObservation
from perception.arrays import FloatArray
from perception.laser import (
    LaserScan,
    LegDetector,
    MapCells,
    PersonCandidate,
    RobotMotion,
    Scanner,
    ScannerSight,
    merge_candidates,
    observations_of,
    scan_points,
    sight_of,
)
from perception.no_view import LastFrames
from tracking import ScannerView, TrackingError

from .._errors import NavError
from ._robot_file import RobotFile, ScannerMount
from ._scans import ScanMessages, map_cells_of
from ._shared import Refusals, Shared
from .messages.nav_msgs import OccupancyGrid
from .messages.sensor_msgs import LaserScan as LaserScanMessage

# Scans of two scanners this near in time show the same legs and trolleys.
_TOGETHER_S: Final = 0.1
_MAX_TILT_RAD: Final = math.radians(10.0)
# A part of the map of this half side is kept in odom. It is placed anew when the robot has left the
# middle by this, or the map has moved in odom by this much.
_MAP_REACH_M: Final = 30.0
_MAP_LEFT_M: Final = 10.0
_MAP_MOVED_M: Final = 0.03
_MAP_TURNED_RAD: Final = math.radians(0.2)
# Scans agree with the map again when they have done so for this time.
_AGREES_AFTER_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class ScannerInput:
    """One laser scanner of the bridge.

    Attributes:
        name: in messages, for example that of its topic.
        mount: its place on the robot; None to read it from tf.
    """

    name: str
    mount: ScannerMount | None = None


def scanner_inputs(names: Sequence[str], robot: RobotFile) -> tuple[ScannerInput, ...]:
    """Return the scanners of these names, with the mounts in the robot file, in its order.

    Raises:
        NavError: for a robot file with another number of scanners.
    """
    if robot.scanners is None or not names:
        return tuple(ScannerInput(name) for name in names)
    if len(robot.scanners) != len(names):
        raise NavError(
            f"the robot file must have as many scanners as there are scan topics, {len(names)}, or "
            f"none to read their places from tf, got {len(robot.scanners)}"
        )
    mounts = zip(names, robot.scanners, strict=True)
    return tuple(ScannerInput(name, mount) for name, mount in mounts)


@dataclass(frozen=True, slots=True, eq=False)
class PerceivedScan:
    """One scan: the people in it, and where it could have shown some.

    Attributes:
        stamp_s: of the middle of the scan.
        T_odom_scanner: (4, 4) pose at that time of the scanner's frame, turned about its z axis so
            that x points to the middle of the rays.
        sight: where the scan shows what is there.
        view: of the scan in that frame.
        observations: of the people, in that frame.
    """

    stamp_s: float
    T_odom_scanner: FloatArray
    sight: ScannerSight
    view: ScannerView
    observations: tuple[PersonObservation, ...]


class ScanPerception:
    """Finds people in the scans of all scanners. One thread at a time; others wait.

    Args:
        body_base_m: (M, 2) outline of the robot; returns on it are dropped.
        inputs: the scanners.
        make_detector: makes the detector that all share.
    """

    def __init__(
        self,
        body_base_m: FloatArray,
        inputs: tuple[ScannerInput, ...],
        make_detector: Callable[[], LegDetector] = LegDetector,
    ) -> None:
        self._body_base_m, self._inputs = body_base_m, inputs
        self._detector = make_detector()
        self._found: list[tuple[float, tuple[PersonCandidate, ...]]] = [(-math.inf, ())] * len(
            inputs
        )
        self._placed: tuple[MapCells, FloatArray, FloatArray] | None = None
        self._busy = threading.Lock()

    @property
    def map_contradicted(self) -> bool:
        """Whether the latest scan contradicts the map."""
        return self._detector.map_contradicted

    def process(
        self,
        number: int,
        scan: LaserScan,
        T_base_scanner: FloatArray,
        motion: RobotMotion,
        static_map: tuple[MapCells, FloatArray] | None = None,
    ) -> PerceivedScan:
        """Return the people in a scan.

        Args:
            number: of the scanner.
            scan: of this scanner, later than the one before.
            T_base_scanner: (4, 4) pose of the scanner.
            motion: of the robot during the scan.
            static_map: what stands still, and the pose (4, 4) of the map in odom.

        Raises:
            NavError: for a scanner that is not level, or a field of view without rays.
        """
        if abs(T_base_scanner[2, 2]) < math.cos(_MAX_TILT_RAD):
            tilt_deg = math.degrees(math.acos(min(1.0, abs(T_base_scanner[2, 2]))))
            raise NavError(
                "the scan plane must be level within "
                f"{math.degrees(_MAX_TILT_RAD):g} degrees, got a tilt of {tilt_deg:.1f}"
            )
        mount = self._inputs[number].mount
        limits = (-2.0 * math.pi, 2.0 * math.pi) if mount is None else mount.field_of_view_rad
        scanner = Scanner(T_base_scanner, limits, self._body_base_m)
        angles = scan.angles_rad[scanner.sees(scan)]
        if not len(angles):
            raise NavError(
                "the scanner's field of view must hold rays of its scans, got "
                f"{limits[0]:.2f} to {limits[1]:.2f} rad"
            )
        points = scan_points(scan, scanner, motion)
        low, high = float(angles.min()), float(angles.max())
        turned = _turned_about_z(T_base_scanner, 0.5 * (low + high))
        T_odom_scanner = motion.pose_at(points.stamp_s) @ turned
        with self._busy:
            self._use_map(static_map, motion.T_odom_base[:2, 3])
            candidates = self._detector.detect(points, number)
            self._found[number] = points.stamp_s, candidates
            own = self._without_others_trolleys(number)
        field_rad = min(high - low + abs(scan.angle_increment_rad), 2.0 * math.pi)
        default = ScannerView()
        reach_m = min(default.max_range_m, scan.range_max_m)
        nearest_m = min(max(default.min_range_m, scan.range_min_m), reach_m)
        return PerceivedScan(
            points.stamp_s,
            T_odom_scanner,
            sight_of(scan, scanner, points),
            ScannerView(reach_m, nearest_m, field_rad, points),
            observations_of(own, T_odom_scanner),
        )

    def _without_others_trolleys(self, number: int) -> tuple[PersonCandidate, ...]:
        """Return a scanner's candidates but for trolleys of people whom another one sees.

        Each scanner is a sensor of its own to the tracker, which matches people by their places;
        the trolley that somebody pushes is at another place than their legs.
        """
        stamp_s, own = self._found[number]
        legs = [
            [each for each in group if each.kind != "trolley"]
            for other, (other_s, group) in enumerate(self._found)
            if other != number and abs(other_s - stamp_s) <= _TOGETHER_S
        ]
        alone = len(merge_candidates(legs))
        return tuple(
            each
            for each in own
            if each.kind != "trolley" or len(merge_candidates([[each], *legs])) > alone
        )

    def _use_map(self, given: tuple[MapCells, FloatArray] | None, robot_odom_m: FloatArray) -> None:
        """Place the map in odom, if it or the robot has moved."""
        if given is None:
            self._detector.static_map = self._placed = None
            return
        cells, T = given
        if self._placed is not None and self._placed[0] is cells:
            _, before, centre = self._placed
            moved = before @ np.linalg.inv(T)  # of a point in odom that is fixed in the map
            place = moved[:2, :2] @ robot_odom_m + moved[:2, 3]
            turned_rad = abs(math.atan2(moved[1, 0], moved[0, 0]))
            still = np.hypot(*(place - robot_odom_m)) < _MAP_MOVED_M
            inside = np.abs(robot_odom_m - centre).max() < _MAP_LEFT_M
            if still and inside and turned_rad < _MAP_TURNED_RAD:
                return
        self._detector.static_map = cells.near(T, robot_odom_m, _MAP_REACH_M)
        self._placed = cells, T, np.array(robot_odom_m)


def _turned_about_z(T: FloatArray, angle_rad: float) -> FloatArray:
    turn = np.eye(4)
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    return np.asarray(T @ turn)


class ScanInput:
    """The bridge's laser scanners: from their scans to tracks.

    A scan that cannot be used is refused, counted and reported; the next one is read as if it had
    not come. So it is, but for its stamp, with a scan that shows nothing: its scanner is blind.

    Args:
        shared: by the bridge's inputs.
        inputs: the scanners.
        perception: finds the people.
        odom_frame: name of the fixed frame.
    """

    def __init__(
        self,
        shared: Shared,
        inputs: tuple[ScannerInput, ...],
        perception: ScanPerception,
        odom_frame: str,
    ) -> None:
        self._shared, self._inputs, self._perception = shared, inputs, perception
        self._odom_frame = odom_frame
        self._last_s = [-math.inf] * len(inputs)
        self._frames = [LastFrames() for _ in inputs]
        self._messages = [ScanMessages(each.name, shared.warn) for each in inputs]
        self._refusals = [Refusals(shared, f"{each.name}: scan") for each in inputs]
        self._map: MapCells | None = None
        # What was said of it last: each change is reported once.
        self._map_said = ""
        self._contradicted_s = -math.inf
        self._read = self._dropped = 0

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of scans that were used, refused, and dropped because the computer was busy."""
        return {
            "scans": self._read,
            "scans_refused": sum(each.count for each in self._refusals),
            "scans_dropped": self._dropped,
            "frames_refused_by_tracker": self._shared.tracker.refused_frames,
        }

    def read(self, number: int, message: LaserScanMessage, now_s: float) -> bool:
        """Process one scan; return True if it was used.

        Raises:
            NavError: for a number that no scanner has.
        """
        if not 0 <= number < len(self._inputs):
            raise NavError(
                f"number must be that of a scanner, 0 to {len(self._inputs) - 1}, got {number}"
            )
        try:
            used = self._process(number, message, now_s)
        except (NavError, PerceptionError, TrackingError) as problem:
            self.refuse(number, str(problem), now_s)
            return False
        return used

    def refuse(self, number: int, problem: str, now_s: float) -> None:
        """Count a scan that cannot be used, and report it if none of its scanner was lately."""
        self._refusals[number].add(problem, now_s)

    def dropped(self) -> None:
        """Count a scan that was dropped."""
        with self._shared.lock:
            self._dropped += 1

    def set_map(self, message: OccupancyGrid | MapCells) -> None:
        """Use a map of what stands still, a message or from a file, from now on.

        Raises:
            NavError: for a map that cannot be used.
        """
        cells = message if isinstance(message, MapCells) else map_cells_of(message)
        with self._shared.lock:
            self._map, self._map_said = cells, ""

    def forget(self) -> None:
        """Forget the stamps of earlier scans, and the scans."""
        self._last_s = [-math.inf] * len(self._inputs)
        self._frames = [LastFrames() for _ in self._inputs]
        for each in self._refusals:
            each.forget()

    def _process(self, number: int, message: LaserScanMessage, now_s: float) -> bool:
        scan = self._messages[number].read(message, now_s)
        middle_s = 0.5 * (scan.stamp_s + scan.end_s)
        with self._shared.lock:
            self._shared.clock.check("scans", middle_s, now_s, "the scan's")
            last_s = self._last_s[number]
            if scan.stamp_s <= last_s:
                raise NavError(
                    f"the scan's stamp is {last_s - scan.stamp_s:.3f} s before that of the last one"
                )
            restarts = self._shared.clock.restarts
            mount = self._inputs[number].mount
            if mount is None:
                T_base_scanner = self._shared.poses.in_base(message.header.frame_id, scan.stamp_s)
            else:
                T_base_scanner = mount.T_base_scanner()
            motion = self._shared.poses.motion(scan.stamp_s, scan.end_s)
            static_map = self._map_in_odom(scan.stamp_s)
            spread = self._shared.poses.spread(middle_s)
            if scan.repeats(self._frames[number], motion.T_odom_base):
                raise NavError(
                    "all ranges are those of a scan before the robot moved, so the scanner is "
                    "frozen"
                )
        seen = self._perception.process(number, scan, T_base_scanner, motion, static_map)
        if static_map is not None:
            self._judge_map(seen.stamp_s)
        if seen.sight.nothing:
            with self._shared.lock:
                if self._shared.clock.restarts == restarts:
                    self._last_s[number] = scan.stamp_s
                    self._shared.watch.saw_scan(number, seen.stamp_s, seen.sight)
            return False
        tracks = self._shared.tracker.update(
            seen.observations,
            seen.stamp_s,
            seen.T_odom_scanner,
            lambda: self._shared.clock.restarts == restarts,
            spread,
            scanner=number,
            view=seen.view,
        )
        with self._shared.lock:
            if tracks is None or self._shared.clock.restarts != restarts:
                return False
            self._last_s[number] = scan.stamp_s
            self._shared.watch.saw_scan(number, seen.stamp_s, seen.sight)
            self._read += 1
        return True

    def _map_in_odom(self, stamp_s: float) -> tuple[MapCells, FloatArray] | None:
        """Return the map and its pose, or None without a map, or while its pose is unknown."""
        if self._map is None:
            return None
        try:
            T = self._shared.poses.transforms.lookup(self._odom_frame, self._map.frame_id, stamp_s)
        except NavError as problem:
            self._say_of_map("the map is not used", f": {problem}")
            return None
        return self._map, T

    def _judge_map(self, stamp_s: float) -> None:
        """Report whether the scans agree with the map; after a contradiction they must for 2 s."""
        if self._perception.map_contradicted:
            self._contradicted_s = stamp_s
        if 0.0 <= stamp_s - self._contradicted_s <= _AGREES_AFTER_S:
            more = ", so the robot is elsewhere than localisation says; it is used for no such scan"
            self._say_of_map("the scans contradict the map", more)
        else:
            self._say_of_map("the map is used")

    def _say_of_map(self, text: str, more: str = "") -> None:
        if text != self._map_said:
            self._map_said = text
            self._shared.warn(text + more)
