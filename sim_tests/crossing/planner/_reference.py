"""The reference planner: it takes the way that the limit, there and then, lets end soonest."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import speed_limit_at
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._drives import Tick
from ._geometry import Poses, box_gap_m
from ._sampling import CLEARANCE_M
from ._scene import Aim
from ._window import DynamicWindow

# Ways are offsets to the left of the straight line to the goal.
_OFFSETS_M: Final[FloatArray] = np.array(
    [0.0, -0.3, 0.3, -0.6, 0.6, -0.9, 0.9, -1.2, 1.2, -1.4, 1.4]
)
# A way is taken as fast as the limit lets it, or with at most a speed for a time at first: so the
# robot lets somebody pass.
_STARTS: Final[FloatArray] = np.array(
    [(math.inf, 0.0), *((speed, hold) for speed in (0.0, 0.4, 0.8) for hold in (1.5, 3.0, 5.0))]
)
# A plan holds for this time.
_EVERY_S: Final = 0.4
# The limit is computed so far ahead, at places and times so far apart; ways are driven through for
# so long, in the same steps.
_AHEAD_M: Final = 9.0
_PLACES_M: Final = 0.3
_AHEAD_S: Final = 8.0
_DRIVE_S: Final = 12.0
_STEP_S: Final = 0.4
# Length of a change of offset: so many times the offset, and at least so long; and that of the way
# back to the line before the goal.
_CHANGE: Final = 2.2
_SHORTEST_M: Final = 1.2
_BACK_M: Final = 2.5
# Seconds that a way costs beside its time: for a metre of offset, another offset than before, one
# to the left, a way that begins slowly, a place without room, and a limit that falls too fast.
_OFFSET_S: Final = 0.08
_OTHER_S: Final = 0.15
_LEFT_S: Final = 0.02
_SLOW_S: Final = 0.1
_NO_ROOM_S: Final = 3.0
_TOO_FAST_S: Final = 0.5
# People who have noticed the robot may set off all the same. Seconds that a second costs at full
# speed above the limit that would hold if nobody had noticed it. On seeds 46 to 48, 0.7 is worth
# next to nothing, and 3.0 costs time. Speed that cannot fall to the limit in time counts likewise;
# without that the price is worth little more than half.
_TRUST_S: Final = 1.5
# The robot heads for the way so far ahead, and by this time at its speed farther.
_HEAD_M: Final = 1.0
_HEAD_S: Final = 0.6
# Nearer to the goal, the dynamic window arrives alone.
_ARRIVING_M: Final = 1.0
# The limit keeps the robot clear of people; for the window they are bodies and some room.
_ROOM_M: Final = BODY_RADIUS_M + 0.12


class _Line(NamedTuple):
    """The straight line to the goal, from where the robot first heard of it."""

    start_odom_m: FloatArray
    along: FloatArray
    left: FloatArray
    length_m: float


class ReferencePlanner(DynamicWindow):
    """A planner that compares ways past people for twelve seconds ahead, under the limit there.

    Ways lead beside the straight line to the goal, at up to 1.4 m on either side, and begin at once
    or after waiting. The robot drives each of them as fast as
    :func:`~nav_adapter.exporters.speed_limit_at` says for these places and times, while people keep
    to their motion. It follows the one that ends soonest, with the dynamic window. What a way
    leaves to people's attention counts as time, too. So it uses the room of an aisle before it
    needs it, passes people who walk ahead, and goes first only where the limit lets it. Where there
    is no limit to plan with, as without people, the window drives straight to the goal.

    Args:
        robot: footprint and limits; the footprint counts with its bounding rectangle.
        static_boxes_odom_m: (N, 4) fixed obstacles x_min, y_min, x_max, y_max; None for none.

    Raises:
        SimError: if the boxes are not finite or a minimum is not below its maximum.
    """

    def __init__(self, robot: RobotProfile, static_boxes_odom_m: ArrayLike | None = None) -> None:
        super().__init__(robot, static_boxes_odom_m)
        self._line: _Line | None = None
        self._goal_odom_m = np.full(2, math.nan)
        self._plan_stamp_s = -math.inf
        self._offset_m, self._cap_mps, self._holds_s = 0.0, math.inf, 0.0

    def _headed(self, tick: Tick, goal_odom_m: FloatArray, constraints: NavConstraints) -> Tick:
        state, distance_m = tick.state, tick.aim.distance_m
        planned = constraints.speed_basis is not None and constraints.obstacles
        if not planned or distance_m < _ARRIVING_M:
            return tick
        if self._line is None or not np.array_equal(goal_odom_m, self._goal_odom_m):
            self._begin(state, goal_odom_m)
        assert self._line is not None
        line = self._line
        from_start = state.position_odom_m - line.start_odom_m
        s_m, d_m = float(from_start @ line.along), float(from_start @ line.left)
        now = constraints.stamp_s
        if not self._plan_stamp_s <= now < self._plan_stamp_s + _EVERY_S - 1e-9:
            self._plan_stamp_s = now
            self._choose_way(state, constraints, s_m, d_m)
        held = now - self._plan_stamp_s < self._holds_s
        ahead_m = s_m + min(_HEAD_M + _HEAD_S * state.travel_mps, line.length_m - s_m)
        offset_m, _ = self._offsets(np.array([ahead_m]), s_m, d_m, np.array([self._offset_m]))
        place = line.start_odom_m + ahead_m * line.along + float(offset_m[0]) * line.left
        return tick._replace(
            top_mps=min(tick.top_mps, self._cap_mps) if held else tick.top_mps,
            # As far as the goal, so that the way there is worth full speed.
            aim=Aim(distance_m, Aim.at(place, state).bearing_rad),
            scene=tick.scene.within(_ROOM_M),
        )

    def _begin(self, state: RobotState, goal_odom_m: FloatArray) -> None:
        """Lay the line to a new goal."""
        to_goal = goal_odom_m - state.position_odom_m
        length_m = float(np.hypot(*to_goal))
        along = to_goal / length_m
        left = np.array([-along[1], along[0]])
        self._line = _Line(np.array(state.position_odom_m), along, left, length_m)
        self._goal_odom_m = np.array(goal_odom_m)
        self._plan_stamp_s = -math.inf
        self._offset_m, self._cap_mps, self._holds_s = 0.0, math.inf, 0.0

    def _offsets(
        self, s_m: FloatArray, from_s_m: float, from_d_m: float, offset_m: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return offset and slope of ways at places along the line, which change from the robot."""
        assert self._line is not None
        length_m = np.maximum(_SHORTEST_M, _CHANGE * np.abs(offset_m - from_d_m))
        share = np.clip((s_m - from_s_m) / length_m, 0.0, 1.0)
        back = np.clip((self._line.length_m - s_m) / _BACK_M, 0.0, 1.0)
        go_m = from_d_m + (offset_m - from_d_m) * _smooth(share)
        slope = (offset_m - from_d_m) * _smooth_slope(share) / length_m * _smooth(back)
        slope = slope - go_m * _smooth_slope(back) / _BACK_M
        return go_m * _smooth(back), slope

    def _choose_way(
        self, state: RobotState, constraints: NavConstraints, s_m: float, d_m: float
    ) -> None:
        """Choose offset and first speed of the way that ends soonest."""
        assert self._line is not None
        line = self._line
        reach_m = min(_AHEAD_M, max(line.length_m - s_m, _PLACES_M))
        places_m = s_m + np.arange(0.0, reach_m + _PLACES_M, _PLACES_M)
        offsets_m, slopes = self._offsets(places_m, s_m, d_m, _OFFSETS_M[:, None])  # (ways, places)
        positions = (
            line.start_odom_m + places_m[:, None] * line.along + offsets_m[:, :, None] * line.left
        )
        headings = math.atan2(line.along[1], line.along[0]) + np.arctan(slopes)
        times = round(_AHEAD_S / _STEP_S) + 1
        poses = positions.reshape(-1, 1, 2).repeat(times, axis=1)
        turned_rad = headings.reshape(-1, 1).repeat(times, axis=1)

        def limits(aware_for_s: float = math.inf) -> FloatArray:
            there_mps: FloatArray = speed_limit_at(
                constraints, poses, turned_rad, dt_s=_STEP_S, aware_for_s=aware_for_s
            )
            return there_mps.reshape(*headings.shape, times)

        limits_mps = unnoticed_mps = limits()
        if any(person.awareness_lower > 0.0 for person in constraints.obstacles):
            unnoticed_mps = limits(aware_for_s=0.0)
        outline = self._footprint.at(
            Poses(positions[..., 0], positions[..., 1], np.cos(headings), np.sin(headings))
        )
        room = box_gap_m(outline, self._boxes_odom_m) >= CLEARANCE_M
        stretch = np.hypot(1.0, slopes)
        field = _Field(limits_mps, unnoticed_mps, room, stretch, reach_m)
        price_s = _OFFSET_S * np.abs(_OFFSETS_M) + _LEFT_S * (_OFFSETS_M > 0.0)
        price_s = price_s + _OTHER_S * (np.abs(_OFFSETS_M - self._offset_m) > 1e-6)
        cost_s = price_s[:, None] + _SLOW_S * (np.arange(len(_STARTS)) > 0)
        cost_s += field.drive_s(self.robot, max(state.travel_mps, 0.0), line.length_m - s_m)
        way, start = divmod(int(np.argmin(cost_s)), len(_STARTS))
        self._offset_m = float(_OFFSETS_M[way])
        self._cap_mps, self._holds_s = _STARTS[start].tolist()


