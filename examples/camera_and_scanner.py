"""A camera ahead and a laser scanner all around, in a loop of your own, without ROS.

Run it with ``python examples/camera_and_scanner.py``. A robot drives along a hall. A person ahead
looks at it, then is passed and leaves the camera's picture; the scanner keeps them. Somebody else
stands where only the scanner looks. Then the camera fails: everybody counts as unaware, and the
scanner goes on. Your images and scans replace the scripts at the end.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from perception import Camera, PersonObservation
from perception.arrays import FloatArray
from perception.laser import (
    LaserScan,
    LegDetector,
    RobotMotion,
    Scanner,
    SeenDirections,
    observations_of,
    scan_points,
    sight_of,
)
from tracking import CameraView, PersonTracker, ScannerView, SensorConfig, TrackerConfig

FOOTPRINT_M = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
CAMERA = Camera.from_fov(640, 480, math.radians(120.0))
# The camera 1.4 m above the base, looking ahead: optical axes in the base frame as columns.
T_BASE_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.2], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.4], [0.0, 0.0, 0.0, 1.0]]
)
# A scanner on a corner of the robot sees 270°; returns on the robot's own body are dropped.
SCANNER = Scanner.mounted(0.36, 0.25, 0.2, math.radians(45.0), body_base_m=FOOTPRINT_M)
SCANNER_VIEW = ScannerView(field_rad=math.radians(270.0))
# Half the field of the camera: while it is lost, scans must show all of that.
AHEAD_RAD = math.radians(60.0)
SPEED_MPS = 0.8
PERIOD_S = 0.04
CAMERA_FAILS_S = 6.0


class People:
    """Camera, scanner, tracker and adapter of one robot."""

    def __init__(self) -> None:
        self.robot = RobotProfile(
            footprint_m=FOOTPRINT_M,
            max_speed_mps=1.5,
            max_acceleration_mps2=1.0,
            max_deceleration_mps2=1.0,
            reaction_time_s=0.3,
        )
        policy = AwarenessPolicy.preset("balanced")
        self.detector = LegDetector()
        self.tracker = PersonTracker(
            TrackerConfig.for_policy(policy),
            view=CameraView(CAMERA),
            sensors={"laser": SensorConfig(view=SCANNER_VIEW)},
        )
        self.adapter = NavAdapter(policy, self.robot)
        self.tracks = self.tracker.predict(0.0)
        self.imaged_s, self.scanned = -math.inf, SeenDirections()

    def see_image(
        self, people: tuple[PersonObservation, ...], stamp_s: float, T_odom_base: FloatArray
    ) -> None:
        """Take the people of an image: those of ``AwarenessPipeline(CAMERA).process``."""
        self.tracks = self.tracker.update(people, stamp_s, T_odom_base @ T_BASE_CAMERA)
        self.imaged_s = stamp_s

    def see_scan(self, scan: LaserScan, motion: RobotMotion) -> None:
        """Find the people in a scan, and take them."""
        points = scan_points(scan, SCANNER, motion)
        sight = sight_of(scan, SCANNER, points)
        self.scanned.note(sight, points.stamp_s)
        if sight.nothing:  # a scanner that is blind is as good as silent
            print(f"{scan.stamp_s:4.1f} s  the scanner is {sight.blind_text}")
            return
        T_odom_scanner = motion.pose_at(points.stamp_s) @ SCANNER.T_base_scanner
        people = observations_of(self.detector.detect(points), T_odom_scanner)
        # People are gone only from places that the rays of this scan have passed.
        view = replace(SCANNER_VIEW, points=points)
        self.tracks = self.tracker.update(
            people, points.stamp_s, T_odom_scanner, sensor="laser", view=view
        )

    def constraints(self, state: RobotState) -> NavConstraints:
        """Return the planner's input."""
        scanned_s = self.scanned.stamp_s(0.0, AHEAD_RAD)
        seen_s = self.imaged_s if scanned_s is None else max(self.imaged_s, scanned_s)
        return self.adapter.update(self.tracks, state, state.stamp_s, perception_stamp_s=seen_s)


