"""The laser scanners of a robot in a crossing: simulated scans, and the people found in them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nav_adapter import RobotState
from perception.arrays import FloatArray
from perception.laser import (
    LaserScan,
    LegDetector,
    RobotMotion,
    StaticMap,
    observations_of,
    scan_points,
    sight_of,
)
from tracking import ScannerView, SensorConfig

from ...world import Warehouse
from ...world.camera import FrameClock, FrameQueue
from ...world.errors import SimError
from ...world.scanner import ScannerSpec, ScanScene, SimulatedScanner, scan_all
from .._messages import NOBODY, Delivery, MountedScan, Sighting
from ._sensor import MapView, Sensor, SensorSetup, World

# Random streams of scanners are separate from all others of an episode.
_STREAM: Final = 0x5CA7
# People farther away are not recognised in scans.
_RANGE_M: Final = 8.0
_MAP_RESOLUTION_M: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class _Taken:
    """A scan on its way: its scanner, and the robot's motion as known when it was taken."""

    scan: MountedScan
    number: int
    known: RobotMotion


class Scanners(Sensor, name="scanner"):
    """The laser scanners of a robot, and its leg detector; the robot knows the boxes of its hall.

    Each scanner is a sensor of its own for the tracker.

    Raises:
        SimError: for a scenario without scanners.
    """

    def __init__(self, setup: SensorSetup) -> None:
        self._stage = setup.stage
        warehouse, specs = setup.stage.warehouse, setup.stage.scenario.scanners
        if not specs:
            raise SimError(
                f"perception with 'scanner' needs laser scanners, but the scenario "
                f"{setup.stage.scenario.name!r} has none (scanners: [])"
            )
        body_base_m = setup.stage.amr.profile.footprint_m
        scene = ScanScene(warehouse.layout, warehouse.variant, warehouse.actors)
        generators = np.random.default_rng([_STREAM, setup.seed]).spawn(2 * len(specs))
        self._scanners = [
            SimulatedScanner(scene, spec, rng)
            for spec, rng in zip(specs, generators[::2], strict=True)
        ]
        self._clocks = [
            FrameClock(spec.timing, rng) for spec, rng in zip(specs, generators[1::2], strict=True)
        ]
        self._mountings = [spec.scanner(body_base_m) for spec in specs]
        self._views = [scanner_view(spec) for spec in specs]
        self._map_view = MapView.of(warehouse)
        self.tracked = {
            sensor_name(number): SensorConfig(view=replace(self._map_view, camera=view))
            for number, view in enumerate(self._views)
        }
        self._changes = [setup.faults.scans(n, spec, body_base_m) for n, spec in enumerate(specs)]
        self._queue: FrameQueue[_Taken] = FrameQueue()
        self._detector = LegDetector(static_map=map_of(warehouse))
        self._latest_s = [-math.inf] * len(specs)

    def look(self, world: World) -> tuple[Sighting, ...]:
        """Take the scans that are due; return those that have arrived by now, in that order."""
        now_s, amr = world.t_s, self._stage.amr
        ticks = [(number, *clock.tick(now_s)) for number, clock in enumerate(self._clocks)]
        due = [(number, arrives_s) for number, is_due, arrives_s in ticks if is_due]
        if due:
            motion, known = _motion(amr.T_odom_base, amr.state(now_s)), motion_of(world.known)
            # The noise of a lost scan is drawn, so that a loss changes no other scan.
            scans = scan_all([self._scanners[number] for number, _ in due], motion)
            for (number, arrives_s), scan in zip(due, scans, strict=True):
                if arrives_s is not None:
                    self._send(scan, arrives_s, number, motion, known)
        sightings = [
            self._sighting(taken) for taken in self._queue.take(now_s) if self._is_new(taken)
        ]
        return tuple(each for each in sightings if each is not None)

    def _send(
        self,
        scan: LaserScan,
        arrives_s: float,
        number: int,
        motion: RobotMotion,
        known: RobotMotion,
    ) -> None:
        """Send a scan on its way, unless a fault loses it."""
        message, change = MountedScan(scan, self._mountings[number]), self._changes[number]
        if change is not None:
            T_odom_scanner = motion.T_odom_base @ message.mounting.T_base_scanner
            changed = change(Delivery(message, motion.stamp_s, arrives_s, T_odom_scanner))
            if changed is None:
                return
            message, arrives_s = changed.message, changed.arrives_s
        self._queue.put(motion.stamp_s, arrives_s, _Taken(message, number, known))

    def _is_new(self, taken: _Taken) -> bool:
        """Return whether a scan is later than those before it; the detector needs their order."""
        end_s = taken.scan.scan.end_s
        if end_s <= self._latest_s[taken.number]:
            return False
        self._latest_s[taken.number] = end_s
        return True

    def _sighting(self, taken: _Taken) -> Sighting | None:
        """Return the people in a scan; None for a scan that shows nothing, as on a robot."""
        scan, mounting = taken.scan.scan, taken.scan.mounting
        points = scan_points(scan, mounting, taken.known)
        sight = sight_of(scan, mounting, points)
        if sight.nothing:
            return None
        found = self._detector.detect(points, taken.number)
        T_odom_scanner = taken.known.T_odom_base @ mounting.T_base_scanner
        return Sighting(
            points.stamp_s,
            T_odom_scanner,
            tuple((each, NOBODY) for each in observations_of(found, T_odom_scanner)),
            sensor=sensor_name(taken.number),
            points_odom_m=points.points_odom_m[points.usable, :2],
            view=replace(self._map_view, camera=replace(self._views[taken.number], points=points)),
            sight=sight,
        )


