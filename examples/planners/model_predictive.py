"""A nonlinear model-predictive controller in do-mpc (``pip install do-mpc``, LGPL-3.0 licence).

The adapter's output enters as time-varying parameters, because it and its prediction over the
stages change every cycle.
"""

from __future__ import annotations

import contextlib
import math
import warnings

import casadi
import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.exporters import predicted_circles, speed_limit_at
from perception.arrays import FloatArray

from ._shared import direction_to_goal, no_boxes, obeying

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # about optional parts that are not installed
    import do_mpc

# do-mpc passes casadi objects to numpy; newer releases of casadi require consent to that.
with contextlib.suppress(AttributeError):
    casadi.GlobalOptions.setNumpyMode(-1)

_STAGES = 20
_STAGE_S = 0.15
_SLOTS = 4
# Walls per stage: the nearest ones to the last plan.
_WALLS = 2
_FAR_M = 100.0
_WALL_CLEARANCE_M = 0.05
# Step of the slopes of the limit, and the slowest limit that a plan counts with: at 0 there would
# be no way to the other side of a slow place.
_SLOPE_M = 0.05
_SLOWEST_MPS = 0.05
_MAX_YAW_RATE_RADPS = 1.0
# Cost of a stage's excess over limit or circle; soft, so that there always is a solution.
_PENALTY = 1000.0
_QUIET = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 60}