def main() -> None:
    """Print the planner's input every half second."""
    people = People()
    rng = np.random.default_rng(0)
    T_odom_base, speed_mps = np.eye(4), 0.0
    for tick in range(251):
        now_s = PERIOD_S * tick
        T_odom_base[0, 3] += PERIOD_S * speed_mps
        if tick % 2 == 0 and now_s < CAMERA_FAILS_S:
            people.see_image(imaged(now_s, T_odom_base), now_s, T_odom_base)
        motion = RobotMotion(now_s, T_odom_base, np.array([speed_mps, 0.0]))
        people.see_scan(scanned(now_s, motion, rng), motion)
        state = RobotState(now_s, T_odom_base[:2, 3], 0.0, speed_mps, 0.0)
        constraints = people.constraints(state)
        # Your planner goes here. This one drives straight on, and obeys the limit.
        change_mps = PERIOD_S * people.robot.max_acceleration_mps2
        wanted_mps = min(SPEED_MPS, constraints.speed_limit_mps)
        speed_mps += min(max(wanted_mps - speed_mps, -change_mps), change_mps)
        if tick % 12:
            continue
        silent = [name for name, age_s in people.tracker.silences_s.items() if age_s > 0.5]
        print(
            f"{now_s:4.1f} s  robot at {T_odom_base[0, 3]:4.2f} m, limit "
            f"{constraints.speed_limit_mps:4.2f} m/s"
            + "".join(f"  {name} is silent" for name in silent)
        )
        for each in constraints.obstacles:
            x, y = each.center_odom_m
            print(
                f"        person {each.track_id} at ({x:5.2f}, {y:5.2f}) m, radius "
                f"{each.radius_m:4.2f} m, aware at least {each.awareness_lower:4.2f}"
            )


# The scene: two people who stand, in a hall of 16 m × 8 m.
WATCHER_M, BESIDE_M = np.array([4.0, 1.9]), np.array([-0.6, 2.2])
HALL_M = np.array([-4.0, -4.0, 12.0, 4.0])


def imaged(stamp_s: float, T_odom_base: FloatArray) -> tuple[PersonObservation, ...]:
    """Return the people in one image: somebody who looks at the robot, if in the picture."""
    place = np.linalg.inv(T_odom_base @ T_BASE_CAMERA) @ [*WATCHER_M, 1.3, 1.0]
    if place[2] < 0.5 or abs(place[0]) > 1.7 * place[2]:
        return ()
    return (
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=place[:3],
            position_covariance_m2=np.diag([0.05, 0.05, 0.15]) ** 2,
            gaze_camera=None,
            awareness=0.9,
            awareness_std=0.05,
            score=0.9,
        ),
    )


def scanned(stamp_s: float, motion: RobotMotion, rng: np.random.Generator) -> LaserScan:
    """Return one scan of the hall and of four legs: ``sensor_msgs/LaserScan`` on a robot."""
    angles = math.radians(-135.0) + math.radians(0.5) * np.arange(541)
    T = motion.T_odom_base @ SCANNER.T_base_scanner
    rays = np.column_stack((np.cos(angles), np.sin(angles))) @ T[:2, :2].T
    ranges = (np.where(rays > 0.0, HALL_M[2:], HALL_M[:2]) - T[:2, 3]) / rays
    nearest = ranges.min(axis=1)
    for person in (WATCHER_M, BESIDE_M):
        for side_m in (-0.11, 0.11):
            to = person + np.array([0.0, side_m]) - T[:2, 3]
            along = rays @ to
            inside = along**2 - to @ to + 0.06**2
            hit = (inside >= 0.0) & (along > 0.0)
            nearest = np.where(hit, along - np.sqrt(np.maximum(inside, 0.0)), nearest)
    nearest = nearest + rng.normal(0.0, 0.01, len(nearest))
    return LaserScan(stamp_s, float(angles[0]), math.radians(0.5), nearest, 0.05, 20.0)


if __name__ == "__main__":
    main()