def sensor_name(number: int) -> str:
    """Return the tracker's name of a scanner, counted from 0."""
    return f"scanner_{number + 1}"


def scanner_view(spec: ScannerSpec) -> ScannerView:
    """Return the view of a scanner, of which the ranges are unknown."""
    low, high = np.radians(spec.field_of_view_deg).tolist()
    # The view is symmetrical about the scanner's x axis.
    field_rad = math.tau if high - low >= math.tau else max(2.0 * min(-low, high), 1e-3)
    return ScannerView(max_range_m=min(_RANGE_M, spec.range_max_m), field_rad=field_rad)


def _pose_of(state: RobotState) -> FloatArray:
    """Return the pose (4, 4) of the base frame of a robot whose state is known."""
    cos, sin = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
    T = np.eye(4)
    T[:2, :2] = [[cos, -sin], [sin, cos]]
    T[:2, 3] = state.position_odom_m
    return T


def motion_of(state: RobotState) -> RobotMotion:
    """Return the motion of a robot on the floor, from its state."""
    return _motion(_pose_of(state), state)


def _motion(T_odom_base: FloatArray, state: RobotState) -> RobotMotion:
    velocity = np.array([state.speed_mps, state.lateral_mps])
    return RobotMotion(state.stamp_s, T_odom_base, velocity, state.yaw_rate_radps)


def map_of(warehouse: Warehouse) -> StaticMap:
    """Return the map of a robot that knows the boxes of its hall."""
    return StaticMap(*hall_grid(warehouse))


def hall_grid(warehouse: Warehouse) -> tuple[NDArray[np.bool_], FloatArray, float]:
    """Return the cells (H, W) that boxes of the hall occupy, their corner (2,), and their side."""
    boxes = warehouse.obstacle_boxes_odom
    low = boxes[:, :2].min(axis=0) - 1.0
    columns, rows = (
        np.ceil((boxes[:, 2:].max(axis=0) + 1.0 - low) / _MAP_RESOLUTION_M).astype(int).tolist()
    )
    occupied = np.zeros((rows, columns), dtype=bool)
    for box in boxes:
        first = np.floor((box[:2] - low) / _MAP_RESOLUTION_M).astype(int)
        last = np.ceil((box[2:] - low) / _MAP_RESOLUTION_M).astype(int)
        occupied[first[1] : last[1], first[0] : last[0]] = True
    return occupied, low, _MAP_RESOLUTION_M
