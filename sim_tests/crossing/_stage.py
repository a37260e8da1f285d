"""The stage of one crossing: hall, robot and people, and the truth about them."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from nav_adapter.rigid import Motion
from perception import AttentionCone
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ..actors.behaviour import (
    Ears,
    Glances,
    Heard,
    MovingBody,
    Person,
    PersonMotion,
    PersonOutcome,
    PersonSpec,
    RequestMeans,
    RobotBody,
    RoutePoint,
    Surroundings,
    Track,
    habits_of,
    read_recordings,
)
from ..actors.body import Worker, worker_names
from ..actors.robot import Amr, KinematicRobot, RobotLook, robot_of
from ..scenario import Scenario
from ..world import Warehouse
from ..world.render import RendererName
from ._audience import Audience, RobotSight, near_robot
from ._separations import AWAY, STANDING_SPEED_MPS, Approach, ContactEvent

# Distances between surfaces are exact with centres closer than this, else a lower bound.
_EXACT_WITHIN_M: Final = 4.0
# A body with arms down is at most this much farther away than its lower bound, and mostly at most
# this much farther away than in the observation before.
_NEARER_THAN_BOUND_M: Final = 0.45
_MOVED_M: Final = 0.1
# Bodies move at their full rate, and contacts are checked, once surfaces were closer than this in
# the last control cycle; nobody covers this distance within one.
_TOUCH_WITHIN_M: Final = 0.8
_BODY_UPDATE_HZ: Final = 60.0
# A body that would move deeper than this into the robot in one update is held.
_DEEPER_M: Final = 0.002
# A touch ends when robot and person are that far apart.
_APART_M: Final = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class TrueView:
    """The truth about one person at one instant.

    Attributes:
        position_camera_m: (3,) centre line at chest height, in the camera frame.
        gaze_camera: (3,) unit vector of the gaze, eyes included.
        awareness: cone score of the true gaze towards the robot; 0 without a line of sight.
        position_odom_m: (2,) position.
        velocity_odom_mps: (2,) velocity.
        could_look: the camera is in front of the person's body, at most 90° aside, and in their
            line of sight.
        away: the person is not there: out of every sensor's range, and in no figure.
        since_look_s: time since the person last looked at the robot: 0 during a look, infinite
            before the first. A head that faces the robot without a look does not count.
        noticed: whether a look of theirs has taken the robot in.
        heading_odom_rad: heading of the body.
    """

    position_camera_m: FloatArray
    gaze_camera: FloatArray
    awareness: float
    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    could_look: bool = True
    away: bool = False
    since_look_s: float = math.inf
    noticed: bool = False
    heading_odom_rad: float = 0.0

    @property
    def d_fwd_m(self) -> float:
        """Distance along the robot's heading, from the camera."""
        return float(self.position_camera_m[2])

    @property
    def d_lat_m(self) -> float:
        """Lateral offset from the robot's heading, left positive."""
        return -float(self.position_camera_m[0])


