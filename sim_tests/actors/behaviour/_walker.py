"""A person who looks, decides and walks, step by step."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, ClassVar, Final

import numpy as np

from ...world.errors import SimError
from ..body import Activity, Gait, OnlineFootsteps, skeleton
from ._attention_span import AttentionSpan
from ._avoidance import SlowRobotDetour, limit_approach, without_part
from ._gaze import Gaze
from ._head import turn_rate, twisted
from ._hearing import Heard
from ._obstacles import Obstacles
from ._person import ALONE, PersonMotion, PersonOutcome, RobotBody, Surroundings
from ._reactions import ReactionModel
from ._route import STANDING_BELOW_MPS, DesiredVelocity, FreeWalk, Route, RouteFollower
from ._social_force import RELAXATION_S, people_force, robot_force
from ._spec import PersonSpec
from ._startle import Startle
from ._trajectory import MAX_ACCELERATION_MPS2, Trajectory, limited

#: Time between two decisions of a walker; in between its motion follows closed forms.
DECISION_PERIOD_S: Final = 1.0 / 20.0

# A robot out of sight is extrapolated for this time, then forgotten.
_REMEMBERED_S: Final = 3.0
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
# The free walk has no end if it takes longer than this factor times its plan.
_MAX_FREE_TIME_FACTOR: Final = 4.0


class Walker:
    """A person who walks a route, glances at the robot and reacts to it.

    Decisions are taken every :data:`DECISION_PERIOD_S`. Position and angles follow closed forms in
    between, so they do not depend on how often :meth:`motion` is called; only the footsteps do.

    Args:
        spec: the person.
        rng: the person's own generator, for glances and reactions.
        boxes_odom_m: (N, 4) racks and walls, x_min, y_min, x_max, y_max.
        offset_s: delay of the start; the person never starts before 0.

    Attributes:
        spec: as given.

    Raises:
        SimError: for a route with a corner inside a rack or a wall.
    """

    # Strength of the force of other people.
    _FORCE_SHARE: ClassVar[float] = 1.0

    def __init__(
        self,
        spec: PersonSpec,
        rng: np.random.Generator,
        boxes_odom_m: Any,
        *,
        offset_s: float = 0.0,
    ) -> None:
        self.spec = spec
        self._boxes_odom_m = boxes_odom_m
        self._obstacles = Obstacles(boxes_odom_m)
        route = Route.from_spec(spec)
        start_s = max(spec.start_s + offset_s, 0.0)
        self._span = AttentionSpan(spec.lapse, spec.sets_off_within_m, start_s)
        self._follower = self._task = RouteFollower(route, spec.speed_mps, self._span.starts_s)
        for number, point in enumerate(spec.route):
            self._obstacles.check_free(
                f"route point {number} of {spec.name!r}", point.x_m, point.y_m
            )
        gaze_rng, reaction_rng = rng.spawn(2)
        self._gaze = Gaze(spec.glances, spec.stature_m, gaze_rng, activity=spec.activity)
        self._reactions = ReactionModel(spec.reactions, reaction_rng)
        self._detour = SlowRobotDetour()
        self._activity = Activity(spec.activity, spec.activity)
        self._trajectory = Trajectory(*route.start, self._obstacles)
        self._tick = -1
        self._now_s = 0.0
        # Heading at the last tick, and its rate since.
        self._reverse_rad = math.pi if spec.backwards else 0.0
        self._standing_heading = (
            None if spec.heading_deg is None else math.radians(spec.heading_deg)
        )
        ux, uy = route.direction(0.0)
        along = math.atan2(uy, ux) + (self._reverse_rad if route.length_m > 0.0 else 0.0)
        self._heading = along if self._standing_heading is None else self._standing_heading
        self._turning = 0.0
        # Length walked so far, and when the end was reached.
        self._walked_m = 0.0
        self._walked_to_end_m: float | None = None
        # The robot: last known state and its time, contact direction and time, first contact.
        self._known_robot: tuple[RobotBody, float] | None = None
        self._touch: tuple[float, float, float] | None = None
        self._bumped_s = -math.inf
        self._startle: Startle | None = None
        # The feet, and the positions of the last two motions.
        self._feet: OnlineFootsteps | None = None
        self._feet_s = 0.0
        self._previous_position = self._last_position = route.start

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self.spec.stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self.spec.look

    @property
    def stride_m(self) -> float | None:
        """None: the stride follows the speed."""
        return None

    @property
    def noticed_s(self) -> float | None:
        """Time of the first look at the robot; None before."""
        return self._gaze.noticed_s

    @property
    def place_odom_m(self) -> tuple[float, float]:
        """Position at the last requested time, x and y."""
        return self._trajectory.state(self._now_s)[:2]

    @property
    def reaction(self) -> str:
        """Reaction in the present encounter with the robot; empty without one."""
        return self._reactions.reaction

    @property
    def arrived(self) -> bool:
        """True once the end of the route was reached."""
        return self._task.arrived_s is not None

    def outcome(self) -> PersonOutcome:
        """Return the outcome for the person up to now."""
        free = self._free_walk
        time_s, late_s = (None, None) if free is None else self._task.times_s(self._now_s, free)
        return PersonOutcome(
            name=self.spec.name,
            noticed_s=self._gaze.noticed_s,
            reaction=self._reactions.first_reaction,
            time_s=time_s,
            late_s=late_s,
            free_time_s=None if free is None else free.time_s,
            length_m=self._walked_m if self._walked_to_end_m is None else self._walked_to_end_m,
            free_length_m=None if free is None else free.length_m,
        )

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the person's motion at ``t_s``, which never decreases."""
        self.advance(t_s, around)
        x, y, vx, vy = self._trajectory.state(t_s)
        self._previous_position, self._last_position = self._last_position, (x, y)
        after_s = t_s - self._tick * DECISION_PERIOD_S
        heading = self._heading + self._turning * after_s
        if self._feet is None:
            gait = Gait(skeleton(self.spec.look, self.spec.stature_m))
            self._feet = OnlineFootsteps(gait, x, y, heading)
        feet = None
        if t_s - self._bumped_s < _RECOIL_S:
            feet = self._feet.translate(
                x - self._previous_position[0], y - self._previous_position[1]
            )
        if feet is None:
            feet = self._feet.step(
                t_s - self._feet_s,
                (x, y, heading),
                (vx, vy, self._turning),
                self._trajectory.acceleration,
            )
        self._feet_s = t_s
        head_yaw, head_pitch, eye_yaw, eye_pitch = self._gaze.angles(after_s)
        twist = self._gaze.twist_rad(after_s)
        return PersonMotion(
            position_odom_m=np.array([x, y]),
            velocity_odom_mps=np.array([vx, vy]),
            heading_odom_rad=heading + twist,
            walked_m=self._walked_m,
            feet=twisted(feet, twist),
            head_yaw_rad=head_yaw,
            head_pitch_rad=head_pitch,
            eye_yaw_rad=eye_yaw,
            eye_pitch_rad=eye_pitch,
            activity=self._activity,
        )

    def advance(self, t_s: float, around: Surroundings) -> None:
        """Take all decisions up to ``t_s``."""
        while (self._tick + 1) * DECISION_PERIOD_S <= t_s + 1e-9:
            self._decide(around)
        self._now_s = t_s

    def hold(self) -> None:
        """Take the last motion back: it would have led into the robot, and the body stayed."""
        left_s = (self._tick + 1) * DECISION_PERIOD_S - self._now_s
        state = (*self._previous_position, 0.0, 0.0)
        self._trajectory.start_segment(self._now_s, state, (0.0, 0.0), left_s)
        self._last_position = self._previous_position
        if self._feet is not None:
            self._feet.undo()

    def hear(self, heard: Heard) -> None:
        """Turn to the robot that has asked for attention, or startle, as :class:`Heard` says."""
        if heard.looks:
            self._gaze.hear(heard)
        if heard.startle:
            self._startle = Startle(heard.startle, heard.from_s)

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Note a contact with the robot in this direction: the person steps back and looks at it.

        Raises:
            SimError: for a direction that is not a unit vector.
        """
        if not math.isclose(math.hypot(towards_x, towards_y), 1.0, abs_tol=1e-6):
            raise SimError(
                f"the direction to the robot must have length 1, got ({towards_x}, {towards_y})"
            )
        if self._touch is None or self._now_s - self._touch[2] > _RECOIL_S:
            self._bumped_s = self._now_s
            self._heading += self._turning * (self._now_s - self._tick * DECISION_PERIOD_S)
            self._turning, self._startle = 0.0, None
            self._gaze.startle(self._now_s)
        if self.spec.stays:
            return
        self._touch = (towards_x, towards_y, self._now_s)
        x, y, vx, vy = self._trajectory.state(self._now_s)
        back = max(vx * towards_x + vy * towards_y + _RECOIL_MPS, 0.0)
        vx, vy = vx - back * towards_x, vy - back * towards_y
        left_s = (self._tick + 1) * DECISION_PERIOD_S - self._now_s
        self._trajectory.start_segment(self._now_s, (x, y, vx, vy), (0.0, 0.0), left_s)

    def _decide(self, around: Surroundings) -> None:
        """Take one decision: look, follow the route, react, avoid, and set the next segment."""
        first = self._tick < 0
        self._tick += 1
        t_s = self._tick * DECISION_PERIOD_S
        x, y, vx, vy = self._trajectory.end
        if not first:
            self._walked_m += math.dist((x, y), self._trajectory.start)
            self._heading += self._turning * DECISION_PERIOD_S
        self._span.maybe_set_off(self._task, t_s, around.robot)
        robot = self._span.known(self._look_at_robot(t_s, (x, y, self._heading), around))
        if self.spec.stays:
            self._trajectory.start_segment(t_s, (x, y, 0.0, 0.0), (0.0, 0.0), DECISION_PERIOD_S)
            return
        on_route = self._span.lead(self._follower, t_s, x, y, math.hypot(vx, vy))
        if self._walked_to_end_m is None and self.arrived:
            self._walked_to_end_m = self._walked_m
        walking = self._follower.walking and not self._span.halted
        desired = self._reactions.react(
            t_s, DECISION_PERIOD_S, (x, y), on_route, robot, standing=not walking
        )
        if walking and robot is not None:
            desired = self._detour.steer(desired, x, y, robot)
        if robot is not None:
            desired = limit_approach(desired, x, y, robot, self.spec.keeps_off_m)
        desired, facing = self._recoil_or_face(t_s, on_route, desired)
        if self._startle is not None and around.robot is not None:
            startled = self._startle.velocity(t_s, (x, y), around.robot)
            if startled is not None:
                desired, facing = startled, self._heading
        acceleration = self._acceleration((x, y, vx, vy), desired, robot, around)
        self._turn(facing)
        self._trajectory.start_segment(t_s, (x, y, vx, vy), acceleration, DECISION_PERIOD_S)

    def _look_at_robot(
        self, t_s: float, place: tuple[float, float, float], around: Surroundings
    ) -> RobotBody | None:
        """Update head and eyes; return the robot as the person knows it, None without knowledge."""
        robot = around.robot
        if robot is None:
            return None
        in_view = self._gaze.in_field_of_view(DECISION_PERIOD_S, place, robot)
        asked = self._gaze.asked(t_s)
        sighted = (in_view or asked) and around.sees_robot()
        visible, answers = in_view and sighted, asked and sighted
        visible = self._span.sees(t_s, self._gaze.noticed_s, self._touch is not None, visible)
        self._gaze.update(t_s, DECISION_PERIOD_S, place, robot, visible, answers)
        felt = self._touch is not None and t_s - self._touch[2] <= _TOUCHING_S
        if ((visible or answers) and self._gaze.noticed_s is not None) or felt:
            self._known_robot = (robot, t_s)
        if self._known_robot is None or t_s - self._known_robot[1] > _REMEMBERED_S:
            return None
        return self._known_robot[0].extrapolated(t_s - self._known_robot[1])

    def _recoil_or_face(
        self, t_s: float, on_route: DesiredVelocity, desired: DesiredVelocity
    ) -> tuple[DesiredVelocity, float]:
        """Return the velocity after contact and turning, and the heading to turn to."""
        if self._touch is not None and t_s - self._bumped_s < _RECOIL_S:
            return DesiredVelocity(-self._touch[0], -self._touch[1], _RECOIL_MPS), self._heading
        if not self._follower.walking:
            facing = self._heading if self._standing_heading is None else self._standing_heading
            return desired, facing
        along = desired.ux * on_route.ux + desired.uy * on_route.uy
        if along < _SIDE_STEP_COSINE and self._reactions.reaction == "wait":
            return desired, self._heading
        facing = math.atan2(desired.uy, desired.ux) + self._reverse_rad
        off = abs(math.remainder(facing - self._heading, math.tau))
        if off > _TURN_FIRST_RAD:
            share = (math.pi - off) / (math.pi - _TURN_FIRST_RAD)
            speed_mps = desired.speed_mps * max(share, _MIN_TURNING_SHARE)
            desired = DesiredVelocity(desired.ux, desired.uy, speed_mps)
        return desired, facing

    def _turn(self, facing: float) -> None:
        """Set the turn rate of the body towards a heading."""
        off = math.remainder(facing - self._heading, math.tau)
        self._turning = turn_rate(off, self._turning, DECISION_PERIOD_S)

    def _acceleration(
        self,
        state: tuple[float, float, float, float],
        desired: DesiredVelocity,
        robot: RobotBody | None,
        around: Surroundings,
    ) -> tuple[float, float]:
        """Return the acceleration by desired velocity and social forces, within human limits."""
        _, _, vx, vy = state
        desired_vx, desired_vy = desired.speed_mps * desired.ux, desired.speed_mps * desired.uy
        slower = desired.speed_mps < math.hypot(vx, vy)
        within_s = _BRAKING_S if slower else RELAXATION_S
        ax, ay = (desired_vx - vx) / within_s, (desired_vy - vy) / within_s
        if self.spec.social:
            fx, fy = self._social_force(state, robot, around)
            if desired.speed_mps > STANDING_BELOW_MPS or math.hypot(fx, fy) > _UNMOVED_BELOW_MPS2:
                ax, ay = ax + fx, ay + fy
        ax, ay = limited(ax, ay, MAX_ACCELERATION_MPS2)
        next_vx, next_vy = vx + ax * DECISION_PERIOD_S, vy + ay * DECISION_PERIOD_S
        fastest = _MAX_SPEED_FACTOR * max(
            self.spec.speed_mps, desired.speed_mps, _MIN_REFERENCE_MPS
        )
        next_vx, next_vy = limited(next_vx, next_vy, fastest)
        t_s = self._tick * DECISION_PERIOD_S
        if self._touch is not None and t_s - self._touch[2] <= _TOUCHING_S:
            next_vx, next_vy = without_part(next_vx, next_vy, self._touch[0], self._touch[1])
        return (next_vx - vx) / DECISION_PERIOD_S, (next_vy - vy) / DECISION_PERIOD_S

    def _social_force(
        self,
        state: tuple[float, float, float, float],
        robot: RobotBody | None,
        around: Surroundings,
    ) -> tuple[float, float]:
        """Return the force of racks, people, and the robot as far as it is known."""
        x, y, vx, vy = state
        ax, ay = self._obstacles.force(x, y)
        fx, fy = people_force(x, y, vx, vy, around.others)
        ax, ay = ax + self._FORCE_SHARE * fx, ay + self._FORCE_SHARE * fy
        if robot is not None:
            too_near = math.dist(robot.nearest_point_m(x, y), (x, y)) < _TOO_NEAR_M
            if too_near or not self._reactions.expects_robot_to_yield:
                fx, fy = robot_force(x, y, vx, vy, robot)
                ax, ay = ax + fx, ay + fy
        return ax, ay

    @cached_property
    def _free_walk(self) -> FreeWalk | None:
        """The walk without robot and people; None without a route or without an end of it."""
        if self._task.route.length_m == 0.0:
            return None
        spec = self.spec.model_copy(update={"start_s": 0.0, "sets_off_within_m": None})
        alone = Walker(spec, np.random.default_rng(0), self._boxes_odom_m)
        route = self._task.route
        pauses = sum(stop.for_s for stop in route.stops[:-1])
        longest_s = _MAX_FREE_TIME_FACTOR * (route.length_m / spec.speed_mps + 5.0) + pauses
        along_m = []
        while alone._task.arrived_s is None:
            alone.advance((alone._tick + 1) * DECISION_PERIOD_S, ALONE)
            along_m.append(alone._task.along_m)
            if alone._tick * DECISION_PERIOD_S > longest_s:
                return None
        return FreeWalk(alone._task.arrived_s, alone._walked_m, DECISION_PERIOD_S, tuple(along_m))
