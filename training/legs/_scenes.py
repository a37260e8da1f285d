"""Scans of people in random halls, with what each ray met."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from perception.laser import LaserScan, RobotMotion, Scanner, ScanPoints, scan_points
from sim_tests.actors.body import SeatKind, Worker
from sim_tests.world import Warehouse, crosses_boxes
from sim_tests.world.hall import PROP_PARTS, Prop, WarehouseLayout
from sim_tests.world.scanner import ScannerSpec, ScanScene, SimulatedScanner

#: Halls and people of the training; all others are held out.
TRAINING_HALLS: Final = ("open", "blind_corner", "aisles")
TRAINING_WORKERS: Final = (
    *("amina", "bjorn", "carmen", "daniel", "elif", "femi", "giulia", "hiroshi"),
)
#: Scenery variants 0 to 7 are for judging.
FIRST_VARIANT: Final = 8

_PROPS: Final = 14
_POSTS: Final = 4
_TRIES: Final = 30
_ROBOT_CLEARANCE_M: Final = 0.5
_PERSON_CLEARANCE_M: Final = 0.28
_PERSON_SPACING_M: Final = 0.55
_MEAN_STATURE_M: Final = 1.72
_RANGES_M: Final = (0.5, 8.5)
# Share of the places behind something that are taken; there a part of the legs may show.
_HIDDEN_SHARE: Final = 0.3
_ACTIVITIES: Final = ("none", "none", "none", "carry_box", "phone")
# Shares of children and of people who sit, and how far ahead of themselves these need free floor.
_CHILD_SHARE: Final = 0.15
_CHILD_M: Final = (1.0, 1.4)
_SEATED_SHARE: Final = 0.25
_SEATS: Final[tuple[SeatKind, SeatKind]] = ("stool", "box")
_SHANKS_AHEAD_M: Final = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class LabelledScan:
    """A scan, what each ray met, and where the people are.

    Attributes:
        points: the scan.
        person: (N,) number k of the person that each ray met, −2 − k for the seat under that
            person; −1 for everything else.
        people_m: (P, 2) positions of the people in odom.
        noise_m: standard deviation of the ranges.
    """

    points: ScanPoints
    person: NDArray[np.int64]
    people_m: FloatArray
    noise_m: float

    @classmethod
    def of(
        cls,
        mount: FloatArray,
        ranges_m: FloatArray,
        person: NDArray[np.int64],
        people_m: FloatArray,
    ) -> LabelledScan:
        """Return the scan of :func:`raw_scans`: a level scanner on a robot that stands still."""
        x, y, z, yaw, upside_down, increment, noise = mount.tolist()
        spec = ScannerSpec()
        scan = LaserScan(
            0.0,
            math.radians(spec.field_of_view_deg[0]),
            increment,
            ranges_m,
            spec.range_min_m,
            spec.range_max_m,
        )
        scanner = Scanner.mounted(0.0, 0.0, z, yaw, upside_down=bool(upside_down))
        T = np.eye(4)
        T[:2, 3] = x, y
        points = scan_points(scan, scanner, RobotMotion(0.0, T))
        return cls(points, person, people_m, noise)


def random_hall(name: str, rng: np.random.Generator) -> WarehouseLayout:
    """Return a shipped hall with more props at random places and angles."""
    hall = WarehouseLayout.named(name)
    kinds = [*rng.choice(list(PROP_PARTS), _PROPS).tolist(), *["post"] * _POSTS]
    for kind in kinds:
        for _ in range(_TRIES):
            prop = Prop(
                kind=kind,
                x_m=float(rng.uniform(hall.x_min_m + 1.5, hall.x_max_m - 1.5)),
                y_m=float(rng.uniform(hall.y_min_m + 1.5, hall.y_max_m - 1.5)),
                yaw_deg=float(rng.choice([0.0, 90.0, rng.uniform(-180.0, 180.0)])),
            )
            boxes = np.array(prop.boxes_odom_m)
            others = hall.obstacle_boxes_odom
            apart = (boxes[:, None, :2] > others[None, :, 2:]).any(axis=2)
            apart |= (boxes[:, None, 2:] < others[None, :, :2]).any(axis=2)
            if apart.all():
                hall = hall.model_copy(update={"props": (*hall.props, prop)})
                break
    return hall


def random_spec(rng: np.random.Generator) -> ScannerSpec:
    """Return a scanner of the sizes and noises that the network has to know."""
    return ScannerSpec(
        x_m=0.0,
        z_m=float(rng.uniform(0.15, 0.3)),
        yaw_deg=float(rng.uniform(-180.0, 180.0)),
        upside_down=bool(rng.random() < 0.5),
        resolution_deg=float(rng.choice([0.25, 0.33, 0.375, 0.5])),
        noise_std_m=float(rng.uniform(0.01, 0.03)),
        dropout_rate=float(rng.choice([0.0, 0.002, 0.02])),
        dark_dropout_rate=float(rng.uniform(0.0, 0.3)),
        scan_share=0.0,
    )


@contextmanager
def staged(
    hall: WarehouseLayout, variant: int, workers: Sequence[str], rng: np.random.Generator
) -> Iterator[tuple[Warehouse, list[Worker], ScanScene]]:
    """Open a hall with workers of random statures, and the scene that scanners see."""
    with Warehouse(hall, variant=variant) as warehouse:
        people = [
            Worker(warehouse, _stature_m(rng), look=look, seat=_SEATS[int(rng.integers(2))])
            for look in workers
        ]
        yield warehouse, people, ScanScene(hall, variant, warehouse.actors)


def _stature_m(rng: np.random.Generator) -> float:
    """Return the stature of an adult or a child."""
    if rng.random() < _CHILD_SHARE:
        return float(rng.uniform(*_CHILD_M))
    return float(np.clip(rng.normal(_MEAN_STATURE_M, 0.12), 1.42, 2.05))


class RawScan(NamedTuple):
    """A scan as it is stored.

    Attributes:
        mount: (7,) place in odom x, y, z, yaw, 1 if upside down, angle between rays, noise.
        ranges_m: (N,).
        person: (N,) as in :class:`LabelledScan`.
        people_m: (P, 2) positions of the people in odom.
    """

    mount: FloatArray
    ranges_m: FloatArray
    person: NDArray[np.int64]
    people_m: FloatArray


def raw_scans(
    hall: WarehouseLayout,
    variant: int,
    workers: Sequence[str],
    scans: int,
    rng: np.random.Generator,
) -> Iterator[RawScan]:
    """Yield scans from random places in a hall, with random scanners and people around."""
    with staged(hall, variant, workers, rng) as (warehouse, people, scene):
        boxes = warehouse.obstacle_boxes_odom
        skins = [scene.occluders.index(worker.skin) for worker in people]
        seats = [scene.occluders.index(worker.held_object) for worker in people]
        for _ in range(scans):
            place = _free_place(hall, boxes, rng)
            _place_people(people, hall, boxes, place, rng)
            spec = random_spec(rng)
            scanner = SimulatedScanner(scene, spec, rng)
            T = np.eye(4)
            T[:2, 3] = place
            scan = scanner.scan(RobotMotion(0.0, T))
            person = np.full(len(scan), -1)
            for number, skin in enumerate(skins):
                person[scanner.hit_by == skin] = number
                person[scanner.hit_by == seats[number]] = -2 - number
            places = np.array([worker.position_odom_m for worker in people])
            yaw = math.radians(spec.yaw_deg)
            mount = [*place, spec.z_m, yaw, spec.upside_down]
            mount += [scan.angle_increment_rad, spec.noise_std_m]
            yield RawScan(np.array(mount, dtype=float), scan.ranges_m, person, places)


def _free_place(
    hall: WarehouseLayout, boxes: FloatArray, rng: np.random.Generator
) -> tuple[float, float]:
    while True:
        x = float(rng.uniform(hall.x_min_m, hall.x_max_m))
        y = float(rng.uniform(hall.y_min_m, hall.y_max_m))
        if clearance_m(boxes, x, y) > _ROBOT_CLEARANCE_M:
            return x, y


def _place_people(
    people: Sequence[Worker],
    hall: WarehouseLayout,
    boxes: FloatArray,
    robot: tuple[float, float],
    rng: np.random.Generator,
) -> None:
    """Place people around the robot, most of them in its sight; the rest wait outside."""
    taken = [robot]
    for worker in people:
        for _ in range(_TRIES):
            low, high = _RANGES_M
            distance, bearing = rng.uniform(low, high), rng.uniform(-math.pi, math.pi)
            x = robot[0] + distance * math.cos(bearing)
            y = robot[1] + distance * math.sin(bearing)
            if not (hall.x_min_m < x < hall.x_max_m and hall.y_min_m < y < hall.y_max_m):
                continue
            if clearance_m(boxes, x, y) < _PERSON_CLEARANCE_M:
                continue
            if any(math.hypot(x - a, y - b) < _PERSON_SPACING_M for a, b in taken):
                continue
            if rng.random() > _HIDDEN_SHARE and crosses_boxes(boxes, robot, [(x, y)])[0]:
                continue
            heading = float(rng.uniform(-math.pi, math.pi))
            if rng.random() < _SEATED_SHARE:
                size = worker.stature_m / _MEAN_STATURE_M
                knees = (
                    x + size * _SHANKS_AHEAD_M * math.cos(heading),
                    y + size * _SHANKS_AHEAD_M * math.sin(heading),
                )
                if clearance_m(boxes, *knees) < _PERSON_CLEARANCE_M:
                    continue
                if any(math.dist(knees, other) < _PERSON_SPACING_M for other in taken):
                    continue
                taken += [(x, y), knees]
                worker.place((x, y), heading, activity="sitting")
                break
            taken.append((x, y))
            speed = 0.0 if rng.random() < 0.35 else float(rng.uniform(0.2, 2.0))
            worker.place(
                (x, y),
                heading,
                float(rng.uniform(0.0, 3.0)),
                speed,
                activity=str(rng.choice(_ACTIVITIES)),
            )
            break
        else:
            worker.place((hall.x_min_m - 9.0, 0.0), 0.0)


def clearance_m(boxes: FloatArray, x_m: float, y_m: float) -> float:
    """Return the distance from a point to the nearest of boxes (N, 4)."""
    away = np.maximum(boxes[:, :2] - (x_m, y_m), (x_m, y_m) - boxes[:, 2:])
    return float(np.linalg.norm(np.maximum(away, 0.0), axis=1).min())
