"""A person who looks, decides and walks, step by step, along a route or a recorded track."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from ..body import Activity
from ._forces import (
    RELAXATION_S,
    SlowRobotDetour,
    limit_approach,
    people_force,
    robot_force,
    without_part,
)
from ._free_walk import FreeWalks
from ._gaze import Gaze, planned_gaze
from ._habits import CLASSIC, Habits, Manner, draw_person
from ._head import turn_rate, twisted
from ._reactions import ReactionModel, Startle
from ._route import STANDING_BELOW_MPS, DesiredVelocity, Route, RouteFollower
from ._spec import PersonSpec
from ._starting import AttentionSpan
from ._surroundings import (
    MovingBody,
    PersonMotion,
    PersonOutcome,
    RobotBody,
    Surroundings,
    eye_height_m,
)
from ._track import FACING_FROM_MPS, Track
from ._trajectory import MAX_ACCELERATION_MPS2, Feet, Obstacles, State, Trajectory, limited

#: Time between two decisions of a person; in between the motion follows closed forms.
DECISION_PERIOD_S: Final = 1.0 / 20.0

_BRAKING_S: Final = 0.1
# Highest speed, relative to the larger of free and desired speed.
_MAX_SPEED_FACTOR: Final = 1.3
_MIN_REFERENCE_MPS: Final = 0.5
# Weaker social forces do not move a standing person.
_UNMOVED_BELOW_MPS2: Final = 1.0
# A person who goes first avoids the robot only within this distance.
_TOO_NEAR_M: Final = 0.5
# A person whose heading is farther off walks slower until it is turned, down to this speed share.
_TURN_FIRST_RAD: Final = math.radians(60.0)
_MIN_TURNING_SHARE: Final = 0.1
# A waiting person steps aside or back without turning if the cosine of the angle between step and
# route is smaller.
_SIDE_STEP_COSINE: Final = 0.2
# After a contact the person steps back, and never towards the robot while they touch.
_RECOIL_S: Final = 0.7
_RECOIL_MPS: Final = 0.4
_TOUCHING_S: Final = 0.1


class Person:
    """A person who walks a route or a recorded track, looks around and reacts to the robot.

    Decisions are taken every :data:`DECISION_PERIOD_S`. Position and angles follow closed forms in
    between, so they do not depend on how often :meth:`step` is called; only the footsteps do.

    *On a route* the person walks as the specification and the habits say, glances at the robot or
    looks as planned, and reacts to a robot that they have seen.

    *On a track* the recording is met exactly until a startle, or the robot if the track reacts,
    forces the person off it: by a social force of more than 0.5 m/s² or a contact. From then on the
    person is pushed by that force, walks round a slow robot and never into one, and heads for the
    place where the recording has them at the present time. There the recording goes on. People on a
    track know the robot from any side, and look at it only where it asks.

    ``rng`` is the person's own, for glances, reactions and habits. With a variation of the habits,
    speed and glances are drawn by :func:`draw_person`. ``offset_s`` delays the start, which is
    never before 0.

    Attributes:
        spec: the person, with the speed and the glances that were drawn.
        task: the route from the scenario.
        on_track: the person moves as recorded now.

    Raises:
        SimError: for a route with a corner inside a rack or a wall.
    """

    def __init__(
        self,
        spec: PersonSpec,
        rng: np.random.Generator,
        boxes_odom_m: Any,
        *,
        habits: Habits = CLASSIC,
        track: Track | None = None,
        offset_s: float = 0.0,
    ) -> None:
        self._made_of = spec, copy.deepcopy(rng), boxes_odom_m, habits, track, offset_s
        self._free_walks = FreeWalks((self,), DECISION_PERIOD_S)
        self._habits = habits
        self._manner: Manner | None = None
        if habits.variation is not None:
            spec_rng, *manner_rngs = rng.spawn(5)
            spec = draw_person(spec, spec_rng)
            self._manner = Manner(habits, habits.variation, spec.speed_mps, manner_rngs)
        self.spec = spec
        self._track = track
        self.on_track = track is not None
        self._obstacles = Obstacles(boxes_odom_m)
        route = Route.from_spec(spec)
        start_s = max(spec.start_s + offset_s, 0.0)
        self._span = AttentionSpan(spec.lapse, spec.sets_off_within_m, start_s)
        self._follower = self.task = RouteFollower(route, spec.speed_mps, self._span.starts_s)
        if track is None:
            for number, point in enumerate(spec.route):
                self._obstacles.check_free(
                    f"route point {number} of {spec.name!r}", point.x_m, point.y_m
                )
        gaze_rng, reaction_rng, noticing_rng = rng.spawn(3)
        self._gaze = Gaze(spec.glances, spec.stature_m, gaze_rng, activity=spec.activity)
        self._gaze.eye_rest = None if self._manner is None else self._manner.eye_rest
        self._gaze.take_in_s = float(noticing_rng.exponential(habits.noticing_s))
        self._eyes_m = eye_height_m(spec.stature_m, spec.activity)
        self._reactions = ReactionModel(spec.reactions, reaction_rng)
        self._detour = SlowRobotDetour()
        self._activity = Activity(spec.activity, spec.activity)
        self._trajectory = Trajectory(*route.start, self._obstacles)
        self._tick, self._now_s = -1, 0.0
        # Heading at the last tick, from the recorded one on a track, and its rate since.
        self._reverse_rad = math.pi if spec.backwards else 0.0
        self._standing_heading = (
            None if spec.heading_deg is None else math.radians(spec.heading_deg)
        )
        ux, uy = route.direction(0.0)
        along = math.atan2(uy, ux) + (self._reverse_rad if route.length_m > 0.0 else 0.0)
        self._heading = along if self._standing_heading is None else self._standing_heading
        if track is not None:
            self._heading = 0.0
        self._turning = 0.0
        # Length walked so far, and when the end was reached.
        self._walked_m = 0.0
        self._walked_to_end_m: float | None = None
        # Contact with the robot: direction and time, and the time of the first one.
        self._touch: tuple[float, float, float] | None = None
        self._bumped_s = -math.inf
        self._startle: Startle | None = None
        # The feet, and the positions of the last two motions.
        self._feet = Feet(spec)
        self._previous_position = self._last_position = route.start

    @property
    def noticed_s(self) -> float | None:
        """Time of the first look that took the robot in; None before."""
        return self._gaze.noticed_s

    @property
    def since_look_s(self) -> float:
        """Time since the last look at the robot: 0 during one, infinite before the first.

        Before :attr:`noticed_s`, the looks have not taken the robot in.
        """
        return 0.0 if self._gaze.looks else self._now_s - self._gaze.looked_s

    @property
    def place_odom_m(self) -> tuple[float, float]:
        """Position at the last requested time, x and y."""
        return self._state(self._now_s)[:2]

    @property
    def reaction(self) -> str:
        """Reaction in the present encounter with the robot; empty without one."""
        return self._reactions.reaction

    @property
    def arrived(self) -> bool:
        """True once the end of the route was reached."""
        return self.task.arrived_s is not None

    @property
    def moving_body(self) -> MovingBody | None:
        """The person as others avoid them at the last requested time; None while away."""
        if self._track is not None and self._track.is_away(self._now_s):
            return None
        return MovingBody(*self._state(self._now_s))

    @staticmethod
    def bring_together(people: Sequence[Person]) -> None:
        """Let new people meet: their free walks are those of all of them without the robot."""
        walks = FreeWalks(tuple(people), DECISION_PERIOD_S)
        for person in people:
            person._free_walks = walks

    def twin(self) -> Person:
        """Return the same person at the beginning, who draws the same random numbers."""
        spec, rng, boxes_odom_m, habits, track, offset_s = self._made_of
        rng = copy.deepcopy(rng)
        return Person(spec, rng, boxes_odom_m, habits=habits, track=track, offset_s=offset_s)

    def outcome(self) -> PersonOutcome:
        """Return the outcome for the person up to now."""
        end_s, started_s = self.task.arrived_s, self.task.started_s
        outcome = PersonOutcome(
            name=self.spec.name,
            noticed_s=self._gaze.noticed_s,
            reaction=self._reactions.first_reaction,
            time_s=None if end_s is None or started_s is None else end_s - started_s,
            length_m=self._length_m,
        )
        if self.task.route.length_m == 0.0 or started_s is None:
            return outcome
        free, late_s = self._free_walks.of(self, self._now_s)
        end_s, started_s = free.task.arrived_s, free.task.started_s
        return replace(
            outcome,
            late_s=None if self.arrived else late_s,
            free_time_s=None if end_s is None or started_s is None else end_s - started_s,
            free_length_m=None if end_s is None else free._length_m,
        )

    @property
    def _length_m(self) -> float:
        """Length walked up to now, or to the end of the route."""
        return self._walked_m if self._walked_to_end_m is None else self._walked_to_end_m

    def step(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the person's motion at ``t_s``, which never decreases."""
        self._take_in(around)
        self.advance(t_s, around)
        x, y, vx, vy = self._state(t_s)
        self._previous_position, self._last_position = self._last_position, (x, y)
        after_s = t_s - self._tick * DECISION_PERIOD_S
        heading = self._recorded_heading(t_s) + self._heading + self._turning * after_s
        feet = self._feet.follow(
            t_s,
            (x, y, heading),
            (vx, vy),
            self._trajectory.acceleration,
            turning_radps=self._turning if self._track is None else None,
            slide=t_s - self._bumped_s < _RECOIL_S,
        )
        head, twist = self._gaze.angles(after_s), self._gaze.twist_rad(after_s)
        if self._track is not None and not self._gaze.turned:
            head, twist = (self._track.head_yaw_rad(t_s), 0.0, 0.0, 0.0), 0.0
        place, velocity, feet = np.array([x, y]), np.array([vx, vy]), twisted(feet, twist)
        motion = PersonMotion(
            place, velocity, heading + twist, self._walked_m, feet, *head, activity=self._activity
        )
        return motion.far_away() if self._track and self._track.is_away(t_s) else motion

    def advance(self, t_s: float, around: Surroundings) -> None:
        """Take all decisions up to ``t_s``."""
        while (self._tick + 1) * DECISION_PERIOD_S <= t_s + 1e-9:
            self._decide(around)
        self._now_s = t_s

    def _state(self, t_s: float) -> State:
        """Return position and velocity, as recorded or on the present segment."""
        if self.on_track and self._track is not None:
            return self._track.state(t_s)
        return self._trajectory.state(t_s)

    def _recorded_heading(self, t_s: float) -> float:
        """Return the heading from which ``_heading`` counts: 0 without a track."""
        return 0.0 if self._track is None else self._track.heading_rad(t_s)

    def _take_in(self, around: Surroundings) -> None:
        """Note what happened since the last motion: it was held, a request heard, a contact."""
        if around.held:
            self._hold()
        for heard in around.heard:
            if heard.looks:
                self._gaze.hear(heard)
            if heard.startle and (self._startle is None or self._startle.is_over(self._now_s)):
                self._startle = Startle(heard.startle, heard.from_s)
        for towards_x, towards_y in around.touches:
            self._note_contact(towards_x, towards_y)

    def _hold(self) -> None:
        """Take the last motion back: it would have led into the robot, and the body stayed."""
        if self.on_track and not self._reacts:
            return
        left_s = (self._tick + 1) * DECISION_PERIOD_S - self._now_s
        state = (*self._previous_position, 0.0, 0.0)
        self._trajectory.start_segment(self._now_s, state, (0.0, 0.0), left_s)
        self.on_track = False
        self._last_position = self._previous_position
        self._feet.undo()

    def _note_contact(self, towards_x: float, towards_y: float) -> None:
        """Step back from the robot in this direction, and look at it."""
        if not self._reacts:
            return
        if self._touch is None or self._now_s - self._touch[2] > _RECOIL_S:
            self._bumped_s = self._now_s
            self._heading += self._turning * (self._now_s - self._tick * DECISION_PERIOD_S)
            self._turning, self._startle = 0.0, None
            if self._track is None:
                self._gaze.startle(self._now_s)
        if self.spec.stays:
            return
        self._touch = (towards_x, towards_y, self._now_s)
        x, y, vx, vy = self._state(self._now_s)
        back = max(vx * towards_x + vy * towards_y + _RECOIL_MPS, 0.0)
        vx, vy = vx - back * towards_x, vy - back * towards_y
        left_s = (self._tick + 1) * DECISION_PERIOD_S - self._now_s
        self._trajectory.start_segment(self._now_s, (x, y, vx, vy), (0.0, 0.0), left_s)
        self.on_track = False

    @property
    def _reacts(self) -> bool:
        """True for everybody but people on a track who walk on whatever the robot does."""
        return self._track is None or self._track.reacts

    def _decide(self, around: Surroundings) -> None:
        """Take one decision: look, follow the way, react, avoid, and set the next segment."""
        if self._manner is not None and not self.spec.stays:
            self._maybe_start(self._manner, around.robot)
        first = self._tick < 0
        self._tick += 1
        t_s = self._tick * DECISION_PERIOD_S
        x, y, vx, vy = state = self._state(t_s) if self.on_track else self._trajectory.end
        if not first:
            self._walked_m += math.dist((x, y), self._trajectory.start)
            self._heading += self._turning * DECISION_PERIOD_S
        heading = self._recorded_heading(t_s) + self._heading
        self._span.maybe_set_off(self.task, t_s, around.robot)
        robot = self._look_at_robot(t_s, (x, y, heading), around)
        if self._track is not None:
            robot = around.robot
            startled = self._startle is not None and self._startle.is_on(t_s)
            self.on_track = self._track.leads(
                t_s, state, robot, on_track=self.on_track, startled=startled
            )
            if self.on_track:
                self._turn(-self._heading)
                state = self._track.state(t_s)
                self._trajectory.start_segment(t_s, state, (0.0, 0.0), DECISION_PERIOD_S)
                return
        if self.spec.stays:
            self._trajectory.start_segment(t_s, (x, y, 0.0, 0.0), (0.0, 0.0), DECISION_PERIOD_S)
            return
        if self._track is not None:
            desired = on_way = self._track.velocity_back(t_s, x, y)
            walking = on_way.speed_mps >= FACING_FROM_MPS
        else:
            on_way = self._span.lead(self._follower, t_s, x, y, math.hypot(vx, vy))
            if self._walked_to_end_m is None and self.arrived:
                self._walked_to_end_m = self._walked_m
            walking = self._follower.walking and not self._span.halted
            desired = self._reactions.react(
                t_s, DECISION_PERIOD_S, (x, y), on_way, robot, standing=not walking
            )
        if walking and robot is not None:
            desired = self._detour.steer(desired, x, y, robot)
        if robot is not None:
            desired = limit_approach(desired, x, y, robot, self.spec.keeps_off_m)
        desired, facing = self._recoil_or_face(t_s, heading, on_way, desired)
        if self._startle is not None and around.robot is not None:
            step_aside = self._startle.velocity(t_s, (x, y), around.robot)
            if step_aside is not None:
                desired, facing = step_aside, heading
        acceleration = self._acceleration(state, desired, robot, around)
        self._turn(facing - heading)
        self._trajectory.start_segment(t_s, state, acceleration, DECISION_PERIOD_S)

    def _look_at_robot(
        self, t_s: float, place: tuple[float, float, float], around: Surroundings
    ) -> RobotBody | None:
        """Update head and eyes; return the robot as the person knows it, None without knowledge."""
        robot = around.robot
        if self._track is not None:
            self._gaze.follow((self._track.head_yaw_rad(t_s), 0.0))
        if robot is None:
            return None
        if self.spec.gaze:
            head = planned_gaze(self.spec.gaze, t_s, place, robot.camera_m, self._eyes_m)
            if self._tick == 0:
                self._gaze.follow(head)
            self._gaze.away = head
        in_view = self._gaze.in_field_of_view(DECISION_PERIOD_S, place, robot)
        asked = self._gaze.asked(t_s)
        sighted = (in_view or asked) and around.sees_robot()
        visible, answers = in_view and sighted and not self.spec.gaze, asked and sighted
        visible = self._span.sees(t_s, self._gaze.noticed_s, self._touch is not None, visible)
        self._gaze.update(t_s, DECISION_PERIOD_S, place, robot, visible, answers)
        felt = self._touch is not None and t_s - self._touch[2] <= _TOUCHING_S
        if ((visible or answers) and self._gaze.noticed_s is not None) or felt:
            self._span.remember(robot, t_s)
        return self._span.known(t_s)

    def _recoil_or_face(
        self, t_s: float, heading: float, on_way: DesiredVelocity, desired: DesiredVelocity
    ) -> tuple[DesiredVelocity, float]:
        """Return the velocity after contact and turning, and the heading to turn to."""
        if self._touch is not None and t_s - self._bumped_s < _RECOIL_S:
            return DesiredVelocity(-self._touch[0], -self._touch[1], _RECOIL_MPS), heading
        if self._track is not None:
            return desired, self._track.facing_rad(t_s, desired)
        if not self._follower.walking:
            facing = self._follower.stop_heading_rad
            facing = self._standing_heading if facing is None else facing
            return desired, heading if facing is None else facing
        along = desired.ux * on_way.ux + desired.uy * on_way.uy
        if along < _SIDE_STEP_COSINE and self._reactions.reaction == "wait":
            return desired, heading
        facing = math.atan2(desired.uy, desired.ux) + self._reverse_rad
        off = abs(math.remainder(facing - heading, math.tau))
        if off > _TURN_FIRST_RAD:
            share = (math.pi - off) / (math.pi - _TURN_FIRST_RAD)
            speed_mps = desired.speed_mps * max(share, _MIN_TURNING_SHARE)
            desired = DesiredVelocity(desired.ux, desired.uy, speed_mps)
        return desired, facing

    def _turn(self, by_rad: float) -> None:
        """Set the turn rate of the body for a turn by an angle."""
        off = math.remainder(by_rad, math.tau)
        self._turning = turn_rate(off, self._turning, DECISION_PERIOD_S)

    def _acceleration(
        self, state: State, desired: DesiredVelocity, robot: RobotBody | None, around: Surroundings
    ) -> tuple[float, float]:
        """Return the acceleration: by the desired velocity and social forces within human limits.

        To it comes the rate at which the walk varies.
        """
        ahead = aside = 0.0, 0.0
        if self._manner is not None:
            desired, ahead, aside = self._manner.varied(
                desired, state[:2], robot, DECISION_PERIOD_S, walking=self._follower.walking
            )
        _, _, vx, vy = state
        desired_vx, desired_vy = desired.speed_mps * desired.ux, desired.speed_mps * desired.uy
        slower = desired.speed_mps < math.hypot(vx, vy)
        within_s = _BRAKING_S if slower and self._track is None else RELAXATION_S
        ax, ay = (desired_vx - vx) / within_s, (desired_vy - vy) / within_s
        if self.spec.social:
            fx, fy = self._social_force(state, robot, around)
            moved = self._track is not None or math.hypot(fx, fy) > _UNMOVED_BELOW_MPS2
            if desired.speed_mps > STANDING_BELOW_MPS or moved:
                ax, ay = ax + fx, ay + fy
        ax, ay = limited(ax, ay, MAX_ACCELERATION_MPS2)
        next_vx, next_vy = vx + ax * DECISION_PERIOD_S, vy + ay * DECISION_PERIOD_S
        t_s = self._tick * DECISION_PERIOD_S
        fastest = _MAX_SPEED_FACTOR * max(
            self.spec.speed_mps, desired.speed_mps, _MIN_REFERENCE_MPS
        )
        if self._track is not None:
            fastest = self._track.fastest_mps(t_s)
        next_vx, next_vy = limited(next_vx, next_vy, fastest)
        if self._touch is not None and t_s - self._touch[2] <= _TOUCHING_S:
            next_vx, next_vy = without_part(next_vx, next_vy, self._touch[0], self._touch[1])
        ax, ay = (next_vx - vx) / DECISION_PERIOD_S, (next_vy - vy) / DECISION_PERIOD_S
        return ax + ahead[0] + aside[0], ay + ahead[1] + aside[1]

    def _social_force(
        self, state: State, robot: RobotBody | None, around: Surroundings
    ) -> tuple[float, float]:
        """Return the force of racks and people, and of the robot as far as it is known.

        People off a track feel the robot alone: the track keeps clear of the rest.
        """
        x, y, vx, vy = state
        ax = ay = 0.0
        if self._track is None:
            ax, ay = self._obstacles.force(x, y)
            fx, fy = people_force(x, y, vx, vy, around.others)
            ax, ay = ax + self._habits.people_share * fx, ay + self._habits.people_share * fy
        if robot is not None:
            too_near = math.dist(robot.nearest_point_m(x, y), (x, y)) < _TOO_NEAR_M
            if too_near or not self._reactions.expects_robot_to_yield:
                fx, fy = robot_force(x, y, vx, vy, robot)
                return ax + fx, ay + fy
        return ax, ay

    def _maybe_start(self, manner: Manner, robot: RobotBody | None) -> None:
        """Let a person who stands start by chance."""
        t_s = (self._tick + 1) * DECISION_PERIOD_S
        x, y, vx, vy = self._trajectory.end
        leader = self._follower
        if not manner.starting.starts(
            t_s,
            DECISION_PERIOD_S,
            standing=self.task.started_s is not None and math.hypot(vx, vy) < STANDING_BELOW_MPS,
            idle=leader.arrived_s is not None,
            looking=self._gaze.looking,
            place=(x, y),
            robot=robot,
        ):
            return
        if leader.arrived_s is None:
            leader.go(t_s)
            self._span.end_halt()
            self._reactions.go_first()
        elif errand := manner.errand((x, y), self._obstacles.is_clear):
            goal, speed_mps = errand
            self._follower = RouteFollower(Route([(x, y), goal], []), speed_mps, t_s)
