"""Step-out impacts: the share and speed of impacts with people who might set off at any time.

An index of what a drive leaves to luck, computed from the log of an episode. docs/measures.md
says what it is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray, finite_number, set_fields

from ...actors.behaviour import LOOK_WITHIN_S, START_SHARES
from ...crossing import STANDING_SPEED_MPS
from ...world.errors import SimError
from ._awareness import requests_of
from ._conflict import Outline

if TYPE_CHECKING:
    from nav_adapter import RobotProfile

    from ...crossing import CrossingResult

#: Faster impacts are counted apart.
FAST_IMPACT_MPS: Final = 0.25
_CROSSINGS: Final = 1000.0
_EVERY_S: Final = 0.1
_DIRECTIONS: Final = 16
# Between two steps somebody at 1.34 m/s and a robot at 1.5 m/s come nearer by 0.14 m.
_STEP_S: Final = 0.05
# Halvings of the step in which an impact begins: to 1.6 ms.
_HALVINGS: Final = 5
# Places that are computed at once, to bound the memory.
_PLACES_AT_ONCE: Final = 200_000


@dataclass(frozen=True, slots=True)
class StepOut:
    """A model of people who step out: the constants of the step-out impacts.

    Attributes:
        speed_mps: speed to which people set off, > 0. The default is the mean of walking people
            (Weidmann 1993).
        time_constant_s: time constant of the approach to that speed, > 0 (0.54 s: Moussaïd et al.
            2009).
        noticed_after_s: time until a start is seen, before the robot's reaction time begins. The
            default lies in the 0.14 to 0.30 s that docs/tracking.md gives.
        start_shares: share of people who start within a second, each in [0, 1), by the last look
            at the robot: now, up to 1 s and up to 4 s ago, longer ago or never. The default was
            recorded at the kerb, before vehicles that move (docs/people.md).

    Raises:
        SimError: for other values.
    """

    speed_mps: float = 1.34
    time_constant_s: float = 0.54
    noticed_after_s: float = 0.2
    start_shares: tuple[float, ...] = START_SHARES["moving"]

    def __post_init__(self) -> None:
        for name, zero_is_valid in (
            ("speed_mps", False),
            ("time_constant_s", False),
            ("noticed_after_s", True),
        ):
            value = finite_number(
                name,
                getattr(self, name),
                SimError,
                minimum=0.0,
                exclusive_minimum=not zero_is_valid,
            )
            set_fields(self, **{name: value})
        shares = tuple(finite_number("start_shares", each, SimError) for each in self.start_shares)
        if len(shares) != len(LOOK_WITHIN_S) + 1 or not all(0.0 <= each < 1.0 for each in shares):
            raise SimError(
                f"start_shares must be {len(LOOK_WITHIN_S) + 1} shares in [0, 1), got {shares}"
            )
        set_fields(self, start_shares=shares)

    def ways(self, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the time (s) for which the velocity at the start counts, and the way (m) ahead.

        After ``t_s`` a person has moved by the velocity at the start times the first, and by the
        second in the direction in which they set off.
        """
        lag_s = -self.time_constant_s * np.expm1(-t_s / self.time_constant_s)
        return lag_s, self.speed_mps * (t_s - lag_s)


#: People as recorded.
STEP_OUT: Final = StepOut()
#: Faster starts than recorded, to see how much a figure rests on the model.
FASTER_STEP_OUT: Final = StepOut(speed_mps=1.6, time_constant_s=0.35)


class StepOutImpacts(NamedTuple):
    """The step-out impacts of one episode with some of its people, NaN without anybody.

    Attributes:
        impacts: expected impacts, per 1 000 such crossings.
        fast: those of them at more than 0.25 m/s.
        worst_mps: the robot's highest closing speed in an impact, 0 without any.
    """

    impacts: float
    fast: float
    worst_mps: float


#: The impacts with nobody there, by the people of an episode: those of
#: :attr:`CrossingResult.noticed`, all of them together, and those who have answered a request.
_NOBODY: Final = dict.fromkeys(
    ("never", "past", "looking", "all", "answered"), StepOutImpacts(*[math.nan] * 3)
)