class Stage(AbstractContextManager["Stage"]):
    """Hall, robot and people of one crossing, moved together by physics.

    People are numbered in this order: those of the scenario, then replayed people.

    Args:
        scenario: the scenario.
        people_rng: random generator of the people; None for the generator of seed 0.
        renderer: renderer for images of the stage.
    """

    def __init__(
        self,
        scenario: Scenario,
        people_rng: np.random.Generator | None = None,
        *,
        renderer: RendererName = "tiny",
    ) -> None:
        self.scenario = scenario
        self.warehouse = Warehouse(scenario.layout, renderer=renderer)
        try:
            self.amr = _robot(self.warehouse, scenario)
            self.people, ears = staged_people(
                scenario,
                self.warehouse.obstacle_boxes_odom,
                np.random.default_rng(0) if people_rng is None else people_rng,
            )
            self.workers = tuple(
                Worker(self.warehouse, each.spec.stature_m, look=each.spec.look)
                for each in self.people
            )
        except BaseException:
            self.warehouse.close()
            raise
        self.warehouse.add_actor(RobotLook.of(self.amr))
        self._sight = RobotSight(self.amr, self.workers)
        self._sees_robot = [partial(self._sight.seen_by, worker) for worker in self.workers]
        self._audience = Audience(ears, self.workers, self._sight)
        self._motions: tuple[PersonMotion, ...] = ()
        steps = 1.0 / (_BODY_UPDATE_HZ * self.warehouse.physics_dt_s)
        self._steps_per_body_update = max(round(steps), 1)
        self.contacts: list[ContactEvent] = []
        self._touching: list[ContactEvent | None] = [None] * len(self.workers)
        self._near_robot = [False] * len(self.workers)
        self._last_separation_m = [math.inf] * len(self.workers)
        corners = self.amr.profile.footprint_m
        low, high = corners.min(axis=0), corners.max(axis=0)
        half_length, half_width = (0.5 * (high - low)).tolist()
        self._half_size_m: tuple[float, float] = (half_length, half_width)
        # The middle of the outline, which is not the base origin of every robot.
        self._middle_base_m: tuple[float, float] = tuple((0.5 * (low + high)).tolist())
        # What happened to each person since the last motion, for the next one.
        self._held = [False] * len(self.workers)
        self._heard: list[list[Heard]] = [[] for _ in self.workers]
        self._touches: list[list[tuple[float, float]]] = [[] for _ in self.workers]
        self._placed_at_step = 0
        self._last_motion: Motion | None = None
        self._place_workers()

    def close(self) -> None:
        """Close the warehouse."""
        self.warehouse.close()

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def t_s(self) -> float:
        """Simulated time in seconds."""
        return self.warehouse.time_s

    def advance(self, until_s: float) -> None:
        """Run physics until ``until_s``; move the people and record contacts."""
        dt_s = self.warehouse.physics_dt_s
        near = [index for index, is_near in enumerate(self._near_robot) if is_near]
        bodies = [self.workers[index].body for index in near]
        while self.t_s < until_s - 0.5 * dt_s:
            # Far from the robot, bodies move once per control cycle and touch nobody.
            if near and self._bodies_move():
                self._place_workers(in_between=True)
            self.amr.advance(dt_s, bodies)
            # A collision slows the robot in the step that reports it, and in the one before, which
            # stops the robot at the body. The velocity before the collision is the one that counts.
            before, self._last_motion = self._last_motion, self.amr.motion if near else None
            self.warehouse.step()
            for index in near:
                self._update_contact(index, before, self._last_motion)
        self._place_workers()

    def _bodies_move(self) -> bool:
        """Return whether it is time for bodies next to the robot to move on.

        The last control cycle has ended with this already. It is repeated only for people to whom
        something has happened since.
        """
        steps = self.warehouse.steps
        if steps % self._steps_per_body_update != 0:
            return False
        if steps != self._placed_at_step:
            return True
        return any(self._held) or any(self._touching) or any(self._heard)

    def request(self, means: RequestMeans, place_odom_m: FloatArray) -> None:
        """Ask the person at a place for attention, from where the robot is now.

        The person nearest to the place, and within 1 m of it, is addressed. Everybody else within
        earshot may hear it as well.
        """
        robot = self.amr.T_odom_base[:2, 3]
        heard = self._audience.hear(self.t_s, means, place_odom_m, robot, self._motions)
        for news, what in zip(self._heard, heard, strict=True):
            if what is not None:
                news.append(what)

    def observe(self) -> tuple[Approach, ...]:
        """Return robot and person where they are nearest now, for each person."""
        approaches = tuple(self._approach(index) for index in range(len(self._motions)))
        self._near_robot = [each.separation_m < _TOUCH_WITHIN_M for each in approaches]
        return approaches

    def truth(self, cone: AttentionCone, T_odom_camera: FloatArray) -> tuple[TrueView, ...]:
        """Return the truth about every person, seen from the robot's camera."""
        rotation, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
        camera: list[float] = origin.tolist()
        views = []
        people = zip(self.people, self.workers, self._motions, strict=True)
        for person, worker, motion in people:
            gaze = worker.gaze_odom
            up = (-worker.rotation_odom_head[:, 0]).tolist()
            alpha = cone.score_of(worker.eyes_odom_m.tolist(), gaze.tolist(), camera, up)
            in_front = _faces(motion, camera)
            sighted = not motion.away and (in_front or alpha > 0.0) and self._sight.seen_by(worker)
            views.append(
                TrueView(
                    # On three numbers dot takes half the time of @.
                    (worker.chest_odom_m - origin).dot(rotation),
                    gaze.dot(rotation),
                    alpha if sighted else 0.0,
                    motion.position_odom_m,
                    motion.velocity_odom_mps,
                    in_front and sighted,
                    motion.away,
                    person.since_look_s,
                    person.noticed_s is not None,
                    motion.heading_odom_rad,
                )
            )
        return tuple(views)

    @property
    def motions(self) -> tuple[PersonMotion, ...]:
        """Motion of every person now."""
        return self._motions

    @property
    def outcomes(self) -> tuple[PersonOutcome, ...]:
        """Outcomes of the people of the scenario, in their order; replayed people have none."""
        return tuple(person.outcome() for person in self.people[: len(self.scenario.people)])

    def _place_workers(self, *, in_between: bool = False) -> None:
        """Move all people to the present time, which may lie between two control cycles.

        Collision bodies that nothing can touch are left behind: those far from the robot, and
        between two control cycles, when no distance is measured, all that are not next to it.
        """
        t_s, robot, others = self.t_s, self._robot_body(), self._moving_bodies()
        robot_m = robot.x_m, robot.y_m
        self._placed_at_step = self.warehouse.steps
        motions = []
        for index, (worker, person) in enumerate(zip(self.workers, self.people, strict=True)):
            around = Surroundings(
                robot,
                others[:index] + others[index + 1 :],
                self._sees_robot[index],
                held=self._held[index],
                heard=tuple(self._heard[index]),
                touches=tuple(self._touches[index]),
            )
            self._heard[index].clear()
            self._touches[index].clear()
            motion = person.step(t_s, around)
            collides = self._near_robot[index]
            if not in_between:
                x_m, y_m = motion.position_odom_m.tolist()
                collides = near_robot(worker, (x_m, y_m), robot_m)
            motions.append(self._move_or_hold(index, worker, motion, collides=collides))
        self._motions = tuple(motions)

    def _move_or_hold(
        self, index: int, worker: Worker, motion: PersonMotion, *, collides: bool
    ) -> PersonMotion:
        """Move a body; one that would move into the robot stays where it was.

        Physics cannot push a body away, so a body inside the robot would throw the robot over.
        """
        before = self._motions[index] if self._motions and self._near_robot[index] else None
        depth_m = 0.0 if before is None else self._depth_m(worker)
        _pose(worker, motion, collides=collides)
        self._held[index] = False
        if before is None or self._depth_m(worker) < depth_m + _DEEPER_M:
            return motion
        _pose(worker, before)
        self._held[index] = True
        return replace(before, velocity_odom_mps=np.zeros(2))

    def _depth_m(self, worker: Worker) -> float:
        """Return how deep body and robot overlap, 0 when apart."""
        nearest = self.warehouse.nearest(self.amr.body, worker.body, 0.0)
        return 0.0 if nearest is None else -nearest.distance_m

    def _robot_body(self) -> RobotBody:
        motion = self.amr.motion
        x, y = motion.point(*self._middle_base_m)
        camera_x, camera_y, camera_z = self.amr.T_odom_camera[:3, 3].tolist()
        return RobotBody(
            *(x, y, motion.heading_rad),
            *motion.velocity_at(x, y),
            *self._half_size_m,
            (camera_x, camera_y, camera_z),
            motion.yaw_rate_radps,
        )

    def _moving_bodies(self) -> tuple[MovingBody, ...]:
        """Return all people where they were last placed; none before the first placement."""
        return tuple(
            MovingBody(*motion.position_odom_m.tolist(), *motion.velocity_odom_mps.tolist())
            for motion in self._motions
        )

    def _approach(self, index: int, motion: Motion | None = None) -> Approach:
        """Return robot and person where they are nearest; the robot moves as now, or as given."""
        person, motion = self._motions[index], motion or self.amr.motion
        if person.away:
            return AWAY
        centre = person.position_odom_m - motion[:2]
        distance = math.sqrt(centre.dot(centre))
        ux, uy = (centre / max(distance, 1e-9)).tolist()
        vx, vy = person.velocity_odom_mps.tolist()
        bound = distance - self.amr.profile.circumscribed_radius_m - BODY_RADIUS_M
        # The surfaces are nearly always closer than the first distance, and except for what a
        # person carries on the far side always closer than the second.
        first = self._last_separation_m[index] + _MOVED_M
        second = max(bound, 0.0) + _NEARER_THAN_BOUND_M
        for within in (min(first, second), second, _EXACT_WITHIN_M):
            if distance > _EXACT_WITHIN_M:
                break
            nearest = self.warehouse.nearest(self.amr.body, self.workers[index].body, within)
            if nearest is not None:
                found = Approach.at(nearest, motion, (vx, vy), (ux, uy))
                self._last_separation_m[index] = found.separation_m
                return found
        return Approach(bound, (ux, uy), motion.velocity_mps, (vx, vy))

    def _update_contact(self, index: int, *before: Motion | None) -> None:
        """Record whether a person touches the robot.

        ``before`` are the motions of the robot before the last step but one, if it is known, and
        before the last step.
        """
        body = self.workers[index].body
        if not self._held[index] and not self.amr.touches(body):
            # Two that press on each other come apart by less from step to step.
            if self._touching[index] and not self.warehouse.nearest(self.amr.body, body, _APART_M):
                self._touching[index] = None
            return
        approach = max(
            (self._approach(index, each) for each in before if each is not None),
            key=lambda each: each.robot_speed_mps,
        )
        if self.amr.driven_mps <= STANDING_SPEED_MPS:
            # Only a person who walks into it moves a standing robot.
            approach = approach._replace(robot_mps=(0.0, 0.0))
        now, began = ContactEvent(self.t_s, index, approach), self._touching[index]
        # A touch is one contact, unless the robot then moves into somebody who walked into it.
        if began is None or (began.by == "person" and now.by == "robot"):
            self._touching[index] = now
            self.contacts.append(now)
        x, y = approach.towards_person
        self._touches[index].append((-x, -y))


