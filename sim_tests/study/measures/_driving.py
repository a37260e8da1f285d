"""The robot's driving: path, stops, deceleration and jerk, and whether its planner obeys limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

from ...world.errors import SimError

if TYPE_CHECKING:
    from nav_adapter import RobotProfile

    from ...crossing import ContactEvent, CrossingFrame, CrossingResult

#: Width of the parabola that smooths the speed; docs/measures.md gives its frequency response.
SMOOTHED_OVER_S: Final = 0.5
_DEGREE: Final = 2
#: A robot counts as moving above this speed; it stops when it falls below the standing speed.
MOVING_SPEED_MPS: Final = 0.10
#: Overshoot of the wheel motors on a ramp, about; a smaller excess breaks no limit.
OVERSHOOT_MPS: Final = 0.03


def path_length_m(positions_m: FloatArray) -> float:
    """Return the length of the polyline through (N, 2) positions."""
    steps = np.diff(positions_m, axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def fastest_mps(contacts: Iterable[ContactEvent]) -> float | None:
    """Return the robot's highest speed at some contacts; None for none."""
    return max((each.robot_speed_mps for each in contacts), default=None)


def success_weighted(
    success: bool | None, actual: float | None, best: float | None
) -> float | None:
    """Return S · l / max(p, l): SPL of lengths (Anderson et al. 2018, equation 1), STL of times.

    Args:
        success: S.
        actual: p ≥ 0, the length or time of the episode; not used without success.
        best: l, that of the same task without people.

    Returns:
        None where success or ``best`` is not known.
    """
    if success is None or best is None or best <= 0.0 or (success and actual is None):
        return None
    return best / max(actual or 0.0, best) if success else 0.0


def count_stops(speeds_mps: FloatArray, stands: NDArray[np.bool_], arrived: bool) -> int:
    """Return how often the robot came to a stand.

    After a stop, it must exceed :data:`MOVING_SPEED_MPS` before it can stop again.

    Args:
        speeds_mps: (N,) speeds, signed or not.
        stands: (N,) whether the robot stands.
        arrived: the goal was reached at the end; standing at the goal is not a stop.
    """
    stops, moving = 0, False
    for speed, still in zip(np.abs(speeds_mps).tolist(), stands.tolist(), strict=True):
        if speed > MOVING_SPEED_MPS:
            moving = True
        elif still and moving:
            stops, moving = stops + 1, False
    return stops - 1 if stops and arrived and not moving else stops


