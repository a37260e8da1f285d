"""Scan messages of the bridge: checked, placed and passed on to the tracker."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Final

import numpy as np

from perception import PerceptionError
from perception.arrays import FloatArray
from perception.laser import LaserScan, MapCells
from tracking import TrackingError

from .._errors import NavError
from ._clock import BridgeClock
from ._poses import RobotPoses
from ._scan_perception import ScannerInput, ScanPerception
from ._scans import ScanMessages, map_cells_of
from ._sensor_watch import SensorWatch
from ._shared_tracker import SharedTracker
from .messages.nav_msgs import OccupancyGrid
from .messages.sensor_msgs import LaserScan as LaserScanMessage

# A scanner whose scans are refused is reported again after this time.
_WARN_AGAIN_S: Final = 10.0
# A robot that has moved so far sees other ranges than before.
_MOVED_M: Final = 0.05
_TURNED_RAD: Final = math.radians(2.0)


class ScanReader:
    """Turns the scans of the robot's scanners into frames of the tracker.

    A scan that cannot be used is refused, counted and reported; the next one is read as if it had
    not come. So it is, but for its stamp, with a scan that shows nothing: its scanner is blind.

    Args:
        inputs: the scanners.
        perception: finds the people.
        tracker: takes them.
        poses: of the robot; used under the lock.
        clock: of the bridge; used under the lock.
        watch: of the sensors; used under the lock.
        lock: guards what is shared with other threads.
        warn: called with each problem.
        odom_frame: name of the fixed frame.
    """

    def __init__(
        self,
        inputs: tuple[ScannerInput, ...],
        perception: ScanPerception,
        tracker: SharedTracker,
        poses: RobotPoses,
        clock: BridgeClock,
        watch: SensorWatch,
        lock: threading.RLock,
        warn: Callable[[str], object],
        odom_frame: str,
    ) -> None:
        self._inputs, self._perception, self._tracker = inputs, perception, tracker
        self._poses, self._clock, self._watch = poses, clock, watch
        self._lock, self._warn, self._odom_frame = lock, warn, odom_frame
        self._last_s = [-math.inf] * len(inputs)
        self._warned_s = [-math.inf] * len(inputs)
        # The first of the scans that are equal, and the robot's pose then.
        self._repeated: list[tuple[LaserScan, FloatArray] | None] = [None] * len(inputs)
        self._messages = [ScanMessages(each.name, warn) for each in inputs]
        self._map: MapCells | None = None
        # None until the first scan after a new map; each change is reported once.
        self._map_used: bool | None = None
        self._read = self._refused = self._dropped = 0

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of scans that were used, refused, and dropped because the computer was busy."""
        return {
            "scans": self._read,
            "scans_refused": self._refused,
            "scans_dropped": self._dropped,
            "frames_refused_by_tracker": self._tracker.refused_frames,
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
        with self._lock:
            self._refused += 1
            since_s = now_s - self._warned_s[number]
            if 0.0 <= since_s < _WARN_AGAIN_S:
                return
            self._warned_s[number] = now_s
        self._warn(f"{self._inputs[number].name}: scan refused and counted: {problem}")

    def dropped(self) -> None:
        """Count a scan that was dropped."""
        with self._lock:
            self._dropped += 1

    def set_map(self, message: OccupancyGrid | MapCells) -> None:
        """Use a map of what stands still, a message or from a file, from now on.

        Raises:
            NavError: for a map that cannot be used.
        """
        cells = message if isinstance(message, MapCells) else map_cells_of(message)
        with self._lock:
            self._map, self._map_used = cells, None

    def forget(self) -> None:
        """Forget the stamps of earlier scans, and the scans."""
        self._last_s = [-math.inf] * len(self._inputs)
        self._repeated = [None] * len(self._inputs)
        self._warned_s = [-math.inf] * len(self._inputs)

    def _process(self, number: int, message: LaserScanMessage, now_s: float) -> bool:
        scan = self._messages[number].read(message, now_s)
        middle_s = 0.5 * (scan.stamp_s + scan.end_s)
        with self._lock:
            refusal = self._clock.refusal("scans", middle_s, now_s)
            if refusal is not None:
                raise NavError(f"the scan's {refusal}")
            last_s = self._last_s[number]
            if scan.stamp_s <= last_s:
                raise NavError(
                    f"the scan's stamp is {last_s - scan.stamp_s:.3f} s before that of the last one"
                )
            restarts = self._clock.restarts
            mount = self._inputs[number].mount
            if mount is None:
                T_base_scanner = self._poses.in_base(message.header.frame_id, scan.stamp_s)
            else:
                T_base_scanner = mount.T_base_scanner()
            motion = self._poses.motion(scan.stamp_s, scan.end_s)
            static_map = self._map_in_odom(scan.stamp_s)
            self._require_live(number, scan, motion.T_odom_base)
        seen = self._perception.process(number, scan, T_base_scanner, motion, static_map)
        if seen.sight.nothing:
            with self._lock:
                if self._clock.restarts == restarts:
                    self._last_s[number] = scan.stamp_s
                    self._watch.saw_scan(number, seen.stamp_s, seen.sight)
            return False
        tracks = self._tracker.update(
            seen.observations,
            seen.stamp_s,
            seen.T_odom_scanner,
            lambda: self._clock.restarts == restarts,
            scanner=number,
            view=seen.view,
        )
        with self._lock:
            if tracks is None or self._clock.restarts != restarts:
                return False
            self._last_s[number] = scan.stamp_s
            self._watch.saw_scan(number, seen.stamp_s, seen.sight)
            self._read += 1
        return True

    def _require_live(self, number: int, scan: LaserScan, T_odom_base: FloatArray) -> None:
        """Refuse a scan that repeats those before it although the robot has moved.

        While it stands, a scanner without noise, as in a simulator, repeats itself as well.
        """
        since = self._repeated[number]
        if since is None or not scan.repeats(since[0]):
            self._repeated[number] = scan, T_odom_base
            return
        step = np.linalg.inv(since[1]) @ T_odom_base
        moved_m, turned_rad = math.hypot(*step[:2, 3]), abs(math.atan2(step[1, 0], step[0, 0]))
        if moved_m > _MOVED_M or turned_rad > _TURNED_RAD:
            raise NavError(
                "all ranges are those of scans before the robot moved, so the scanner is frozen"
            )

    def _map_in_odom(self, stamp_s: float) -> tuple[MapCells, FloatArray] | None:
        """Return the map and its pose, or None without a map, or while its pose is unknown."""
        if self._map is None:
            return None
        try:
            T = self._poses.transforms.lookup(self._odom_frame, self._map.frame_id, stamp_s)
        except NavError as problem:
            if self._map_used is not False:
                self._warn(f"the map is not used: {problem}")
            self._map_used = False
            return None
        if self._map_used is not True:
            self._warn("the map is used")
        self._map_used = True
        return self._map, T
