"""The laser scanners of the bridge: from scan messages to the people in them, and to tracks."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray
from perception.laser import (
    CarriedThings,
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
from tracking import ScannerView

from .._errors import NavError
from ._robot_file import RobotFile, ScannerMount
from ._scans import ScanMessages, map_cells_of
from ._shared import Input, Shared
from .conversions import pose_matrix, yaw_quaternion
from .messages.geometry_msgs import Point
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
        carried_base_m: (K, 2) places of what the robot carries or pulls, in the base frame.
    """

    stamp_s: float
    T_odom_scanner: FloatArray
    sight: ScannerSight
    view: ScannerView
    observations: tuple[PersonObservation, ...]
    carried_base_m: FloatArray


class ScanPerception:
    """Finds people in the scans of all scanners. One thread at a time; others wait.

    Returns on the outline (M, 2) of the robot's body are dropped, and those on what it carries.
    """

    def __init__(
        self,
        body_base_m: FloatArray,
        inputs: tuple[ScannerInput, ...],
        make_detector: Callable[[], LegDetector],
    ) -> None:
        self.body_base_m, self._inputs = body_base_m, inputs
        self._detector = make_detector()
        nothing: tuple[float, tuple[PersonCandidate, ...]] = (-math.inf, ())
        self._found = [nothing] * len(inputs)
        self._carried = [CarriedThings() for _ in inputs]
        self._placed: tuple[MapCells, FloatArray, FloatArray] | None = None
        self._busy = threading.Lock()

    def process(
        self,
        number: int,
        scan: LaserScan,
        T_base_scanner: FloatArray,
        motion: RobotMotion,
        static_map: tuple[MapCells, FloatArray] | None = None,
    ) -> tuple[PerceivedScan, bool]:
        """Return the people in a scan, and whether it contradicts the map.

        The scan is later than the one of this scanner before. The map has its pose (4, 4) in odom.

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
        scanner = Scanner(T_base_scanner, limits, self.body_base_m)
        angles = scan.angles_rad[scanner.sees(scan)]
        if not len(angles):
            raise NavError(
                "the scanner's field of view must hold rays of its scans, got "
                f"{limits[0]:.2f} to {limits[1]:.2f} rad"
            )
        points = scan_points(scan, scanner, motion)
        carried = self._carried[number].note(scan, points, motion)
        own_base_m = self._carried[number].places_base_m(points, carried)
        if len(own_base_m):
            points = points.without(carried)
        low, high = float(angles.min()), float(angles.max())
        to_middle = pose_matrix(Point(), yaw_quaternion(0.5 * (low + high)))
        T_odom_scanner = motion.pose_at(points.stamp_s) @ T_base_scanner @ to_middle
        with self._busy:
            self._use_map(static_map, motion.T_odom_base[:2, 3])
            candidates = self._detector.detect(points, number)
            self._found[number] = points.stamp_s, candidates
            own = self._without_others_trolleys(number)
            contradicted = self._detector.map_contradicted
        field_rad = min(high - low + abs(scan.angle_increment_rad), 2.0 * math.pi)
        default = ScannerView()
        reach_m = min(default.max_range_m, scan.range_max_m)
        nearest_m = min(max(default.min_range_m, scan.range_min_m), reach_m)
        perceived = PerceivedScan(
            points.stamp_s,
            T_odom_scanner,
            sight_of(scan, scanner, points),
            ScannerView(reach_m, nearest_m, field_rad, points),
            observations_of(own, T_odom_scanner),
            own_base_m,
        )
        return perceived, contradicted

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


class MapInput:
    """The map of what stands still, and whether scans agree with it; each change is reported."""

    def __init__(self, shared: Shared, odom_frame: str) -> None:
        self._shared, self._odom_frame = shared, odom_frame
        self._cells: MapCells | None = None
        self._said = ""
        self._contradicted_s = -math.inf

    def set(self, message: OccupancyGrid | MapCells) -> None:
        """Use a map, a message or from a file, from now on.

        Raises:
            NavError: for a map that cannot be used.
        """
        cells = message if isinstance(message, MapCells) else map_cells_of(message)
        with self._shared.lock:
            self._cells, self._said = cells, ""

    def in_odom(self, stamp_s: float) -> tuple[MapCells, FloatArray] | None:
        """Return the map and its pose, or None without a map, or while its pose is unknown."""
        cells = self._cells
        if cells is None:
            return None
        try:
            T = self._shared.poses.transforms.lookup(self._odom_frame, cells.frame_id, stamp_s)
        except NavError as problem:
            self._say("the map is not used", f": {problem}")
            return None
        return cells, T

    def judge(self, contradicted: bool, stamp_s: float) -> None:
        """Note whether a scan contradicts the map; then others must agree for 2 s."""
        if contradicted:
            self._contradicted_s = stamp_s
        if 0.0 <= stamp_s - self._contradicted_s <= _AGREES_AFTER_S:
            more = ", so the robot is elsewhere than localisation says; it is used for no such scan"
            self._say("the scans contradict the map", more)
        else:
            self._say("the map is used")

    def _say(self, text: str, more: str = "") -> None:
        if text != self._said:
            self._said = text
            self._shared.warn(text + more)


class ScanInput(Input):
    """A laser scanner of the bridge: from its scans to tracks.

    After a scan that cannot be used, the next one is read as if it had not come. So it is, but for
    its stamp, after one that shows nothing: the scanner is blind.
    """

    def __init__(
        self,
        shared: Shared,
        number: int,
        scanner: ScannerInput,
        perception: ScanPerception,
        static_map: MapInput,
    ) -> None:
        super().__init__(shared, f"{scanner.name}: scan")
        self._number, self._mount, self._name = number, scanner.mount, scanner.name
        self._carries = False
        self._perception, self._map = perception, static_map
        self._messages = ScanMessages(scanner.name, shared.warn)
        self._last_s = -math.inf

    def forget(self) -> None:
        super().forget()
        self._last_s, self._last = -math.inf, LastFrames()

    def _use(self, message: LaserScanMessage, now_s: float) -> bool:
        shared, scan = self._shared, self._messages.read(message, now_s)
        middle_s = 0.5 * (scan.stamp_s + scan.end_s)
        with shared.lock:
            shared.clock.check("scans", middle_s, now_s, "the scan's")
            if (late_s := self._last_s - scan.stamp_s) >= 0.0:
                raise NavError(f"the scan's stamp is {late_s:.3f} s before that of the last one")
            is_current, mount = shared.still_current(), self._mount
            if mount is None:
                T_base_scanner = shared.poses.in_base(message.header.frame_id, scan.stamp_s)
            else:
                T_base_scanner = mount.T_base_scanner()
            motion = shared.poses.motion(scan.stamp_s, scan.end_s)
            spread = shared.poses.spread(middle_s)
            static_map = self._map.in_odom(scan.stamp_s)
            if scan.repeats(self._last, motion.T_odom_base):
                raise NavError(
                    "all ranges are those of a scan before the robot moved, so the scanner is "
                    "frozen"
                )
        seen, contradicted = self._perception.process(
            *(self._number, scan, T_base_scanner, motion, static_map)
        )
        if static_map is not None:
            self._map.judge(contradicted, seen.stamp_s)
        if len(seen.carried_base_m) and not self._carries:
            places = ", ".join(f"({x:.2f}, {y:.2f})" for x, y in seen.carried_base_m.tolist())
            shared.warn(
                f"{self._name}: what is at {places} m in the base frame keeps its place there "
                "while the robot moves, as a cart or a load does. It is nobody, but the robot is "
                "now larger than its footprint: give footprint_m with it"
            )
        self._carries |= len(seen.carried_base_m) > 0
        if not seen.sight.nothing:
            tracks = shared.tracker.update(
                *(seen.observations, seen.stamp_s, seen.T_odom_scanner, is_current, spread),
                scanner=self._number,
                view=seen.view,
            )
            if tracks is None:
                return False
        with shared.lock:
            if not is_current():
                return False
            self._last_s = scan.stamp_s
            shared.watch.saw_scan(self._number, seen.stamp_s, seen.sight)
            self.used += not seen.sight.nothing
        return not seen.sight.nothing