def peak_deceleration_and_jerk(
    t_s: FloatArray, velocities_mps: FloatArray
) -> tuple[float | None, float | None]:
    """Return the highest deceleration (m/s²) and the largest jerk (m/s³) of the actual velocity.

    They are the first and second derivatives of a parabola fitted to the velocities within ±0.25 s
    of each instant (Savitzky and Golay 1964). The first and last 0.25 s have no full window and are
    left out. Deceleration is the decrease of the speed; 0 if it never decreased. In the base frame
    the turning of a robot counts for neither.

    Args:
        t_s: (N,) evenly spaced.
        velocities_mps: (N,) signed speeds, or (N, 2) velocities in the base frame.

    Returns:
        None and None for an episode shorter than the window.
    """
    if len(t_s) < 2:
        return None, None
    dt_s = float(t_s[-1] - t_s[0]) / (len(t_s) - 1)
    window = _window_samples(dt_s)
    if len(t_s) < window:
        return None, None
    # Heavy; processes that only read runs do without.
    from scipy.ndimage import convolve1d  # noqa: PLC0415

    whole = slice(window // 2, len(t_s) - window // 2)
    velocity = velocities_mps.reshape(len(t_s), -1)
    slope, curvature = (
        convolve1d(velocity, _derivative_weights(window, order, dt_s), axis=0)[whole]
        for order in (1, 2)
    )
    speed = np.linalg.norm(velocity[whole], axis=1)
    moving = speed > 0.0
    deceleration = -np.sum(slope * velocity[whole], axis=1)[moving] / speed[moving]
    return (float(deceleration.max(initial=0.0)), float(np.linalg.norm(curvature, axis=1).max()))


def _derivative_weights(window: int, order: int, dt_s: float) -> FloatArray:
    """Return the weights of a window that give the derivative of the fit in its middle.

    They are those of ``scipy.signal.savgol_filter``, whose import takes every process 0.3 s.
    """
    from scipy.linalg import lstsq  # noqa: PLC0415

    offsets = np.arange(window // 2, -(window // 2) - 1, -1, dtype=float)
    powers = np.arange(_DEGREE + 1)
    wanted = np.where(powers == order, math.factorial(order) / dt_s**order, 0.0)
    return np.asarray(lstsq(offsets ** powers[:, None], wanted)[0])


def _window_samples(dt_s: float) -> int:
    """Return the odd number of speeds in the window of a fit."""
    return max(2 * round(0.5 * SMOOTHED_OVER_S / dt_s) + 1, _DEGREE + 3)


@dataclass(frozen=True, slots=True)
class Conduct:
    """The conduct of a planner in one episode.

    None stands for an episode that is too short, or that has no limit of this kind.

    Attributes:
        limit_excess_mps: see :func:`limit_excess_mps`.
        fastest_point_excess_mps: see :func:`fastest_point_excess_mps`.
        plan_calls: number of calls of ``plan``.
        plan_median_s: median processor time of a call.
        plan_p99_s: 99th percentile of it.
        cycle_s: time between two calls in the simulation, which a call should not exceed.
    """

    limit_excess_mps: float | None
    fastest_point_excess_mps: float | None
    plan_calls: int
    plan_median_s: float
    plan_p99_s: float
    cycle_s: float

    @classmethod
    def of(cls, result: CrossingResult) -> Conduct:
        """Return the conduct of the planner of a crossing.

        Raises:
            SimError: the result has no frames.
        """
        frames = result.frames
        if not frames:
            raise SimError("a conduct needs at least one control cycle, got a result without any")
        times_s = np.array([frame.plan_s for frame in frames])
        cycle_s = frames[1].t_s - frames[0].t_s if len(frames) > 1 else 0.0
        return cls(
            limit_excess_mps(frames, result.robot),
            fastest_point_excess_mps(frames, result.robot),
            len(frames),
            float(np.median(times_s)),
            float(np.quantile(times_s, 0.99)),
            cycle_s,
        )


def limit_excess_mps(frames: Sequence[CrossingFrame], robot: RobotProfile) -> float | None:
    """Return the largest excess of the speed over the allowed one, m/s.

    The speed is that in the direction of travel, whatever the heading. Allowed is
    ``speed_limit_mps`` of the cycle before. Where the limit falls faster than the robot can brake,
    full braking from the allowed speed of the cycle before is allowed as well. So the excess of a
    robot that does not brake grows until it is the whole difference to the limit. It is negative
    for a robot that was always slower than allowed, and None for fewer than two cycles.
    """
    return _largest_excess(
        frames,
        robot,
        [frame.robot_state.travel_mps for frame in frames],
        [frame.constraints.speed_limit_mps for frame in frames],
    )


def fastest_point_excess_mps(frames: Sequence[CrossingFrame], robot: RobotProfile) -> float | None:
    """Return the largest excess of |v| + |ω| R over the allowed value, m/s.

    R is the circumscribed radius, so |v| + |ω| R bounds the speed of every point of the footprint.
    Allowed is ``fastest_point_limit_mps`` of the cycle before, with the same allowance for braking
    as in :func:`limit_excess_mps`. None if no cycle has such a limit.
    """
    radius_m = robot.circumscribed_radius_m
    motions = [Motion.of(frame.robot_state) for frame in frames]
    limits = [frame.constraints.fastest_point_limit_mps for frame in frames]
    return _largest_excess(
        frames,
        robot,
        [motion.fastest_mps(radius_m) for motion in motions],
        [math.inf if limit is None else limit for limit in limits],
    )


def _largest_excess(
    frames: Sequence[CrossingFrame],
    robot: RobotProfile,
    speeds_mps: Sequence[float],
    limits_mps: Sequence[float],
) -> float | None:
    """Return the largest excess of a speed over its limit of the cycle before, or over braking."""
    allowed_mps = math.inf
    largest: float | None = None
    for before, after in itertools.pairwise(range(len(frames))):
        fall_mps = robot.max_deceleration_mps2 * (frames[after].t_s - frames[before].t_s)
        braked_mps = min(speeds_mps[before], allowed_mps) - fall_mps
        allowed_mps = max(limits_mps[before], braked_mps)
        if math.isfinite(allowed_mps):
            excess_mps = speeds_mps[after] - allowed_mps
            largest = excess_mps if largest is None else max(largest, excess_mps)
    return largest


def late_s(frames: Iterable[CrossingFrame]) -> list[float]:
    """Return how late each control cycle in real time began; empty without a stack outside."""
    return [each.late_s for each in frames if each.late_s is not None]