# Cached, as several measures of an episode need them.
@lru_cache(maxsize=2)
def step_out_impacts(
    log: CrossingResult, model: StepOut = STEP_OUT
) -> Mapping[str, StepOutImpacts]:
    """Return the step-out impacts of a crossing with some of its people each.

    ``"never"`` are people who have never noticed the robot, ``"past"`` those whose last look is
    more than 1 s ago, ``"looking"`` all others; ``"all"`` is their sum. ``"answered"`` are people
    who have answered a request of the robot, whom the others hold, too.

    Every 0.1 s at which the robot moves, each person sets off in each of 16 directions, evenly
    spaced from the robot's heading on, and ignores the robot. The robot keeps its curve, holds its
    speed for its reaction time and ``noticed_after_s``, and brakes; one that turns on the spot
    brakes its farthest corner. An impact is the first touch of the convex hull of its footprint and
    the body circle of 0.30 m, if robot and person then close at more than 0.03 m/s: the base origin
    with the person's centre, plus what turning adds at the touching point. A path through a rack, a
    wall or a prop gives none.
    """
    if not log.anybody:
        return _NOBODY
    t_s = log.t_s
    every = 1
    if len(t_s) > 1:
        every = max(round(_EVERY_S / float(np.median(np.diff(t_s)))), 1)
    instants = np.arange(0, len(t_s), every)
    lasts_s = np.diff(t_s[instants], append=t_s[-1])
    starts = _Starts(log, instants, log.robot, model)
    closing_mps = starts.impacts(log.obstacle_boxes_odom_m)  # (M, 16), 0 without an impact
    rates_hz = -np.log1p(-np.array(model.start_shares))
    places = starts.row, starts.person
    by_look = np.searchsorted(np.array(LOOK_WITHIN_S) + 1e-9, log.since_look_s[places])
    weights = _CROSSINGS / _DIRECTIONS * rates_hz[by_look] * lasts_s[starts.row // every]

    def of(people: NDArray[np.bool_]) -> StepOutImpacts:
        closing, counts = closing_mps[people[places]], weights[people[places]]
        impacts, fast = ((closing > above).sum(axis=1) @ counts for above in (0.0, FAST_IMPACT_MPS))
        return StepOutImpacts(float(impacts), float(fast), float(closing.max(initial=0.0)))

    groups = {
        **log.noticed,
        "all": np.ones(log.looking.shape, dtype=np.bool_),
        "answered": requests_of(log).answered_people,
    }
    return {name: of(people) for name, people in groups.items()}


class _Starts:
    """The M starts that a moving robot can meet before it stands: an instant and a person each.

    Vectors are in the base frame of the instant.
    """

    def __init__(
        self, log: CrossingResult, instants: NDArray[np.intp], robot: RobotProfile, model: StepOut
    ) -> None:
        self._robot, self._model = robot, model
        self._outline = Outline(robot.footprint_m)
        places = log.to_base(log.people_odom_m - log.robot_odom_m[:, None])
        velocities = log.to_base(log.people_odom_mps)
        # That of the farthest corner of a robot that turns on the spot.
        turn_mps = np.abs(log.yaw_rate_radps) * robot.circumscribed_radius_m
        speed = np.maximum(log.travel_mps, turn_mps)[:, None]
        brakes_s = speed / robot.max_deceleration_mps2
        until_s = robot.reaction_time_s + model.noticed_after_s + brakes_s
        reach_m = until_s * np.maximum(np.linalg.norm(velocities, axis=2), model.speed_mps)
        reach_m += speed * (until_s - 0.5 * brakes_s) + self._outline.reach_m + BODY_RADIUS_M
        near = (np.linalg.norm(places, axis=2) <= reach_m) & (speed > STANDING_SPEED_MPS)
        chosen = np.zeros(len(near), dtype=np.bool_)
        chosen[instants] = True
        self.row, self.person = row, person = np.nonzero(near & chosen[:, None])
        self._poses_odom = np.column_stack((log.robot_odom_m, log.heading_odom_rad))[row]
        self._place_m, self._velocity_mps = places[row, person], velocities[row, person]
        self._robot_mps, self._yaw_rate_radps = (
            log.velocity_base_mps[row],
            log.yaw_rate_radps[row],
        )
        self._speed_mps = speed[row, 0]

    def impacts(self, boxes_odom_m: FloatArray) -> FloatArray:
        """Return the (M, 16) closing speeds of the impacts; 0 for a start that ends in none."""
        found = np.zeros((len(self.row), _DIRECTIONS))
        speed = float(self._speed_mps.max(initial=0.0))
        until_s = self._holds_s + speed / self._robot.max_deceleration_mps2
        t_s = np.arange(math.ceil(until_s / _STEP_S) + 1, dtype=np.float64) * _STEP_S
        at_once = max(_PLACES_AT_ONCE // (_DIRECTIONS * len(t_s)), 1)
        for first in range(0, len(self.row), at_once):
            which = np.arange(first, min(first + at_once, len(self.row)))
            start, direction, touch_s = self._touches(which, t_s)
            closing = self._closing_mps(start, direction, touch_s)
            hits = closing > STANDING_SPEED_MPS
            start, direction, touch_s = start[hits], direction[hits], touch_s[hits]
            free = ~self._blocked(start, direction, touch_s, boxes_odom_m)
            found[start[free], direction[free]] = closing[hits][free]
        return found

    def _touches(
        self, which: NDArray[np.intp], t_s: FloatArray
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Return start, direction and time (s) of every first touch, looked for at ``t_s``."""
        everyone = np.arange(_DIRECTIONS)[:, None]
        touch = self._touch(which[:, None, None], everyone, t_s)
        start, direction = np.nonzero(touch.any(axis=2))
        step = touch.argmax(axis=2)[start, direction]
        start = which[start]
        late_s, early_s = t_s[step], t_s[np.maximum(step - 1, 0)]
        for _ in range(_HALVINGS):
            middle_s = 0.5 * (early_s + late_s)
            inside = self._touch(start, direction, middle_s)
            late_s = np.where(inside, middle_s, late_s)
            early_s = np.where(inside, early_s, middle_s)
        return start, direction, late_s

    @property
    def _holds_s(self) -> float:
        """Time for which the robot holds its speed."""
        return self._robot.reaction_time_s + self._model.noticed_after_s

    def _touch(self, start: Any, direction: Any, t_s: FloatArray) -> NDArray[np.bool_]:
        """Return whether body circle and outline touch; the arguments are broadcast."""
        x_m, y_m, _ = self._relative(start, direction, t_s)
        low, high = self._outline.bounds_m
        touch: NDArray[np.bool_] = (
            (x_m >= low[0] - BODY_RADIUS_M)
            & (x_m <= high[0] + BODY_RADIUS_M)
            & (y_m >= low[1] - BODY_RADIUS_M)
            & (y_m <= high[1] + BODY_RADIUS_M)
        )
        # Only beside a box about both can they touch.
        points = np.stack([x_m[touch], y_m[touch]], axis=1)
        touch[touch] = self._outline.distance(points) <= BODY_RADIUS_M
        return touch

    def _closing_mps(
        self, start: NDArray[np.intp], direction: NDArray[np.intp], t_s: FloatArray
    ) -> FloatArray:
        """Return the speed of the base origin towards the person's centre, and that of turning."""
        x_m, y_m, left = self._relative(start, direction, t_s)
        ahead, aside = self._robot_mps[start].T
        closing: FloatArray = (ahead * x_m + aside * y_m) / np.maximum(np.hypot(x_m, y_m), 1e-9)
        centre = np.stack([x_m, y_m], axis=1)
        gap = self._outline.gap(centre)
        touch_x, touch_y = (centre - gap).T
        normal_x, normal_y = (gap / np.maximum(np.hypot(*gap.T), 1e-9)[:, None]).T
        closing += self._yaw_rate_radps[start] * (touch_x * normal_y - touch_y * normal_x)
        return left * closing

    def _relative(
        self, start: Any, direction: Any, t_s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return x and y of people in the base frame then, and the share of its speed left."""
        ahead, aside = self._robot_mps[start, 0], self._robot_mps[start, 1]
        speed = self._speed_mps[start]
        deceleration = self._robot.max_deceleration_mps2
        braking_s = np.clip(t_s - self._holds_s, 0.0, speed / deceleration)
        left = 1.0 - deceleration * braking_s / speed
        # The way driven, as the time that it takes at the present velocity.
        driven_s = np.minimum(t_s, self._holds_s) + 0.5 * (1.0 + left) * braking_s
        turned = self._yaw_rate_radps[start] * driven_s
        # The chord of the curve lies in the middle between both headings.
        chord_s = driven_s * np.sinc(0.5 * turned / np.pi)
        cos, sin = np.cos(0.5 * turned), np.sin(0.5 * turned)
        robot_x_m = chord_s * (cos * ahead - sin * aside)
        robot_y_m = chord_s * (sin * ahead + cos * aside)
        x_m, y_m = self._person_m(start, direction, t_s)
        x_m, y_m = x_m - robot_x_m, y_m - robot_y_m
        cos, sin = np.cos(turned), np.sin(turned)
        return cos * x_m + sin * y_m, cos * y_m - sin * x_m, left

    def _person_m(
        self, start: Any, direction: Any, t_s: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return x and y of people in the base frame of the start."""
        lag_s, way_m = self._model.ways(t_s)
        angle = 2.0 * np.pi / _DIRECTIONS * direction
        return (
            self._place_m[start, 0] + self._velocity_mps[start, 0] * lag_s + np.cos(angle) * way_m,
            self._place_m[start, 1] + self._velocity_mps[start, 1] * lag_s + np.sin(angle) * way_m,
        )

    def _blocked(
        self,
        start: NDArray[np.intp],
        direction: NDArray[np.intp],
        touch_s: FloatArray,
        boxes_odom_m: FloatArray,
    ) -> NDArray[np.bool_]:
        """Return whether a box lies on a person's path; one that they stand in does not count."""
        blocked = np.zeros(len(start), dtype=np.bool_)
        if not len(start):
            return blocked
        t_s = np.minimum(np.arange(0.0, touch_s.max() + _STEP_S, _STEP_S), touch_s[:, None])
        x_m, y_m = self._person_m(start[:, None], direction[:, None], t_s)
        robot_x_m, robot_y_m, heading = self._poses_odom[start].T[..., None]
        cos, sin = np.cos(heading), np.sin(heading)
        x_m, y_m = robot_x_m + cos * x_m - sin * y_m, robot_y_m + sin * x_m + cos * y_m
        for x_min, y_min, x_max, y_max in boxes_odom_m:
            inside = (x_m > x_min) & (x_m < x_max) & (y_m > y_min) & (y_m < y_max)
            blocked |= inside.any(axis=1) & ~inside[:, 0]
        return blocked
