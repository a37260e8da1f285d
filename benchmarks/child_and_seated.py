"""A child and somebody seated: ``python -m benchmarks.child_and_seated``.

A robot with a camera ahead and two diagonal scanners stands, or drives past at 1 m/s. Keypoints of
the body pass through the awareness pipeline, scans through the leg detector, both to one tracker.
The figures are the frames with exactly one track and the errors of its place, with the camera
alone, the scanners alone, and both.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np

from perception import AwarenessPipeline, Camera, PersonObservation
from perception.arrays import FloatArray
from perception.laser import (
    LegClassifier,
    LegDetector,
    OnnxLegClassifier,
    PersonCandidate,
    RobotMotion,
    SeatedPeople,
    merge_candidates,
    scan_points,
)
from sim_tests.actors.body import SeatKind, Worker
from sim_tests.actors.robot import Amr, AmrLook
from sim_tests.crossing.eyes import KeypointCamera, KeypointNoise
from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScanScene, SimulatedScanner
from sim_tests.world.sightlines import SightLines
from tracking import CameraView, PersonTrack, PersonTracker, ScannerView, SensorConfig

Sensors = Literal["camera", "scanner", "both"]
#: Time after which there has to be one track.
SETTLED_S: Final = 1.0

_SCAN_HZ: Final = 25.0
_SCANS_PER_IMAGE: Final = 2
_DRIVE_MPS: Final = 1.0
_CHEST_M: Final = 1.3
_LASER: Final = "laser"


@dataclass(frozen=True, slots=True)
class Case:
    """Somebody whom a robot meets.

    Attributes:
        name: of the case.
        stature_m: standing height.
        look: worker; those of the figures are in no training scan.
        position_m: (x, y) at the start; the robot starts at the origin and looks along x.
        heading_deg: of the body; −180 faces the robot.
        activity: of the body.
        seat: under somebody seated.
        speed_mps: of a straight walk.
        drives: the robot drives along x at 1 m/s.
        duration_s: simulated time.
        seed: of all noise.
    """

    name: str
    stature_m: float
    look: str
    position_m: tuple[float, float]
    heading_deg: float
    activity: str = "none"
    seat: SeatKind = "stool"
    speed_mps: float = 0.0
    drives: bool = False
    duration_s: float = 5.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Sample:
    """The tracks at one instant.

    Attributes:
        stamp_s: the instant.
        truth_m: (2,) place of the body.
        tracks: all tracks.
        in_view: whether the camera saw the body in its last image.
    """

    stamp_s: float
    truth_m: FloatArray
    tracks: tuple[PersonTrack, ...]
    in_view: bool

    @property
    def sure(self) -> list[PersonTrack]:
        """The tracks that are not tentative."""
        return [track for track in self.tracks if track.status != "tentative"]

    @property
    def error_m(self) -> float:
        """Distance from the body to the nearest sure track; inf without one."""
        return min(
            (float(np.linalg.norm(t.position_odom_m - self.truth_m)) for t in self.sure),
            default=math.inf,
        )


def encounter(
    case: Case, sensors: Sensors = "both", classifier: LegClassifier | None = None
) -> Iterator[Sample]:
    """Simulate a case, and yield the tracks after every scan."""
    rng = np.random.default_rng([case.seed, 21])
    layout = WarehouseLayout.named("open")
    with Warehouse(layout) as warehouse:
        worker = Worker(warehouse, case.stature_m, look=case.look, seat=case.seat)
        amr = Amr(warehouse)
        pose = [np.eye(4)]
        warehouse.add_actor(AmrLook(lambda: (pose[0], 0.0, 0.0)))
        scene = ScanScene(layout, warehouse.variant, warehouse.actors)
        body = amr.profile.footprint_m
        scanners = [
            (SimulatedScanner(scene, spec, rng), spec.scanner(body)) for spec in DIAGONAL_SCANNERS
        ]
        camera = Camera.from_fov(1920, 1200, math.radians(120.0))
        sight = SightLines(layout, warehouse.variant, warehouse.actors)
        eye = KeypointCamera(camera, sight, KeypointNoise(), rng)
        pipeline = AwarenessPipeline(camera, eye, eye, eye_in_head_std_rad=0.0)
        image = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
        detector = LegDetector(classifier=classifier)
        tracker = PersonTracker(
            view=CameraView(camera), sensors={_LASER: SensorConfig(view=ScannerView())}
        )
        heading = math.radians(case.heading_deg)
        start = np.array(case.position_m)
        along = np.array([math.cos(heading), math.sin(heading)])
        seated = SeatedPeople()
        tracks: tuple[PersonTrack, ...] = ()
        in_view = False
        for tick in range(round(case.duration_s * _SCAN_HZ)):
            t = tick / _SCAN_HZ
            walked = case.speed_mps * t
            worker.place(
                start + walked * along, heading, walked, case.speed_mps, activity=case.activity
            )
            speed = _DRIVE_MPS if case.drives else 0.0
            pose[0] = np.eye(4)
            pose[0][0, 3] = speed * t
            if sensors != "scanner" and tick % _SCANS_PER_IMAGE == 0:
                T_odom_camera = pose[0] @ amr.T_base_camera
                in_view = bool(eye.look(T_odom_camera, [worker]))
                seen = pipeline.process(image, t)
                seated.see(seen, T_odom_camera)
                tracks = tracker.update(seen, t, T_odom_camera)
            if sensors != "camera":
                motion = RobotMotion(t, pose[0], np.array([speed, 0.0]))
                found = merge_candidates(
                    seated.placed(
                        detector.detect(
                            scan_points(scanner.scan(motion), mounting, motion), number
                        ),
                        t,
                    )
                    for number, (scanner, mounting) in enumerate(scanners)
                )
                tracks = tracker.update(
                    [_observation(each, t, pose[0]) for each in found], t, pose[0], sensor=_LASER
                )
            yield Sample(t, start + walked * along, tracks, in_view)


def cases(kind: str) -> Iterator[Case]:
    """Yield the cases of the table: a ``child``, somebody ``seated`` on a stool, or ``boxed``."""
    looks = ("jamila", "mateo", "linnea", "kofi", "ivan")
    seat: SeatKind = "box" if kind == "boxed" else "stool"
    activity = "none" if kind == "child" else "sitting"
    number = 0
    for drives in (False, True):
        for distance in (1.5, 2.5, 3.5, 5.0):
            for heading in (-180.0, -135.0, -90.0, 0.0, 60.0):
                look = looks[number % len(looks)]
                stature = 1.1 if kind == "child" else (1.6, 1.75, 1.9)[number % 3]
                place = (distance, 1.0 if drives else (0.0, 0.5, -0.7)[number % 3])
                yield Case(
                    f"{kind} {'driving' if drives else 'standing'}",
                    stature,
                    look,
                    place,
                    heading,
                    activity,
                    seat,
                    drives=drives,
                    duration_s=distance + 1.5 if drives else 4.0,
                    seed=number,
                )
                number += 1
    if kind == "child":
        for drives in (False, True):
            for speed, place, heading in (
                (0.7, (4.0, 1.5), -90.0),
                (1.0, (5.0, 2.0), -100.0),
                (1.0, (5.5, -0.8), 180.0),
                (0.8, (2.0, 1.0), 0.0),
            ):
                name = f"child walking, robot {'driving' if drives else 'standing'}"
                yield Case(
                    name,
                    1.1,
                    looks[number % 5],
                    place,
                    heading,
                    speed_mps=speed,
                    drives=drives,
                    duration_s=4.0,
                    seed=number,
                )
                number += 1


def _observation(
    candidate: PersonCandidate, stamp_s: float, T_odom_base: FloatArray
) -> PersonObservation:
    """Return a candidate as an observation in the base frame; the robot drives along x."""
    covariance = np.diag([0.0, 0.0, 0.04])
    covariance[:2, :2] = candidate.covariance_m2
    place = candidate.position_odom_m - T_odom_base[:2, 3]
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=np.append(place, _CHEST_M),
        position_covariance_m2=covariance,
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=candidate.score,
        box_xyxy_px=None,
    )


def _row(name: str, sensors: Sensors, samples: list[Sample]) -> str:
    counts = np.array([len(sample.sure) for sample in samples])
    errors = np.array([sample.error_m for sample in samples])
    found = errors[np.isfinite(errors)]
    median, high = np.percentile(found, [50.0, 95.0]) if len(found) else (math.nan, math.nan)
    return (
        f"| {name} | {sensors} | {len(samples)} | {100.0 * np.mean(counts == 1):.1f} % | "
        f"{100.0 * np.mean(counts > 1):.1f} % | {median:.3f} | {high:.3f} | "
        f"{100.0 * np.mean(errors <= 0.2):.1f} % |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.child_and_seated")
    parser.add_argument("--kinds", nargs="*", default=["child", "seated", "boxed"])
    parser.add_argument("--sensors", nargs="*", default=["camera", "scanner", "both"])
    parser.add_argument("--network", type=Path, help="another network than the shipped one")
    parser.add_argument("--every", type=int, default=1, help="take every n-th case only")
    parser.add_argument("--verbose", action="store_true", help="a line for each case")
    chosen = parser.parse_args()
    classifier: LegClassifier | None = (
        None if chosen.network is None else OnnxLegClassifier(chosen.network)
    )
    print("| who | sensors | frames | one track | more | median, m | 95 %, m | within 0.2 m |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for kind in chosen.kinds:
        for sensors in chosen.sensors:
            rows: dict[str, list[Sample]] = {}
            for case in list(cases(kind))[:: chosen.every]:
                samples = [
                    sample
                    for sample in encounter(case, sensors, classifier)
                    if sample.stamp_s >= SETTLED_S
                ]
                rows.setdefault(case.name, []).extend(samples)
                if chosen.verbose:
                    print(_row(str(case), sensors, samples), flush=True)
            for name, samples in rows.items():
                print(_row(name, sensors, samples), flush=True)


if __name__ == "__main__":
    main()