def _robot(warehouse: Warehouse, scenario: Scenario) -> Amr | KinematicRobot:
    task, model = scenario.robot, scenario.robot_model
    start, heading_rad = (task.start_x_m, task.start_y_m), math.radians(task.start_heading_deg)
    return robot_of(warehouse, model, start, heading_rad, camera_mount=scenario.camera.mount)


def _faces(motion: PersonMotion, target_odom_m: list[float]) -> bool:
    """Return whether a target is at most 90° aside of where the body faces."""
    x, y = motion.position_odom_m.tolist()
    heading_rad = motion.heading_odom_rad
    ahead_m: float = math.cos(heading_rad) * (target_odom_m[0] - x)
    ahead_m += math.sin(heading_rad) * (target_odom_m[1] - y)
    return ahead_m >= 0.0


def _pose(worker: Worker, motion: PersonMotion, *, collides: bool = True) -> None:
    worker.place(
        motion.position_odom_m,
        motion.heading_odom_rad,
        head_yaw_rad=motion.head_yaw_rad,
        head_pitch_rad=motion.head_pitch_rad,
        eye_yaw_rad=motion.eye_yaw_rad,
        eye_pitch_rad=motion.eye_pitch_rad,
        activity=motion.activity,
        feet=motion.feet,
        collides=collides,
    )


