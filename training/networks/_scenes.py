"""Halls full of variety: people in every posture and pattern, clutter, and cameras at any height.

A :class:`TrainingScene` is a :class:`sim_tests.dataset.RenderScene` to which figures and clutter
are added. A worker of the scene is often replaced by a figure of the same body in a random posture
and look, sitting ones on a random seat, and things stand before and behind everybody.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from typing import Any, Final, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray
from sim_tests.actors.body import Worker
from sim_tests.dataset import RenderConfig, RenderScene, random_pose

from ._clutter import Clutter, random_chair, random_thing
from ._figures import Figure
from ._looks import random_look
from ._postures import random_posture

Person: TypeAlias = Worker | Figure

# Share of the people who are figures, and of them with a look of their own.
_FIGURE_SHARE: Final = 0.6
_LOOK_SHARE: Final = 0.8
_THINGS: Final = 14
_SEATS: Final = 4
# Share of the seated people who sit on something.
_SEATED_SHARE: Final = 0.85
# Of a figure's headings, those towards the camera.
_FACING_SHARE: Final = 0.35
# Share of the pictures from cameras that are not a robot's.
_OTHER_CAMERA_SHARE: Final = 0.35
_OTHER_HEIGHTS_M: Final = (0.4, 2.6)
_CHEST_M: Final = 1.1
# Things stand at least this far from the camera.
_NEAREST_THING_M: Final = 0.9
_CLEAR_SHARE: Final = 0.3


class TrainingScene(AbstractContextManager["TrainingScene"]):
    """A hall with workers, figures and clutter.

    Args:
        config: as of a rendered set.
        number: number of the scene.
        rng: draws looks and things.

    Attributes:
        hall: the scene without figures and clutter.
        figures: one for each worker, of the same body.
        things: the clutter.
    """

    def __init__(self, config: RenderConfig, number: int, rng: np.random.Generator) -> None:
        self.hall = RenderScene(config, number)
        try:
            warehouse = self.hall.warehouse
            self.figures = tuple(
                Figure(
                    warehouse,
                    worker.asset.name,
                    random_look(worker.asset.name, rng) if rng.random() < _LOOK_SHARE else None,
                )
                for worker in self.hall.workers
            )
            self.things = tuple(Clutter(warehouse, random_thing(rng), rng) for _ in range(_THINGS))
            self._seats = tuple(Clutter(warehouse, random_chair(rng), rng) for _ in range(_SEATS))
        except BaseException:
            self.hall.close()
            raise

    def __exit__(self, *exception: object) -> None:
        self.hall.close()

    @property
    def people(self) -> tuple[Person, ...]:
        """Everybody who stands in the hall now."""
        least = self.hall.warehouse.layout.x_min_m
        everybody: tuple[Person, ...] = (*self.hall.workers, *self.figures)
        return tuple(each for each in everybody if each.position_odom_m[0] > least)

    def clear(self) -> None:
        """Move all people out of the hall, and their seats; the things stay."""
        self.hall.clear()
        for figure in self.figures:
            figure.remove()
        for seat in self._seats:
            seat.remove()

    def arrange(self, rng: np.random.Generator) -> FloatArray:
        """Place camera, people and things at random; return T_odom_camera (4, 4)."""
        for each in (*self.figures, *self.things, *self._seats):
            each.remove()
        T_odom_camera = self.hall.arrange(rng)
        least = self.hall.warehouse.layout.x_min_m
        for worker, figure in zip(self.hall.workers, self.figures, strict=True):
            position = worker.position_odom_m
            if position[0] > least and rng.random() < _FIGURE_SHARE:
                worker.place((least - 9.0, 0.0), 0.0)
                self._place_figure(figure, position, T_odom_camera, rng)
        if rng.random() < _OTHER_CAMERA_SHARE:
            T_odom_camera = _other_camera(T_odom_camera, self.people, rng)
        if rng.random() > _CLEAR_SHARE:
            self._place_things(T_odom_camera, rng)
        return T_odom_camera

    def repose(self, person: Person, T_odom_camera: FloatArray, rng: np.random.Generator) -> None:
        """Give somebody another posture, heading and head pose in the same place."""
        if isinstance(person, Figure):
            self._place_figure(person, person.position_odom_m, T_odom_camera, rng)
        else:
            x, y = person.position_odom_m.tolist()
            random_pose(person, (x, y), T_odom_camera[:3, 3], rng)

    def _place_figure(
        self, figure: Figure, position: FloatArray, T_odom_camera: FloatArray, rng: Any
    ) -> None:
        away = T_odom_camera[:2, 3] - position
        heading = float(rng.uniform(-math.pi, math.pi))
        if rng.random() < _FACING_SHARE:
            heading = math.atan2(away[1], away[0]) + float(rng.normal(0.0, 0.5))
        posture = random_posture(rng)
        figure.place(position, heading, posture)
        seat = self._seats[self.figures.index(figure) % _SEATS]
        seat.remove()
        if posture.name == "sitting" and rng.random() < _SEATED_SHARE:
            turn = Rotation.from_rotvec([0.0, 0.0, heading])
            # The legs of a seat reach below the floor.
            seat.place((*position.tolist(), figure.seat_height_m), turn)

    def _place_things(self, T_odom_camera: FloatArray, rng: np.random.Generator) -> None:
        """Place some things: near people, before and behind them, and anywhere in view."""
        origin, people = T_odom_camera[:2, 3], self.people
        ahead = T_odom_camera[:2, 2] / max(float(np.linalg.norm(T_odom_camera[:2, 2])), 1e-6)
        heading = math.atan2(ahead[1], ahead[0])
        camera = self.hall.camera
        half_fov = math.atan2(0.5 * camera.width_px, camera.fx_px)
        chosen = rng.permutation(_THINGS)[: int(rng.integers(1, 9))]
        for row in chosen.tolist():
            thing = self.things[row]
            near = people and rng.random() < 0.6
            if near:
                person = people[int(rng.integers(len(people)))]
                away = person.position_odom_m - origin
                share = rng.uniform(0.45, 0.9) if rng.random() < 0.55 else rng.uniform(1.1, 1.6)
                side = np.array([-away[1], away[0]]) / max(float(np.linalg.norm(away)), 1e-6)
                place = origin + share * away + rng.normal(0.0, 0.35) * side
            else:
                angle = heading + rng.uniform(-half_fov, half_fov)
                place = origin + rng.uniform(1.0, 10.0) * np.array(
                    [math.cos(angle), math.sin(angle)]
                )
            if float(np.linalg.norm(place - origin)) < _NEAREST_THING_M + thing.radius_m:
                continue
            height = float(rng.uniform(0.3, 2.5)) if rng.random() < 0.15 else 0.0
            turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, math.tau)])
            thing.place((*place.tolist(), height), turn)


def _other_camera(
    T_odom_camera: FloatArray, people: tuple[Person, ...], rng: np.random.Generator
) -> FloatArray:
    """Return the camera at another height, turned up or down to the people, and tilted."""
    pose = np.array(T_odom_camera)
    pose[2, 3] = rng.uniform(*_OTHER_HEIGHTS_M)
    if people:
        ranges = [float(np.linalg.norm(p.position_odom_m - pose[:2, 3])) for p in people]
        nearest = max(min(ranges), 1.0)
        down = math.atan2(pose[2, 3] - _CHEST_M, nearest)
        was = math.atan2(-float(pose[2, 2]), float(np.linalg.norm(pose[:2, 2])))
        # About the camera's x axis, a positive turn looks up.
        turn = Rotation.from_rotvec([was - down * rng.uniform(0.3, 1.0), 0.0, 0.0])
        pose[:3, :3] = pose[:3, :3] @ turn.as_matrix()
    roll = Rotation.from_rotvec([0.0, 0.0, rng.normal(0.0, math.radians(5.0))])
    pose[:3, :3] = pose[:3, :3] @ roll.as_matrix()
    return pose