class _Field(NamedTuple):
    """The limits and the room along ways.

    Attributes:
        limits_mps: (ways, places, times).
        unnoticed_mps: the same if nobody had noticed the robot.
        room: (ways, places), whether the robot has room between boxes.
        stretch: (ways, places), length of a way over that of the line.
        reach_m: of the places along the line.
    """

    limits_mps: FloatArray
    unnoticed_mps: FloatArray
    room: NDArray[np.bool_]
    stretch: FloatArray
    reach_m: float

    def drive_s(self, robot: RobotProfile, speed_mps: float, rest_m: float) -> FloatArray:
        """Return the seconds (ways, starts) to the end of each way, penalties, and price."""
        brakes, gains = robot.max_deceleration_mps2, robot.max_acceleration_mps2
        fastest_mps = robot.max_speed_mps
        cap_mps, hold_s = _STARTS.T
        ways, places, times = self.limits_mps.shape
        way = np.arange(ways)[:, None]
        s_m, v = np.zeros((ways, len(_STARTS))), np.full((ways, len(_STARTS)), speed_mps)
        arrives_s, penalty_s, trust_m = np.full(s_m.shape, math.inf), 0.0 * s_m, 0.0 * s_m
        for step in range(round(_DRIVE_S / _STEP_S)):
            t_s = step * _STEP_S
            place = np.minimum(s_m / _PLACES_M, places - 1.001)
            index = place.astype(np.intp)
            share = place - index
            column = min(step, times - 1)
            now = self.limits_mps[:, :, column]
            limit = (1.0 - share) * now[way, index] + share * now[way, index + 1]
            unnoticed = self.unnoticed_mps[way, index, column]
            beyond = s_m > self.reach_m
            limit, unnoticed = (np.where(beyond, fastest_mps, each) for each in (limit, unnoticed))
            left_m = np.maximum(rest_m - s_m, 0.0)
            moves = (v > 0.05) & np.isinf(arrives_s)
            penalty_s += np.where(moves & ~self.room[way, index], _NO_ROOM_S * _STEP_S, 0.0)
            too_fast = v - limit - 1.2 * brakes * _STEP_S
            penalty_s += np.where(moves & (too_fast > 0.0), _TOO_FAST_S * (v - limit), 0.0)
            trust_m += np.where(moves, np.maximum(v - unnoticed, 0.0) * _STEP_S, 0.0)
            wanted = np.minimum(limit, np.where(t_s < hold_s, cap_mps, fastest_mps))
            wanted = np.minimum(wanted, np.sqrt(1.2 * brakes * left_m))
            after = np.clip(wanted, v - brakes * _STEP_S, v + gains * _STEP_S)
            after = np.maximum(after, 0.0)
            s_m = s_m + 0.5 * (v + after) * _STEP_S / self.stretch[way, index]
            v = after
            arrived = (rest_m - s_m < 0.12) & np.isinf(arrives_s)
            arrives_s = np.where(arrived, t_s + _STEP_S, arrives_s)
        left_m = np.maximum(rest_m - s_m, 0.0)
        later_s = _DRIVE_S + left_m / fastest_mps + 0.5 * (fastest_mps - v) / gains
        # Where somebody stands in the way until the forecast ends, nobody knows how long the robot
        # will wait. It seems to lose nothing by a slow start, but they may leave sooner. So a slow
        # start does not lower the price there.
        ends = np.isfinite(arrives_s)
        trust_m = np.where(ends, trust_m, np.maximum(trust_m, trust_m[:, :1]))
        price_s = penalty_s + _TRUST_S / fastest_mps * trust_m
        return np.asarray(np.where(ends, arrives_s, later_s) + price_s)


def _smooth(share: FloatArray) -> FloatArray:
    """Return a step from 0 to 1 with level ends."""
    return share * share * (3.0 - 2.0 * share)


def _smooth_slope(share: FloatArray) -> FloatArray:
    return 6.0 * share * (1.0 - share)