def staged_people(
    scenario: Scenario, boxes_odom_m: FloatArray, rng: np.random.Generator
) -> tuple[tuple[Person, ...], tuple[Ears, ...]]:
    """Return the people of a scenario, then those who are replayed, and everybody's ears."""
    jitter, habits = scenario.start_jitter_s, habits_of(scenario.population)
    everybody = []
    for spec, own in zip(scenario.people, rng.spawn(len(scenario.people)), strict=True):
        offset = float(own.uniform(-jitter, jitter))
        everybody.append(Person(spec, own, boxes_odom_m, habits=habits, offset_s=offset))
    if scenario.replay_csv is not None:
        everybody += recorded_people(
            scenario.replay_csv,
            boxes_odom_m,
            reacts=scenario.replay_reacts,
            leaves=scenario.replay_leaves,
        )
    Person.bring_together(everybody)
    # The ears draw from generators of their own, which come after those of the people: what
    # people do whom nobody asks depends on nothing here.
    ears = tuple(
        Ears(scenario.hearing if person.spec.hearing is None else person.spec.hearing, stream)
        for person, stream in zip(everybody, rng.spawn(len(everybody)), strict=True)
    )
    return tuple(everybody), ears


def recorded_people(
    path: str | Path, boxes_odom_m: FloatArray, *, reacts: bool = False, leaves: bool = False
) -> list[Person]:
    """Return the recorded people of a table in order of their first rows, with different looks."""
    looks = worker_names()
    people = []
    for number, recording in enumerate(read_recordings(path)):
        x_m, y_m = recording.positions_odom_m[0].tolist()
        spec = PersonSpec(
            name=recording.name,
            look=looks[number % len(looks)],
            route=(RoutePoint(x_m=x_m, y_m=y_m),),
            glances=Glances(notices_within_m=0.0),
        )
        track = Track(recording, reacts=reacts, leaves=leaves)
        people.append(Person(spec, np.random.default_rng(0), boxes_odom_m, track=track))
    return people
