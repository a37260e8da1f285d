"""Recall and false people of the leg detector: ``python -m benchmarks.laser_people``.

A robot with two diagonal scanners drives through the shipped halls. Held-out workers walk and stand
around it. The figures are: recall per scan of people within 5 m in line of sight, errors of place,
confirmed tracks where nobody is, and the time of a scan.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Final

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
from sim_tests.actors.body import Worker, worker_names
from sim_tests.actors.robot import Amr, AmrLook
from sim_tests.world import Warehouse, crosses_boxes
from sim_tests.world.hall import LAYOUTS
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScanScene, SimulatedScanner
from tracking import PersonTracker, TrackerConfig
from training.legs import TRAINING_WORKERS

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


class Wanderer:
    """Somebody or something that moves between random free places, and stands in between.

    Args:
        boxes: (N, 4) what it keeps clear of.
        rng: chooses the way.
        clearance_m: distance from the boxes.
        speeds_mps: lowest and highest speed.
        stands: share of stops; 1 never moves.
    """

    def __init__(
        self,
        boxes: FloatArray,
        rng: np.random.Generator,
        clearance_m: float,
        speeds_mps: tuple[float, float],
        stands: float,
    ) -> None:
        self._boxes, self._rng, self._clearance_m = boxes, rng, clearance_m
        self._speeds, self._stands = speeds_mps, stands
        self.place_m = self._free()
        self.heading_rad = float(rng.uniform(-math.pi, math.pi))
        self.speed_mps, self.walked_m, self.yaw_rate_radps = 0.0, 0.0, 0.0
        self._goal, self._until_s = self.place_m, float(rng.uniform(0.0, 4.0))

    def advance(self, t_s: float, dt_s: float) -> None:
        """Move on by one step of time."""
        to = self._goal - self.place_m
        distance = float(np.linalg.norm(to))
        if t_s < self._until_s or self._stands >= 1.0:
            self.speed_mps = self.yaw_rate_radps = 0.0
            return
        if distance < 0.1:
            self._goal = self._next()
            if self._rng.random() < self._stands:
                self._until_s = t_s + float(self._rng.uniform(1.0, 6.0))
            self._speed = float(self._rng.uniform(*self._speeds))
            return
        wanted = math.atan2(to[1], to[0])
        turn = math.remainder(wanted - self.heading_rad, math.tau)
        step = min(max(turn, -1.5 * dt_s), 1.5 * dt_s)
        self.yaw_rate_radps = step / dt_s
        self.heading_rad += step
        self.speed_mps = self._speed if abs(turn) < 0.3 else 0.0
        along = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
        self.place_m = self.place_m + self.speed_mps * dt_s * along
        self.walked_m += self.speed_mps * dt_s

    def _next(self) -> FloatArray:
        for _ in range(200):
            place = self._free()
            offset = place - self.place_m
            sides = np.array([[0.0, 0.0], [-offset[1], offset[0]], [offset[1], -offset[0]]])
            sides *= self._clearance_m / max(float(np.linalg.norm(offset)), 1e-6)
            if np.linalg.norm(offset) < 8.0 and not any(
                crosses_boxes(self._boxes, self.place_m + side, [place + side])[0] for side in sides
            ):
                return place
        return self.place_m

    def _free(self) -> FloatArray:
        low, high = self._boxes[:, :2].min(axis=0), self._boxes[:, 2:].max(axis=0)
        while True:
            place = self._rng.uniform(low, high)
            away = np.maximum(self._boxes[:, :2] - place, place - self._boxes[:, 2:])
            if np.linalg.norm(np.maximum(away, 0.0), axis=1).min() > self._clearance_m:
                return np.asarray(place)


class Figures:
    """Counts over all scans of one hall."""

    def __init__(self) -> None:
        self.seen: dict[str, list[bool]] = defaultdict(list)
        self.errors_m: list[float] = []
        self.normalised: list[float] = []
        self.ghosts: set[int] = set()
        self.ghost_scans = 0
        self.time_ms: list[float] = []
        self.duration_s = 0.0
        self.wrong = 0
        self.scans = 0

    def row(self, name: str) -> str:
        """Return the figures as a row of a Markdown table."""
        every = [
            found for kind, each in self.seen.items() if kind.startswith("range") for found in each
        ]
        recall = f"{100.0 * np.mean(every):.2f} % of {len(every)}" if every else "–"
        error = f"{100.0 * np.median(self.errors_m):.1f}" if self.errors_m else "–"
        ghosts = 60.0 * len(self.ghosts) / max(self.duration_s, 1e-9)
        sigma = f"{np.mean(self.normalised):.2f}" if self.normalised else "–"
        return (
            f"| {name} | {recall} | {error} | {sigma} | {self.wrong / max(self.scans, 1):.3f} | "
            f"{ghosts:.2f} | {np.median(self.time_ms):.2f} |"
        )


def drive(
    layout: str,
    variant: int,
    workers: Sequence[str],
    duration_s: float,
    seed: int,
    figures: Figures,
    config: LegDetectorConfig,
    classifier: LegClassifier | None = None,
) -> None:
    """Drive through a hall for a time and add what was found to the figures.

    The noise of the scanners is the configuration's.
    """
    specs = [
        spec.model_copy(update={"noise_std_m": config.range_noise_m}) for spec in DIAGONAL_SCANNERS
    ]
    rng = np.random.default_rng([seed, 60])
    with Warehouse(LAYOUTS[layout](), variant=variant) as warehouse:
        people = [Worker(warehouse, look=name) for name in workers]
        amr = Amr(warehouse)
        pose = [np.eye(4)]
        warehouse.add_actor(AmrLook(lambda: (pose[0], 0.0, 0.0)))
        scene = ScanScene(warehouse.layout, variant, warehouse.actors)
        skins = [scene.occluders.index(worker.skin) for worker in people]
        boxes = warehouse.obstacle_boxes_odom
        robot = Wanderer(boxes, rng, _ROBOT_CLEARANCE_M, (0.3, _ROBOT_MPS), 0.2)
        walks = [
            Wanderer(boxes, rng, _PERSON_CLEARANCE_M, (0.6, 1.7), 1.0 if k % 4 == 3 else 0.4)
            for k in range(len(people))
        ]
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
            for walk, worker in zip(walks, people, strict=True):
                walk.advance(t, 1.0 / _RATE_HZ)
                worker.place(walk.place_m, walk.heading_rad, walk.walked_m, walk.speed_mps)
            pose[0] = _pose(robot)
            velocity = np.array([robot.speed_mps, 0.0])
            motion = RobotMotion(t, pose[0], velocity, robot.yaw_rate_radps)
            places = np.array([walk.place_m for walk in walks]).reshape(-1, 2)
            groups = []
            for number, (scanner, mounting) in enumerate(zip(scanners, mountings, strict=True)):
                scan = scanner.scan(motion)
                start = time.perf_counter()
                found = detector.detect(scan_points(scan, mounting, motion), number)
                figures.time_ms.append(1e3 * (time.perf_counter() - start))
                groups.append(found)
                origin = (motion.T_odom_base @ mounting.T_base_scanner)[:2, 3]
                _count(figures, scanner, skins, places, walks, workers, origin, found)
            merged = merge_candidates(groups)
            tracks = tracker.update(observations_of(merged, np.eye(4), t), t, np.eye(4))
            for track in tracks:
                if track.status == "confirmed" and (
                    not len(places)
                    or np.linalg.norm(places - track.position_odom_m, axis=1).min() > _GHOST_M
                ):
                    figures.ghost_scans += 1
                    figures.ghosts.add(1000 * seed + track.id)
        figures.duration_s += duration_s


def _count(
    figures: Figures,
    scanner: SimulatedScanner,
    skins: Sequence[int],
    places: FloatArray,
    walks: Sequence[Wanderer],
    workers: Sequence[str],
    origin: FloatArray,
    found: Sequence[PersonCandidate],
) -> None:
    step = math.radians(scanner.spec.resolution_deg)
    at = np.array([each.position_odom_m for each in found]).reshape(-1, 2)
    figures.scans += 1
    figures.wrong += sum(
        not len(places) or np.linalg.norm(places - place, axis=1).min() > _GHOST_M for place in at
    )
    for number, skin in enumerate(skins):
        distance = float(np.linalg.norm(places[number] - origin))
        apart = np.linalg.norm(np.delete(places, number, axis=0) - places[number], axis=1)
        if len(apart) and apart.min() < _APART_M:
            continue
        if (
            distance > _RANGE_M
            or np.count_nonzero(scanner.hit_by == skin) * step * distance < _SEEN_M
        ):
            continue
        away = np.linalg.norm(at - places[number], axis=1)
        hit = bool(len(at) and away.min() <= _MATCH_M)
        figures.seen[f"range {math.floor(distance)}–{math.floor(distance) + 1} m"].append(hit)
        figures.seen["walking" if walks[number].speed_mps > 0.0 else "standing"].append(hit)
        figures.seen[f"worker {workers[number]}"].append(hit)
        if hit:
            each = found[int(away.argmin())]
            error = each.position_odom_m - places[number]
            figures.errors_m.append(float(np.linalg.norm(error)))
            figures.normalised.append(
                0.5 * float(error @ np.linalg.solve(each.covariance_m2, error))
            )


def _pose(robot: Wanderer) -> FloatArray:
    T = np.eye(4)
    cos, sin = math.cos(robot.heading_rad), math.sin(robot.heading_rad)
    T[:2, :2] = [[cos, -sin], [sin, cos]]
    T[:2, 3] = robot.place_m
    return T


def main() -> None:
    """Print the table of all halls, with and without people."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.laser_people", description=__doc__)
    parser.add_argument("--halls", nargs="*", default=list(LAYOUTS), choices=list(LAYOUTS))
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
    seen: dict[str, list[bool]] = defaultdict(list)
    for people in (len(held_out), 0):
        for hall in chosen.halls:
            figures = Figures()
            for drive_number in range(chosen.drives):
                seed = 100 * chosen.seed + drive_number
                drive(
                    hall,
                    seed % 8,
                    held_out[:people],
                    chosen.seconds,
                    seed,
                    figures,
                    config,
                    classifier,
                )
            for kind, each in figures.seen.items():
                seen[kind] += each
            print(figures.row(f"{hall}, {people} people"), flush=True)
    for kind in sorted(seen):
        print(f"{kind}: {100.0 * np.mean(seen[kind]):.2f} % of {len(seen[kind])}")


if __name__ == "__main__":
    main()
