"""Recall and false people of the leg detector: ``python -m benchmarks.laser_people``.

A robot with two diagonal scanners drives through the shipped halls. Held-out workers walk and stand
around it. The figures are: recall per scan of people within 5 m in line of sight, errors of place,
confirmed tracks of no person, and the processor time of a scan.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import numpy as np

from perception.arrays import FloatArray
from perception.laser import (
    LegClassifier,
    LegDetector,
    LegDetectorConfig,
    OnnxLegClassifier,
    PersonCandidate,
    RobotMotion,
    merge_candidates,
    observations_of,
    scan_points,
)
from sim_tests.actors.body import OnlineFootsteps, Worker, worker_names
from sim_tests.actors.robot import Amr, RobotLook
from sim_tests.world import Warehouse
from sim_tests.world.hall import LAYOUTS, WarehouseLayout
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScanScene, SimulatedScanner
from tracking import PersonTracker, TrackerConfig
from training.legs import TRAINING_WORKERS

from .laser_actors import TROLLEY_AHEAD_M, TROLLEY_KINDS, Trolley, TrolleyKind, Wanderer

_T = TypeVar("_T")

_RATE_HZ: Final = 25.0
_RANGE_M: Final = 5.0
_MATCH_M: Final = 0.5
# A confirmed track farther than this from everybody is a ghost.
_GHOST_M: Final = 0.8
# Somebody is in line of sight if rays meet at least this width of the legs.
_SEEN_M: Final = 0.1
# Wanderers do not avoid each other; those who walk through somebody are not counted.
_APART_M: Final = 0.5
_ROBOT_MPS: Final = 1.0
_ROBOT_CLEARANCE_M: Final = 0.55
_PERSON_CLEARANCE_M: Final = 0.35
# Somebody and a trolley turn about the middle of both.
_TROLLEY_CLEARANCE_M: Final = 0.95
_TROLLEY_MIDDLE_M: Final = 0.6
# Halls so large that people come near the robot only if their ways are chosen around it.
_LARGE_HALLS: Final = ("aisles",)
# A candidate of a trolley this near to somebody is that person.
_TROLLEY_MATCH_M: Final = 1.2
# Drives: people alone, the first two of them with trolleys, and an empty hall.
_PARTS: Final = ("people", "trolleys", "nobody")


class _Judged(NamedTuple):
    """The truth about somebody in one scan; ``actors`` are the numbers of body and trolley."""

    place_m: FloatArray
    walks: bool
    worker: str
    actors: Sequence[int]
    trolley: str


class Figures:
    """Counts over all scans of one hall, by kind of sighting."""

    def __init__(self) -> None:
        self.seen: dict[str, list[bool]] = defaultdict(list)
        self.errors_m: dict[str, list[float]] = defaultdict(list)
        self.normalised: dict[str, list[float]] = defaultdict(list)
        self.ghosts: set[int] = set()
        self.ghost_scans = 0
        self.time_ms: list[float] = []
        self.duration_s = 0.0
        self.wrong = 0
        self.scans = 0

    def row(self, name: str) -> str:
        """Return the figures as a row of a Markdown table."""
        every = _of_people(self.seen)
        recall = f"{100.0 * np.mean(every):.2f} % of {len(every)}" if every else "–"
        errors = _of_people(self.errors_m)
        error = f"{100.0 * np.median(errors):.1f}" if errors else "–"
        ghosts = 60.0 * len(self.ghosts) / max(self.duration_s, 1e-9)
        normalised = _of_people(self.normalised)
        sigma = f"{np.mean(normalised):.2f}" if normalised else "–"
        return (
            f"| {name} | {recall} | {error} | {sigma} | {self.wrong / max(self.scans, 1):.3f} | "
            f"{ghosts:.2f} | {np.median(self.time_ms):.2f} |"
        )


def _of_people(by_kind: Mapping[str, Sequence[_T]]) -> list[_T]:
    """Return what was counted of people without trolleys, everybody once."""
    return [each for kind, every in by_kind.items() if kind.startswith("range") for each in every]


def drive(
    layout: str,
    variant: int,
    workers: Sequence[str],
    duration_s: float,
    seed: int,
    figures: Figures,
    config: LegDetectorConfig,
    classifier: LegClassifier | None = None,
    trolleys: Sequence[TrolleyKind] = (),
) -> None:
    """Drive through a hall for a time and add what was found to the figures.

    The noise of the scanners is the configuration's. The first people push the trolleys.
    """
    specs = [
        spec.model_copy(update={"noise_std_m": config.range_noise_m}) for spec in DIAGONAL_SCANNERS
    ]
    rng = np.random.default_rng([seed, 60])
    with Warehouse(WarehouseLayout.named(layout), variant=variant) as warehouse:
        people = [Worker(warehouse, look=name) for name in workers]
        amr = Amr(warehouse)
        pose = [np.eye(4)]
        warehouse.add_actor(RobotLook.nova_carter(lambda: pose[0]))
        boxes = warehouse.obstacle_boxes_odom
        robot = Wanderer(boxes, rng, _ROBOT_CLEARANCE_M, (0.3, _ROBOT_MPS), 0.2)
        walks = [
            Wanderer(
                boxes,
                rng,
                _TROLLEY_CLEARANCE_M if k < len(trolleys) else _PERSON_CLEARANCE_M,
                (0.6, 1.7),
                1.0 if k % 4 == 3 else 0.4,
                (lambda: robot.place_m) if layout in _LARGE_HALLS else None,
            )
            for k in range(len(people))
        ]
        pushed = [
            Trolley(kind, partial(_ahead, walk, TROLLEY_AHEAD_M - _TROLLEY_MIDDLE_M))
            for kind, walk in zip(trolleys, walks, strict=False)
        ]
        backs_m = [_TROLLEY_MIDDLE_M if k < len(pushed) else 0.0 for k in range(len(walks))]
        feet = [
            OnlineFootsteps(worker.gait, *_ahead(walk, -back_m))
            for worker, walk, back_m in zip(people, walks, backs_m, strict=True)
        ]
        scene = ScanScene(warehouse.layout, variant, (*warehouse.actors, *pushed))
        loads = [*trolleys, *("" for _ in walks[len(trolleys) :])]
        seen_as = [[scene.occluders.index(worker.skin)] for worker in people]
        for own, trolley in zip(seen_as, pushed, strict=False):
            own.append(scene.occluders.index(trolley))
        scanners = [SimulatedScanner(scene, spec, rng) for spec in specs]
        body = amr.profile.footprint_m
        mountings = [spec.scanner(body) for spec in specs]
        detector, tracker = (
            LegDetector(config, classifier=classifier),
            PersonTracker(TrackerConfig()),
        )
        for tick in range(round(duration_s * _RATE_HZ)):
            t = tick / _RATE_HZ
            robot.advance(t, 1.0 / _RATE_HZ)
            for walk, back_m, worker, steps in zip(walks, backs_m, people, feet, strict=True):
                walk.advance(t, 1.0 / _RATE_HZ)
                _place(worker, steps, walk, back_m)
            pose[0] = _pose(robot)
            velocity = np.array([robot.speed_mps, 0.0])
            motion = RobotMotion(t, pose[0], velocity, robot.yaw_rate_radps)
            places = np.array([worker.position_odom_m for worker in people]).reshape(-1, 2)
            real = np.concatenate([places, *(each.middle_odom_m[None] for each in pushed)])
            groups = []
            for number, (scanner, mounting) in enumerate(zip(scanners, mountings, strict=True)):
                scan = scanner.scan(motion)
                start = time.thread_time()  # of one thread, so a busy core does not count
                found = detector.detect(scan_points(scan, mounting, motion), number)
                figures.time_ms.append(1e3 * (time.thread_time() - start))
                groups.append(found)
                judged = [
                    _Judged(place, walk.speed_mps > 0.0, name, actors, trolley)
                    for place, walk, name, actors, trolley in zip(
                        places, walks, workers, seen_as, loads, strict=True
                    )
                ]
                origin = (motion.T_odom_base @ mounting.T_base_scanner)[:2, 3]
                _count(figures, scanner, judged, real, origin, found)
            merged = merge_candidates(groups)
            tracks = tracker.update(observations_of(merged, np.eye(4), t), t, np.eye(4))
            for track in tracks:
                if track.status == "confirmed" and (
                    not len(real)
                    or np.linalg.norm(real - track.position_odom_m, axis=1).min() > _GHOST_M
                ):
                    figures.ghost_scans += 1
                    figures.ghosts.add(1000 * seed + track.id)
        figures.duration_s += duration_s


def _count(
    figures: Figures,
    scanner: SimulatedScanner,
    people: Sequence[_Judged],
    real_m: FloatArray,
    origin: FloatArray,
    found: Sequence[PersonCandidate],
) -> None:
    step = math.radians(scanner.spec.resolution_deg)
    at = np.array([each.position_odom_m for each in found]).reshape(-1, 2)
    places = np.array([person.place_m for person in people]).reshape(-1, 2)
    figures.scans += 1
    figures.wrong += sum(
        not len(real_m) or np.linalg.norm(real_m - place, axis=1).min() > _GHOST_M for place in at
    )
    for number, person in enumerate(people):
        distance = float(np.linalg.norm(person.place_m - origin))
        apart = np.linalg.norm(np.delete(places, number, axis=0) - person.place_m, axis=1)
        if distance > _RANGE_M or (len(apart) and apart.min() < _APART_M):
            continue
        widths = [
            np.count_nonzero(scanner.hit_by == actor) * step * distance for actor in person.actors
        ]
        if max(widths) < _SEEN_M:
            continue
        hidden = widths[0] < _SEEN_M  # behind the trolley
        away = np.linalg.norm(at - person.place_m, axis=1)
        hit = bool(len(at) and away.min() <= (_TROLLEY_MATCH_M if hidden else _MATCH_M))
        kinds = [f"pushing, {person.trolley}, legs {'hidden' if hidden else 'in view'}"]
        if not person.trolley:
            kinds = [
                f"range {math.floor(distance)}–{math.floor(distance) + 1} m",
                "walking" if person.walks else "standing",
                f"worker {person.worker}",
            ]
        for kind in kinds:
            figures.seen[kind].append(hit)
        if hit:
            each = found[int(away.argmin())]
            error = each.position_odom_m - person.place_m
            normalised = 0.5 * float(error @ np.linalg.solve(each.covariance_m2, error))
            figures.errors_m[kinds[0]].append(float(np.linalg.norm(error)))
            figures.normalised[kinds[0]].append(normalised)


def _ahead(walk: Wanderer, distance_m: float) -> tuple[float, float, float]:
    """Return x, y and heading of the place at a distance ahead of somebody."""
    x, y = walk.place_m.tolist()
    heading = walk.heading_rad
    return x + distance_m * math.cos(heading), y + distance_m * math.sin(heading), heading


def _place(worker: Worker, feet: OnlineFootsteps, walk: Wanderer, back_m: float) -> None:
    """Let somebody walk on, at a distance behind the middle of what wanders."""
    x, y, heading = _ahead(walk, -back_m)
    cos, sin = math.cos(heading), math.sin(heading)
    ahead, turning = walk.speed_mps, walk.yaw_rate_radps
    aside = -turning * back_m  # somebody behind a trolley goes round it
    velocity = (ahead * cos - aside * sin, ahead * sin + aside * cos, turning)
    gait = feet.step(1.0 / _RATE_HZ, (x, y, heading), velocity, (0.0, 0.0))
    worker.place((x, y), heading, feet=gait)


def _pose(robot: Wanderer) -> FloatArray:
    T = np.eye(4)
    cos, sin = math.cos(robot.heading_rad), math.sin(robot.heading_rad)
    T[:2, :2] = [[cos, -sin], [sin, cos]]
    T[:2, 3] = robot.place_m
    return T


def main() -> None:
    """Print the table of all halls, with people, with trolleys and empty."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.laser_people", description=__doc__)
    parser.add_argument("--halls", nargs="*", default=list(LAYOUTS), choices=list(LAYOUTS))
    parser.add_argument("--parts", nargs="*", default=_PARTS, choices=_PARTS)
    parser.add_argument("--seconds", type=float, default=60.0, help="per hall and drive")
    parser.add_argument("--drives", type=int, default=2, help="drives per hall")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threshold", type=float, default=LegDetectorConfig().score_threshold)
    parser.add_argument("--noise", type=float, default=0.015, help="of a range, in metres")
    parser.add_argument("--network", type=Path, help="another network than the shipped one")
    chosen = parser.parse_args()
    classifier = None if chosen.network is None else OnnxLegClassifier(chosen.network)
    held_out = [name for name in worker_names() if name not in TRAINING_WORKERS]
    config = LegDetectorConfig(score_threshold=chosen.threshold, range_noise_m=chosen.noise)
    print("| hall | recall | error, cm | NEES / 2 | wrong per scan | ghosts per minute | ms |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    every = Figures()
    parts: dict[str, tuple[Sequence[str], Sequence[TrolleyKind]]] = {
        "people": (held_out, ()),
        "trolleys": (held_out, TROLLEY_KINDS),
        "nobody": ((), ()),
    }
    for part in chosen.parts:
        for hall in chosen.halls:
            figures = Figures()
            for drive_number in range(chosen.drives):
                seed = 100 * chosen.seed + drive_number
                workers, trolleys = parts[part]
                drive(
                    hall,
                    seed % 8,
                    workers,
                    chosen.seconds,
                    seed,
                    figures,
                    config,
                    classifier,
                    trolleys,
                )
            for kind, found in figures.seen.items():
                every.seen[kind] += found
                every.errors_m[kind] += figures.errors_m[kind]
                every.normalised[kind] += figures.normalised[kind]
            print(figures.row(f"{hall}, {part}"), flush=True)
    for kind in sorted(every.seen):
        line = f"{kind}: {100.0 * np.mean(every.seen[kind]):.2f} % of {len(every.seen[kind])}"
        if every.errors_m[kind]:
            median, high = np.percentile(every.errors_m[kind], (50.0, 90.0))
            line += f", error {median:.3f} m, 90 % within {high:.3f} m"
            line += f", NEES / 2 {np.mean(every.normalised[kind]):.2f}"
        print(line)


if __name__ == "__main__":
    main()
