"""A person with a mind of their own: looks, decides and walks, step by step."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ..body import Activity, Gait, OnlineFootsteps, skeleton
from ._course import Course, Detour, kept_off
from ._forces import RELAXATION_S, Obstacles, push_of_people, push_of_robot
from ._gaze import Gaze
from ._meeting import Intent, Meeting
from ._person import ALONE, PersonMotion, PersonOutcome, RobotBody, Surroundings
from ._route import STILL_MPS, Errand, Route
from ._spec import PersonSpec

#: People decide so often; in between they go on as they began.
TICK_S: Final = 1.0 / 20.0

# What a person knows of a robot that is out of sight is worth something for so long.
_REMEMBERS_S: Final = 3.0
_BRAKING_S: Final = 0.1
# Nobody speeds up or swerves harder than this, nor gets pushed to more than this times the pace.
_MOST_MPS2: Final = 3.0
_MOST_PACE: Final = 1.3
_LEAST_PACE_MPS: Final = 0.5
# Whoever stands lets pushes weaker than this be; whoever goes first keeps off a robot this near.
_UNMOVED_MPS2: Final = 1.0
_TOO_NEAR_M: Final = 0.5
# Turning the body.
_TURN_RATE_HZ: Final = 4.0
_TURN_RADPS: Final = 2.6
_TURN_RADPS2: Final = 15.0
_TURNED_RAD: Final = math.radians(60.0)
_LEAST_TURNED: Final = 0.1
# After running into the robot: a step back, and no step towards it while they touch.
_RECOIL_S: Final = 0.7
_RECOIL_MPS: Final = 0.4
_TOUCHING_S: Final = 0.1
# An undisturbed walk that takes longer than this times its plan never ends.
_LONGEST: Final = 4.0


class Walker:
    """A person who walks a route, glances about and reacts to the robot.

    Decisions are taken every :data:`TICK_S`; in between, place and angles follow closed forms, so
    that how often somebody asks changes nothing but the steps of the feet.

    Args:
        spec: what the scenario says.
        rng: for glances and reactions; the person's own.
        boxes_odom_m: (N, 4) racks and walls, x_min, y_min, x_max, y_max.
        offset_s: sets out so much later; never before 0.

    Raises:
        SimError: for a route with a corner inside a rack or a wall.
    """

    def __init__(
        self,
        spec: PersonSpec,
        rng: np.random.Generator,
        boxes_odom_m: Any,
        *,
        offset_s: float = 0.0,
    ) -> None:
        self.spec = spec
        self._obstacles = Obstacles(boxes_odom_m)
        route = Route.of(spec)
        self._errand = Errand(route, spec.speed_mps, max(spec.start_s + offset_s, 0.0))
        for number, point in enumerate(spec.route):
            self._obstacles.refuse(f"route point {number} of {spec.name!r}", point.x_m, point.y_m)
        gaze_rng, meeting_rng = rng.spawn(2)
        self._gaze = Gaze(spec.glances, spec.stature_m, gaze_rng)
        self._meeting = Meeting(spec.reactions, meeting_rng)
        self._detour = Detour()
        self._activity = Activity(spec.activity, spec.activity)
        self._boxes = boxes_odom_m
        self._reverse = math.pi if spec.backwards else 0.0
        self._stands_facing = None if spec.heading_deg is None else math.radians(spec.heading_deg)
        self._course = Course(*route.start, self._obstacles)
        self._tick = -1
        ux, uy = route.direction(0.0)
        along = math.atan2(uy, ux) + (self._reverse if route.length_m > 0.0 else 0.0)
        self._heading = along if self._stands_facing is None else self._stands_facing
        self._turning = 0.0
        self._walked_m = 0.0
        self._way_m: float | None = None  # walked until the end was reached
        # About the robot.
        self._known: tuple[RobotBody, float] | None = None
        self._touch: tuple[float, float, float] | None = None  # direction and when
        self._bumped_s = -math.inf
        self._now_s = 0.0
        self._shown = self._showing = route.start
        self._feet: OnlineFootsteps | None = None
        self._stepped_s = 0.0
        self._free: tuple[float | None, float] | None = None

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
        """The stride follows the speed."""
        return None

    @property
    def noticed_s(self) -> float | None:
        """When the person first looked at the robot."""
        return self._gaze.noticed_s

    @property
    def place_odom_m(self) -> tuple[float, float]:
        """Where the person was when last asked, x and y."""
        return self._course.at(self._now_s)[:2]

    @property
    def reaction(self) -> str:
        """What the person does about the robot now; empty for nothing."""
        return self._meeting.reaction

    @property
    def arrived(self) -> bool:
        """Whether the end of the route was reached."""
        return self._errand.arrived_s is not None

    def outcome(self) -> PersonOutcome:
        """What has become of the person up to now."""
        time_s = None
        errand = self._errand
        if errand.arrived_s is not None and errand.set_out_s is not None:
            time_s = errand.arrived_s - errand.set_out_s
        free_time_s, free_length_m = self._undisturbed()
        return PersonOutcome(
            name=self.spec.name,
            noticed_s=self._gaze.noticed_s,
            reaction=self._meeting.first_reaction,
            time_s=time_s if free_time_s is not None else None,
            free_time_s=free_time_s,
            length_m=self._walked_m if self._way_m is None else self._way_m,
            free_length_m=None if free_time_s is None else free_length_m,
        )

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """What the person does at ``t_s``, which never goes back."""
        self.advance(t_s, around)
        x, y, vx, vy = self._course.at(t_s)
        self._shown, self._showing = self._showing, (x, y)
        after_s = t_s - self._tick * TICK_S
        heading = self._heading + self._turning * after_s
        if self._feet is None:
            gait = Gait(skeleton(self.spec.look, self.spec.stature_m))
            self._feet = OnlineFootsteps(gait, x, y, heading)
        feet = None
        if t_s - self._bumped_s < _RECOIL_S:
            feet = self._feet.carried(x - self._shown[0], y - self._shown[1])
        if feet is None:
            feet = self._feet.step(
                t_s - self._stepped_s, (x, y, heading), (vx, vy, self._turning), self._course.push
            )
        self._stepped_s = t_s
        head_yaw, head_pitch, eye_yaw, eye_pitch = self._gaze.at(after_s)
        return PersonMotion(
            position_odom_m=_pair(x, y),
            velocity_odom_mps=_pair(vx, vy),
            heading_odom_rad=heading,
            walked_m=self._walked_m,
            feet=feet,
            head_yaw_rad=head_yaw,
            head_pitch_rad=head_pitch,
            eye_yaw_rad=eye_yaw,
            eye_pitch_rad=eye_pitch,
            activity=self._activity,
        )

    def advance(self, t_s: float, around: Surroundings) -> None:
        """Take all decisions due up to ``t_s``."""
        while (self._tick + 1) * TICK_S <= t_s + 1e-9:
            self._decide(around)
        self._now_s = t_s

    def hold(self) -> None:
        """The last motion would have led into the robot: the body stays where it was before."""
        left_s = (self._tick + 1) * TICK_S - self._now_s
        self._course.set_off(self._now_s, (*self._shown, 0.0, 0.0), (0.0, 0.0), left_s)
        self._showing = self._shown
        if self._feet is not None:
            self._feet.undo()

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Body and robot touch: the person gets no farther that way, and has noticed.

        Raises:
            SimError: for a direction that is not a unit vector.
        """
        if not math.isclose(math.hypot(towards_x, towards_y), 1.0, abs_tol=1e-6):
            raise SimError(
                f"the robot must lie in a direction of length 1, got ({towards_x}, {towards_y})"
            )
        if self._touch is None or self._now_s - self._touch[2] > _RECOIL_S:
            self._bumped_s = self._now_s
            self._heading += self._turning * (self._now_s - self._tick * TICK_S)
            self._turning = 0.0
            self._gaze.startle(self._now_s)
        self._touch = (towards_x, towards_y, self._now_s)
        x, y, vx, vy = self._course.at(self._now_s)
        back = max(vx * towards_x + vy * towards_y + _RECOIL_MPS, 0.0)
        vx, vy = vx - back * towards_x, vy - back * towards_y
        left_s = (self._tick + 1) * TICK_S - self._now_s
        self._course.set_off(self._now_s, (x, y, vx, vy), (0.0, 0.0), left_s)

    def _decide(self, around: Surroundings) -> None:
        """One tick: where am I, what do I see, what do I want, what pushes me."""
        first = self._tick < 0
        self._tick += 1
        t_s = self._tick * TICK_S
        x, y, vx, vy = self._course.end
        if not first:
            self._walked_m += math.dist((x, y), self._course.start)
            self._heading += self._turning * TICK_S
        place = (x, y, self._heading)
        robot = self._look(t_s, place, around)
        intent = self._errand.intent(t_s, x, y, math.hypot(vx, vy))
        if self._way_m is None and self.arrived:
            self._way_m = self._walked_m
        going = self._errand.going
        wanted = self._meeting.react(t_s, TICK_S, (x, y), intent, robot, standing=not going)
        if going and robot is not None:
            wanted = self._detour.around(wanted, x, y, robot)
        if robot is not None:
            wanted = kept_off(wanted, x, y, robot)
        wanted, facing = self._recoiling(t_s, intent, wanted, going)
        ax, ay = self._acceleration((x, y, vx, vy), wanted, robot, around)
        self._turn(facing)
        self._course.set_off(t_s, (x, y, vx, vy), (ax, ay), TICK_S)

    def _look(
        self, t_s: float, place: tuple[float, float, float], around: Surroundings
    ) -> RobotBody | None:
        """Set head and eyes; returns the robot as far as the person knows of it."""
        robot = around.robot
        if robot is None:
            return None
        sees = self._gaze.could_see(TICK_S, place, robot) and around.sees_robot()
        self._gaze.tick(t_s, TICK_S, place, robot, sees)
        felt = self._touch is not None and t_s - self._touch[2] <= _TOUCHING_S
        if (sees and self._gaze.noticed_s is not None) or felt:
            self._known = (robot, t_s)
        if self._known is None or t_s - self._known[1] > _REMEMBERS_S:
            return None
        return self._known[0].later(t_s - self._known[1])

    def _recoiling(
        self, t_s: float, intent: Intent, wanted: Intent, going: bool
    ) -> tuple[Intent, float]:
        """What is wanted after a bump and a turn of the body, and which way to face for it."""
        if self._touch is not None and t_s - self._bumped_s < _RECOIL_S:
            return Intent(-self._touch[0], -self._touch[1], _RECOIL_MPS), self._heading
        # Steps aside and back are taken without turning.
        along = wanted.x * intent.x + wanted.y * intent.y
        if not going:
            facing = self._heading if self._stands_facing is None else self._stands_facing
            return wanted, facing
        if along < 0.2 and self._meeting.reaction == "wait":
            return wanted, self._heading
        facing = math.atan2(wanted.y, wanted.x) + self._reverse
        off = abs(math.remainder(facing - self._heading, math.tau))
        if off > _TURNED_RAD:
            share = (math.pi - off) / (math.pi - _TURNED_RAD)
            wanted = Intent(wanted.x, wanted.y, wanted.speed_mps * max(share, _LEAST_TURNED))
        return wanted, facing

    def _turn(self, facing: float) -> None:
        """Set the body turning."""
        off = math.remainder(facing - self._heading, math.tau)
        rate = min(max(_TURN_RATE_HZ * off, -_TURN_RADPS), _TURN_RADPS)
        most = _TURN_RADPS2 * TICK_S
        self._turning += min(max(rate - self._turning, -most), most)

    def _acceleration(
        self,
        state: tuple[float, float, float, float],
        wanted: Intent,
        robot: RobotBody | None,
        around: Surroundings,
    ) -> tuple[float, float]:
        """Of the wish and of all that pushes, within human limits."""
        _, _, vx, vy = state
        want_x, want_y = wanted.speed_mps * wanted.x, wanted.speed_mps * wanted.y
        slower = wanted.speed_mps < math.hypot(vx, vy)
        within_s = _BRAKING_S if slower else RELAXATION_S
        ax, ay = (want_x - vx) / within_s, (want_y - vy) / within_s
        if self.spec.social:
            px, py = self._pushes(state, robot, around)
            if wanted.speed_mps > STILL_MPS or math.hypot(px, py) > _UNMOVED_MPS2:
                ax, ay = ax + px, ay + py
        size = math.hypot(ax, ay)
        if size > _MOST_MPS2:
            ax, ay = ax * _MOST_MPS2 / size, ay * _MOST_MPS2 / size
        next_x, next_y = vx + ax * TICK_S, vy + ay * TICK_S
        fastest = _MOST_PACE * max(self.spec.speed_mps, wanted.speed_mps, _LEAST_PACE_MPS)
        speed = math.hypot(next_x, next_y)
        if speed > fastest:
            next_x, next_y = next_x * fastest / speed, next_y * fastest / speed
        if self._touch is not None and self._tick * TICK_S - self._touch[2] <= _TOUCHING_S:
            next_x, next_y = _without(next_x, next_y, self._touch[0], self._touch[1])
        return (next_x - vx) / TICK_S, (next_y - vy) / TICK_S

    def _pushes(
        self,
        state: tuple[float, float, float, float],
        robot: RobotBody | None,
        around: Surroundings,
    ) -> tuple[float, float]:
        """Of racks, people, and the robot as far as it is known."""
        x, y, vx, vy = state
        ax, ay = self._obstacles.push(x, y)
        px, py = push_of_people(x, y, vx, vy, around.others)
        ax, ay = ax + px, ay + py
        if robot is not None:
            near_x, near_y = robot.nearest_m(x, y)
            # Whoever goes first expects the robot to make way.
            if not self._meeting.goes_first or math.hypot(near_x - x, near_y - y) < _TOO_NEAR_M:
                px, py = push_of_robot(x, y, vx, vy, robot)
                ax, ay = ax + px, ay + py
        return ax, ay

    def _undisturbed(self) -> tuple[float | None, float]:
        """Time and length of the same walk without robot and people; None without an end."""
        if self._free is None:
            self._free = (None, 0.0)
            if self._errand.route.length_m > 0.0:
                self._free = self._walk_alone()
        return self._free

    def _walk_alone(self) -> tuple[float | None, float]:
        spec = self.spec.model_copy(update={"start_s": 0.0})
        alone = Walker(spec, np.random.default_rng(0), self._boxes)
        pauses = sum(stop.for_s for stop in self._errand.route.stops[:-1])
        longest_s = _LONGEST * (self._errand.route.length_m / spec.speed_mps + 5.0) + pauses
        while not alone.arrived:
            alone.advance((alone._tick + 1) * TICK_S, ALONE)
            if alone._tick * TICK_S > longest_s:
                return None, 0.0
        return alone._errand.arrived_s, alone._walked_m


def _pair(x: float, y: float) -> FloatArray:
    return np.array([x, y])


def _without(vx: float, vy: float, nx: float, ny: float) -> tuple[float, float]:
    """A velocity less its part along a direction, if it goes that way."""
    along = max(vx * nx + vy * ny, 0.0)
    return vx - along * nx, vy - along * ny