class ModelPredictivePlanner:
    """A planner for a differential drive that optimises the next three seconds.

    States are x, y, heading and speed; inputs are acceleration and yaw rate. People are soft
    constraints on the distance to their predicted position at each stage. The speed limit is a soft
    constraint too. It falls over the stages no faster than the robot brakes, because a hard bound
    below the present speed would leave the solver without a solution.

    With the speed field, each stage has the limit at its pose in the last plan, and its slope
    there. So the solver knows on which side the limit is higher, and the plan moves to that side.
    It aims at the fastest way instead of the goal.

    Args:
        robot: footprint and limits.
        replan_s: time for which a solution is held.
        static_boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max of racks and walls, None for none.
            They are soft constraints too: a half-plane at the nearest point of each box.
        use_speed_field: plan with the limit at each place, not only with the present one.
    """

    def __init__(
        self,
        robot: RobotProfile,
        replan_s: float = 0.1,
        *,
        static_boxes_odom_m: FloatArray | None = None,
        use_speed_field: bool = True,
    ) -> None:
        self._robot = robot
        self._replan_s = replan_s
        self._planned_s = -math.inf
        self._command = (0.0, 0.0)
        self._times_s = _STAGE_S * np.arange(_STAGES + 1)
        self._people = np.zeros((_SLOTS, _STAGES + 1, 5))
        # Per stage: limit = cap + slope · position, and walls as normal · position ≥ bound.
        self._caps = np.zeros((_STAGES + 1, 3))
        self._walls = np.zeros((_STAGES + 1, _WALLS, 3))
        self._boxes = no_boxes(static_boxes_odom_m)
        self._use_speed_field = use_speed_field
        self._goal = np.zeros(2)
        self._mpc = self._controller(self._model())
        self._started = False

    def plan(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        dt_s: float,
    ) -> tuple[float, float]:
        """Return speed (m/s) and yaw rate (rad/s)."""
        limit_mps = min(constraints.speed_limit_mps, self._robot.max_speed_mps)
        if robot_state.stamp_s - self._planned_s >= self._replan_s - 1e-9:
            self._planned_s = robot_state.stamp_s
            self._command = self._solve(robot_state, goal_odom_m, constraints, limit_mps)
        speed, yaw_rate = self._command
        twist = (min(max(speed, 0.0), limit_mps), yaw_rate)
        return obeying(constraints, robot_state, twist, dt_s)

    def _solve(
        self,
        robot_state: RobotState,
        goal_odom_m: FloatArray,
        constraints: NavConstraints,
        limit_mps: float,
    ) -> tuple[float, float]:
        """Return the first speed and yaw rate of the optimal plan."""
        speed = robot_state.speed_mps
        positions = self._last_positions(robot_state, goal_odom_m, limit_mps)
        self._caps = self._limits(constraints, robot_state, positions, limit_mps)
        self._walls = self._half_planes(positions)
        self._people = predicted_circles(
            constraints,
            self._times_s,
            slots=_SLOTS,
            robot_position_odom_m=robot_state.position_odom_m,
        )
        self._goal = self._aim(constraints, robot_state, goal_odom_m)
        heading = robot_state.heading_odom_rad
        state = np.array([[*robot_state.position_odom_m, heading, speed]]).T
        if not self._started:
            self._mpc.x0 = state
            self._mpc.set_initial_guess()
            self._started = True
        acceleration, yaw_rate = self._mpc.make_step(state).ravel().tolist()
        # The speed after the stage is the command for the drive.
        return speed + acceleration * _STAGE_S, yaw_rate

    def _aim(
        self, constraints: NavConstraints, robot_state: RobotState, goal_odom_m: FloatArray
    ) -> FloatArray:
        """Return the goal (2,) or, with the field, a point as far away on the fastest way.

        The horizon ends before a slow place, and the way around it begins earlier.
        """
        far_m = float(np.hypot(*(goal_odom_m - robot_state.position_odom_m)))
        towards = direction_to_goal(
            constraints,
            robot_state,
            goal_odom_m,
            self._boxes,
            self._robot.circumscribed_radius_m + _WALL_CLEARANCE_M,
            use_speed_field=self._use_speed_field,
        )
        return np.asarray(robot_state.position_odom_m + far_m * towards)

    def _last_positions(
        self, robot_state: RobotState, goal_odom_m: FloatArray, limit_mps: float
    ) -> FloatArray:
        """Return (T, 2) positions of the last plan, or straight to the goal before the first."""
        if self._started:
            states = [self._mpc.opt_x_num["_x", stage, 0, -1] for stage in range(_STAGES + 1)]
            return np.array([np.ravel(state)[:2] for state in states], dtype=np.float64)
        to_goal = goal_odom_m - robot_state.position_odom_m
        ahead = to_goal / max(float(np.hypot(*to_goal)), 1e-9)
        return np.asarray(robot_state.position_odom_m + limit_mps * self._times_s[:, None] * ahead)

    def _limits(
        self,
        constraints: NavConstraints,
        robot_state: RobotState,
        positions: FloatArray,
        limit_mps: float,
    ) -> FloatArray:
        """Return (T, 3) rows c, gx, gy: the speed of a stage at (x, y) is at most c + gx·x + gy·y.

        The limit falls no faster than the robot brakes.
        """
        braked = robot_state.speed_mps - self._robot.max_deceleration_mps2 * self._times_s
        caps = np.zeros((_STAGES + 1, 3))
        caps[:, 0] = np.maximum(limit_mps, braked)
        if not self._use_speed_field:
            return caps
        shifts = _SLOPE_M * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        at, right, left, up, down = speed_limit_at(
            constraints, positions + shifts[:, None], dt_s=_STAGE_S
        )
        caps[:, 1] = (right - left) / (2.0 * _SLOPE_M)
        caps[:, 2] = (up - down) / (2.0 * _SLOPE_M)
        caps[:, 0] = np.maximum(np.maximum(at, _SLOWEST_MPS), braked)
        caps[:, 0] -= (caps[:, 1:] * positions).sum(axis=1)
        return caps

    def _half_planes(self, positions: FloatArray) -> FloatArray:
        """Return (T, W, 3) rows nx, ny, b: the robot is clear of a wall if nx·x + ny·y ≥ b."""
        rows = np.tile([0.0, 0.0, -_FAR_M], (_STAGES + 1, _WALLS, 1))
        for stage, position in enumerate(positions):
            nearest = np.clip(position, self._boxes[:, :2], self._boxes[:, 2:])
            away = position - nearest
            distance = np.hypot(*away.T)
            for slot, index in enumerate(np.argsort(distance)[:_WALLS]):
                if distance[index] > 0.0:  # inside a box there is no normal
                    normal = away[index] / distance[index]
                    reach = self._robot.circumscribed_radius_m + _WALL_CLEARANCE_M
                    rows[stage, slot] = [*normal, normal @ nearest[index] + reach]
        return rows

    def _model(self) -> do_mpc.model.Model:
        """Return the robot's motion, with the parameters of goal, limit and people."""
        model = do_mpc.model.Model("continuous")
        x, y, heading, speed = (
            model.set_variable("_x", name) for name in ("x", "y", "heading", "speed")
        )
        acceleration = model.set_variable("_u", "acceleration")
        yaw_rate = model.set_variable("_u", "yaw_rate")
        for name in ("goal_x", "goal_y", "cap", "cap_x", "cap_y"):
            model.set_variable("_tvp", name)
        for slot in range(_WALLS):
            for name in ("wx", "wy", "wb"):
                model.set_variable("_tvp", f"{name}{slot}")
        for slot in range(_SLOTS):
            for name in ("px", "py", "pr"):
                model.set_variable("_tvp", f"{name}{slot}")
        model.set_rhs("x", speed * casadi.cos(heading))
        model.set_rhs("y", speed * casadi.sin(heading))
        model.set_rhs("heading", yaw_rate)
        model.set_rhs("speed", acceleration)
        away = casadi.hypot(model.tvp["goal_x"] - x, model.tvp["goal_y"] - y + 1e-6)
        model.set_expression("away", away)
        model.setup()
        return model

    def _controller(self, model: do_mpc.model.Model) -> do_mpc.controller.MPC:
        """Return the controller with its objective and constraints."""
        mpc = do_mpc.controller.MPC(model)
        mpc.settings.n_horizon = _STAGES
        mpc.settings.t_step = _STAGE_S
        mpc.settings.collocation_deg = 1
        mpc.settings.nlpsol_opts = _QUIET
        mpc.settings.store_full_solution = False
        mpc.set_objective(mterm=model.aux["away"], lterm=model.aux["away"])
        mpc.set_rterm(acceleration=0.05, yaw_rate=0.5)
        robot = self._robot
        mpc.bounds["lower", "_u", "acceleration"] = -robot.max_deceleration_mps2
        mpc.bounds["upper", "_u", "acceleration"] = robot.max_acceleration_mps2
        mpc.bounds["lower", "_u", "yaw_rate"] = -_MAX_YAW_RATE_RADPS
        mpc.bounds["upper", "_u", "yaw_rate"] = _MAX_YAW_RATE_RADPS
        soft = {"ub": 0.0, "soft_constraint": True, "penalty_term_cons": _PENALTY}
        x, y = model.x["x"], model.x["y"]
        cap = model.tvp["cap"] + model.tvp["cap_x"] * x + model.tvp["cap_y"] * y
        mpc.set_nl_cons("over_cap", model.x["speed"] - cap, **soft)
        for slot in range(_WALLS):
            along = model.tvp[f"wx{slot}"] * x + model.tvp[f"wy{slot}"] * y
            mpc.set_nl_cons(f"wall{slot}", model.tvp[f"wb{slot}"] - along, **soft)
        mpc.set_nl_cons("backward", -model.x["speed"], **soft)
        for slot in range(_SLOTS):
            gap_x = x - model.tvp[f"px{slot}"]
            gap_y = y - model.tvp[f"py{slot}"]
            reach = model.tvp[f"pr{slot}"] + robot.circumscribed_radius_m
            mpc.set_nl_cons(f"person{slot}", reach - casadi.hypot(gap_x, gap_y + 1e-6), **soft)
        template = mpc.get_tvp_template()

        def tvp(_: float) -> object:
            for stage in range(_STAGES + 1):
                template["_tvp", stage, "goal_x"] = self._goal[0]
                template["_tvp", stage, "goal_y"] = self._goal[1]
                for name, value in zip(("cap", "cap_x", "cap_y"), self._caps[stage], strict=True):
                    template["_tvp", stage, name] = value
                for slot, row in enumerate(self._walls[stage]):
                    for name, value in zip(("wx", "wy", "wb"), row, strict=True):
                        template["_tvp", stage, f"{name}{slot}"] = value
                for slot, (px, py, _, _, pr) in enumerate(self._people[:, stage]):
                    template["_tvp", stage, f"px{slot}"] = px
                    template["_tvp", stage, f"py{slot}"] = py
                    template["_tvp", stage, f"pr{slot}"] = pr
            return template

        mpc.set_tvp_fun(tvp)
        mpc.setup()
        return mpc
