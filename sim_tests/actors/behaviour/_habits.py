"""Habits of simulated people as data: by hand, or fitted to recorded people."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from awarenav.errors import did_you_mean
from tracking.people import NOTICING_S

from ...conditions import POPULATIONS, PopulationName
from ...world.errors import SimError
from ._gaze import EyeRest
from ._hearing import Hearing
from ._route import DesiredVelocity
from ._spec import PersonSpec
from ._starting import StartingModel
from ._surroundings import RobotBody

#: The population of a scenario that names none.
DEFAULT_POPULATION: Final[PopulationName] = "classic"

# Fitted to recorded people, see docs/people.md.
_SPEED_MPS: Final = (1.42, 0.09)
_HURRY_SHARE: Final = 0.04
_HURRY_MPS: Final = (1.9, 2.5)
#: Highest speed of recorded people, unless the scenario has a higher one.
FASTEST_RECORDED_MPS: Final = _HURRY_MPS[1]
# Speeds of somebody who dawdles or runs in the scenario are kept.
_DAWDLING_MPS: Final = 0.95
_RUNNING_MPS: Final = 1.8
_LOOKER_SHARE: Final = 0.886
_GLANCE_MEDIAN_S: Final = 0.60
_GLANCE_QUARTILES_S: Final = (0.336, 1.072)
_AWAY_MEDIAN_S: Final = 1.80
_AWAY_QUARTILES_S: Final = (1.24, 2.61)
# People with nowhere to go try this many directions; each try is nearer by this factor.
_ERRAND_TRIES: Final = 8
_NEARER: Final = 0.8
# The variation follows the speed with this time constant.
_SHARE_S: Final = 0.4


@dataclass(frozen=True, slots=True)
class VariationFigures:
    """Figures of the variation of a walk about its desired velocity, fitted to recorded people.

    A wandering velocity is a smooth random process: white noise through two equal low-pass filters.

    Attributes:
        pace_mps: standard deviation of the pace, along the path.
        pace_s: time constant of its filters.
        wander_mps: standard deviation of the velocity across the path.
        wander_s: time constant of its filters.
        sway_m: median amplitude of the sway from foot to foot, across the path.
        sway_sigma: standard deviation of the amplitude's logarithm, between people.
        stride_hz: mean frequency of the stride at 1.3 m/s, two steps.
        stride_sigma: standard deviation of the frequency's logarithm, between people.
        step_mps: median amplitude of the velocity along the path with each step.
    """

    pace_mps: float
    pace_s: float
    wander_mps: float
    wander_s: float
    sway_m: float
    sway_sigma: float
    stride_hz: float
    stride_sigma: float
    step_mps: float


@dataclass(frozen=True, slots=True)
class Habits:
    """The habits of the people of a population.

    Attributes:
        variation: of the walk; None walks as desired.
        people_share: strength of the force of other people.
        eye_spread_rad: standard deviation of the yaw in the head at which the eyes come to rest.
        noticing_s: time constant with which looks at the robot take it in, see
            :data:`tracking.people.NOTICING_S`; 0 at once.
        idle_share: share of people with nowhere to go who start within a second.
        near_robot_share: share of the speed that people keep near a robot that they know of.
        near_robot_m: distance from the robot that is near.
        errand_m: median length of the way of somebody who walks off with nowhere to go.
        errand_sigma: standard deviation of its logarithm.
        errand_mps: mean and standard deviation of the speed on it.
    """

    variation: VariationFigures | None = None
    people_share: float = 1.0
    eye_spread_rad: float = 0.0
    noticing_s: float = 0.0
    idle_share: float = 0.0
    near_robot_share: float = 1.0
    near_robot_m: float = 12.0
    errand_m: float = 1.3
    errand_sigma: float = 0.8
    errand_mps: tuple[float, float] = (0.9, 0.25)


#: Habits by hand: people keep to their specification.
CLASSIC: Final = Habits()
#: Habits as fitted to recorded people. Speed and glances are drawn, see :func:`draw_person`. The
#: pace varies, the body sways, and the eyes turn in the head. A person who stands may start at any
#: time, whether or not they have looked at the robot: somebody on the way or waiting goes on, and
#: somebody with nowhere to go walks off in a direction that is free.
RECORDED: Final = Habits(
    variation=VariationFigures(
        pace_mps=0.08,
        pace_s=0.25,
        wander_mps=0.07,
        wander_s=0.4,
        sway_m=0.0255,
        sway_sigma=0.36,
        stride_hz=0.93,
        stride_sigma=0.06,
        step_mps=0.05,
    ),
    people_share=1.7,
    eye_spread_rad=math.radians(10.0),
    noticing_s=NOTICING_S,
    idle_share=0.08,
    near_robot_share=0.91,
)
_HABITS: Final[dict[PopulationName, Habits]] = {"classic": CLASSIC, "recorded": RECORDED}


def known_population(name: str) -> PopulationName:
    """Return the name of a population; raise SimError for any other name."""
    for known in POPULATIONS:
        if name == known:
            return known
    raise SimError(f"population must be one of {', '.join(POPULATIONS)}, got {name!r}")


def population_of(text: str) -> tuple[PopulationName | None, dict[str, float]]:
    """Return the population and the numbers of :class:`Hearing` that a text names.

    Args:
        text: ``"recorded"``, ``"recorded,answers=0.8,startles=0.2"``, or ``"answers=0.3"`` for
            other numbers alone, without a population.

    Raises:
        SimError: for an unknown population or number, and a value that is not possible.
    """
    first, *others = text.split(",")
    name = None if "=" in first else known_population(first)
    pairs = others if name else [first, *others]
    valid = tuple(Hearing.model_fields)
    numbers: dict[str, float] = {}
    for pair in pairs:
        key, equals, value = (part.strip() for part in pair.partition("="))
        if not equals or key not in valid:
            raise SimError(
                f"population may be followed by KEY=VALUE of how people hear a request, with the "
                f"keys {', '.join(valid)}, got {pair!r} in {text!r}{did_you_mean(key, valid)}"
            )
        if key in numbers:
            raise SimError(f"population names {key} twice, got {text!r}")
        try:
            numbers[key] = float(value)
        except ValueError:
            raise SimError(f"{key} of a population must be a number, got {pair!r}") from None
    return name, numbers


def habits_of(population: str) -> Habits:
    """Return the habits of the people of a population."""
    return _HABITS[known_population(population)]


def draw_person(spec: PersonSpec, rng: np.random.Generator) -> PersonSpec:
    """Return a person with the same task, and with a recorded person's speed and glances.

    Somebody who runs or dawdles keeps the speed, and somebody who watches the robot goes on
    watching it. Somebody who is to stay as written keeps everything.
    """
    if spec.as_written:
        return spec
    speed, hurries = float(rng.normal(*_SPEED_MPS)), rng.random() < _HURRY_SHARE
    hurry = float(rng.uniform(*_HURRY_MPS))
    return _as_recorded(spec, hurry if hurries else max(speed, 0.5))


def median_person(spec: PersonSpec) -> PersonSpec:
    """Return the person of :func:`draw_person` with every draw at its median, to stay as written.

    Whether somebody looks at all remains a draw, with the recorded share.
    """
    if spec.as_written:
        return spec
    return _as_recorded(spec, _SPEED_MPS[0]).model_copy(update={"as_written": True})


def _as_recorded(spec: PersonSpec, speed_mps: float) -> PersonSpec:
    """Return a person with recorded glances, and with a speed unless the task has a special one."""
    changes: dict[str, Any] = {}
    if _DAWDLING_MPS < spec.speed_mps < _RUNNING_MPS:
        changes["speed_mps"] = speed_mps
    glances = {
        "glance_median_s": _GLANCE_MEDIAN_S,
        "glance_quartiles_s": _GLANCE_QUARTILES_S,
        "away_median_s": _AWAY_MEDIAN_S,
        "away_quartiles_s": _AWAY_QUARTILES_S,
    }
    if not spec.glances.watches:
        glances["looker_share"] = min(spec.glances.looker_share, _LOOKER_SHARE)
    changes["glances"] = spec.glances.model_copy(update=glances)
    return spec.model_copy(update=changes)


class Manner:
    """The manner of one person whose habits vary: how they walk, look aside and start by chance."""

    def __init__(
        self,
        habits: Habits,
        variation: VariationFigures,
        free_mps: float,
        rngs: Sequence[np.random.Generator],
    ) -> None:
        gait_rng, start_rng, eye_rng, self._errand_rng = rngs
        self._habits, self._free_mps = habits, free_mps
        self._variation = GaitVariation(variation, gait_rng)
        self.starting = StartingModel(habits.idle_share, start_rng)
        self.eye_rest = EyeRest(habits.eye_spread_rad, eye_rng)

    def varied(
        self,
        desired: DesiredVelocity,
        place: tuple[float, float],
        robot: RobotBody | None,
        dt_s: float,
        *,
        walking: bool,
    ) -> tuple[DesiredVelocity, tuple[float, float], tuple[float, float]]:
        """Return the desired velocity as the walk varies it, and its rate ahead and aside."""
        share = desired.speed_mps / self._free_mps if walking else 0.0
        along, across, d_along, d_across = self._variation.step(dt_s, share)
        ux, uy, habits = desired.ux, desired.uy, self._habits
        near = robot is not None and math.dist(place, (robot.x_m, robot.y_m)) < habits.near_robot_m
        if near and desired.speed_mps <= self._free_mps:  # nobody who hurries or goes first
            speed_mps = min(desired.speed_mps, habits.near_robot_share * self._free_mps)
            desired = DesiredVelocity(ux, uy, speed_mps)
        vx = (desired.speed_mps + along) * ux - across * uy
        vy = (desired.speed_mps + along) * uy + across * ux
        speed = math.hypot(vx, vy)
        if speed > 1e-6:
            desired = DesiredVelocity(vx / speed, vy / speed, speed)
        return desired, (d_along * ux, d_along * uy), (-d_across * uy, d_across * ux)

    def errand(
        self,
        start: tuple[float, float],
        is_clear: Callable[[tuple[float, float], tuple[float, float]], bool],
    ) -> tuple[tuple[float, float], float] | None:
        """Return goal and speed of a way in a random direction; None where no way is free."""
        rng, habits = self._errand_rng, self._habits
        length_m = habits.errand_m * math.exp(habits.errand_sigma * rng.standard_normal())
        speed_mps = max(float(rng.normal(*habits.errand_mps)), 0.4)
        for course in rng.uniform(-math.pi, math.pi, _ERRAND_TRIES).tolist():
            goal = start[0] + length_m * math.cos(course), start[1] + length_m * math.sin(course)
            if is_clear(start, goal):
                return goal, speed_mps
            length_m *= _NEARER
        return None


class GaitVariation:
    """The variation of one person's walk, and its rate of change."""

    def __init__(self, figures: VariationFigures, rng: np.random.Generator) -> None:
        self._figures, self._rng = figures, rng
        spread = math.exp(figures.sway_sigma * rng.standard_normal())
        self._sway_m, self._step_mps = figures.sway_m * spread, figures.step_mps * spread
        self._stride_radps = (
            math.tau * figures.stride_hz * math.exp(figures.stride_sigma * rng.standard_normal())
        )
        self._phase, self._step_phase = rng.uniform(0.0, math.tau, 2).tolist()
        self._pace = _SmoothNoise(figures.pace_mps, figures.pace_s, rng)
        self._wander = _SmoothNoise(figures.wander_mps, figures.wander_s, rng)
        self._share = 0.0
        self._last = (0.0, 0.0)

    def step(self, dt_s: float, share: float) -> tuple[float, float, float, float]:
        """Return velocity along and across the path, in m/s, and both accelerations, in m/s².

        Args:
            dt_s: time since the last call.
            share: the desired speed relative to the free speed; 0 stands still.
        """
        self._share += (1.0 - math.exp(-dt_s / _SHARE_S)) * (min(share, 1.0) - self._share)
        share = self._share
        # The frequency of steps grows with the square root of speed.
        self._phase += self._stride_radps * math.sqrt(share) * dt_s
        along = self._pace.step(dt_s) + self._step_mps * math.sin(
            2.0 * self._phase + self._step_phase
        )
        sway_mps = self._sway_m * self._stride_radps * math.cos(self._phase)
        across = self._wander.step(dt_s) + sway_mps
        before, self._last = self._last, (share * along, share * across)
        now = self._last
        return *now, (now[0] - before[0]) / dt_s, (now[1] - before[1]) / dt_s


class _SmoothNoise:
    """A velocity that wanders: white noise through two equal low-pass filters."""

    def __init__(self, std_mps: float, time_s: float, rng: np.random.Generator) -> None:
        self._std_mps, self._time_s, self._rng = std_mps, time_s, rng
        # Stationary from the start: the two filters in series have variances 1 and 1/2, and the
        # covariance 1/2.
        first, second = (float(rng.standard_normal()) for _ in range(2))
        self._first: float = first
        self._second = 0.5 * first + 0.5 * second

    def step(self, dt_s: float) -> float:
        keep = math.exp(-dt_s / self._time_s)
        self._first = keep * self._first + math.sqrt(1.0 - keep * keep) * float(
            self._rng.standard_normal()
        )
        self._second += (1.0 - keep) * (self._first - self._second)
        return float(math.sqrt(2.0) * self._std_mps * self._second)
