"""Populations of simulated people: by hand, or fitted to recorded people."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar, Final, Literal, get_args

import numpy as np

from awarenav.errors import did_you_mean

from ...world.errors import SimError
from ._gait_variation import GaitVariation, VariationFigures
from ._gaze import EyeRest
from ._hearing import Hearing
from ._person import RobotBody, Surroundings
from ._route import STANDING_BELOW_MPS, DesiredVelocity, Route, RouteFollower
from ._spec import PersonSpec
from ._starting import StartingModel
from ._walker import DECISION_PERIOD_S, Walker

PopulationName = Literal["classic", "recorded"]
#: Names of the populations.
POPULATIONS: Final[tuple[PopulationName, ...]] = get_args(PopulationName)
#: The population of a scenario that names none.
DEFAULT_POPULATION: Final[PopulationName] = "classic"

# Fitted to recorded people, see docs/people.md.
_VARIATION: Final = VariationFigures(
    pace_mps=0.08,
    pace_s=0.25,
    wander_mps=0.07,
    wander_s=0.4,
    sway_m=0.0255,
    sway_sigma=0.36,
    stride_hz=0.93,
    stride_sigma=0.06,
    step_mps=0.05,
)
_SPEED_MPS: Final = (1.42, 0.09)
_HURRY_SHARE: Final = 0.04
_HURRY_MPS: Final = (1.9, 2.5)
#: Highest speed of recorded people, unless the scenario has a higher one.
FASTEST_RECORDED_MPS: Final = _HURRY_MPS[1]
# Share of the speed that people keep near a robot that they know of.
_NEAR_ROBOT_SHARE: Final = 0.91
_NEAR_ROBOT_M: Final = 12.0
# Speeds of somebody who dawdles or runs in the scenario are kept.
_DAWDLING_MPS: Final = 0.95
_RUNNING_MPS: Final = 1.8
_EYE_SPREAD_RAD: Final = math.radians(10.0)
_LOOKER_SHARE: Final = 0.886
_GLANCE_MEDIAN_S: Final = 0.60
_GLANCE_QUARTILES_S: Final = (0.336, 1.072)
_AWAY_MEDIAN_S: Final = 1.80
_AWAY_QUARTILES_S: Final = (1.24, 2.61)
# People with nowhere to go: share that starts within a second, and where to.
_IDLE_SHARE: Final = 0.08
_ERRAND_M: Final = 1.3
_ERRAND_SIGMA: Final = 0.8
_ERRAND_MPS: Final = (0.9, 0.25)
_ERRAND_TRIES: Final = 8
# Where the way is not free, the next try is nearer by this factor.
_NEARER: Final = 0.8


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


def walker_of(population: str) -> Callable[..., Walker]:
    """Return the class of the people of a population; it is made as a :class:`Walker`.

    Raises:
        SimError: for an unknown name.
    """
    found: dict[PopulationName, type[Walker]] = {"classic": Walker, "recorded": RecordedWalker}
    return found[known_population(population)]


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


class RecordedWalker(Walker):
    """A walker who moves, looks and starts as recorded people do.

    The route, the activity, the reactions and the time of the start stay those of the scenario.
    The pace varies, the body sways, and the eyes turn in the head. A person who stands may start
    at any time, whether or not they have looked at the robot: somebody on the way or waiting goes
    on, and somebody with nowhere to go walks off in a direction that is free.

    Args:
        spec: the person; speed and glances are drawn anew, see :func:`draw_person`.
        rng: the person's own generator.
        boxes_odom_m: (N, 4) racks and walls, x_min, y_min, x_max, y_max.
        offset_s: delay of the start; the person never starts before 0.
    """

    _FORCE_SHARE: ClassVar[float] = 1.7

    def __init__(
        self,
        spec: PersonSpec,
        rng: np.random.Generator,
        boxes_odom_m: Any,
        *,
        offset_s: float = 0.0,
    ) -> None:
        spec_rng, gait_rng, start_rng, eye_rng, self._errand_rng = rng.spawn(5)
        super().__init__(draw_person(spec, spec_rng), rng, boxes_odom_m, offset_s=offset_s)
        self._gaze.eye_rest = EyeRest(_EYE_SPREAD_RAD, eye_rng)
        self._variation = GaitVariation(_VARIATION, gait_rng)
        self._starting = StartingModel(_IDLE_SHARE, start_rng)

    def _decide(self, around: Surroundings) -> None:
        if not self.spec.stays:
            self._maybe_start(around.robot)
        super()._decide(around)

    def _maybe_start(self, robot: RobotBody | None) -> None:
        """Let a person who stands start by chance."""
        t_s = (self._tick + 1) * DECISION_PERIOD_S
        x, y, vx, vy = self._trajectory.end
        leader = self._follower
        before_start = self._task.started_s is None
        if self._starting.starts(
            t_s,
            DECISION_PERIOD_S,
            standing=not before_start and math.hypot(vx, vy) < STANDING_BELOW_MPS,
            idle=leader.arrived_s is not None,
            looking=self._gaze.looking,
            place=(x, y),
            robot=robot,
        ):
            if leader.arrived_s is not None:
                self._run_errand(t_s, (x, y))
                return
            leader.go(t_s)
            self._span.end_halt()
            self._reactions.go_first()

    def _run_errand(self, t_s: float, start: tuple[float, float]) -> None:
        """Set off to a place at a random distance, in a random direction that is free."""
        rng = self._errand_rng
        length_m = _ERRAND_M * math.exp(_ERRAND_SIGMA * rng.standard_normal())
        speed_mps = max(float(rng.normal(*_ERRAND_MPS)), 0.4)
        for course in rng.uniform(-math.pi, math.pi, _ERRAND_TRIES).tolist():
            goal = start[0] + length_m * math.cos(course), start[1] + length_m * math.sin(course)
            if self._obstacles.is_clear(start, goal):
                self._follower = RouteFollower(Route([start, goal], []), speed_mps, t_s)
                return
            length_m *= _NEARER

    def _acceleration(
        self,
        state: tuple[float, float, float, float],
        desired: DesiredVelocity,
        robot: RobotBody | None,
        around: Surroundings,
    ) -> tuple[float, float]:
        """Add the variation of the gait to the desired velocity, and its rate to the answer."""
        share = desired.speed_mps / self.spec.speed_mps if self._follower.walking else 0.0
        along, across, d_along, d_across = self._variation.step(DECISION_PERIOD_S, share)
        ux, uy = desired.ux, desired.uy
        near = robot is not None and math.dist(state[:2], (robot.x_m, robot.y_m)) < _NEAR_ROBOT_M
        if near and desired.speed_mps <= self.spec.speed_mps:  # nobody who hurries or goes first
            speed_mps = min(desired.speed_mps, _NEAR_ROBOT_SHARE * self.spec.speed_mps)
            desired = DesiredVelocity(ux, uy, speed_mps)
        vx = (desired.speed_mps + along) * ux - across * uy
        vy = (desired.speed_mps + along) * uy + across * ux
        speed = math.hypot(vx, vy)
        if speed > 1e-6:
            desired = DesiredVelocity(vx / speed, vy / speed, speed)
        ax, ay = super()._acceleration(state, desired, robot, around)
        return ax + d_along * ux - d_across * uy, ay + d_along * uy + d_across * ux
