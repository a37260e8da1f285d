"""A crossing as data: hall, robot task, camera and people, with numbers that may be drawn."""

from __future__ import annotations

import copy
import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from nav_adapter import RobotProfile
from perception import Camera
from perception.arrays import FloatArray
from perception.documents import yaml_text
from perception.surround import FlatView, ring_of_views

from ..actors.behaviour import (
    DEFAULT_POPULATION,
    Hearing,
    PersonSpec,
    PopulationName,
    population_of,
)
from ..actors.robot import NOVA_CARTER, RobotModel
from ..world.camera import CameraTiming, SensorConfig
from ..world.config import SimConfig, checked_seed
from ..world.errors import SimError
from ..world.hall import LAYOUTS, WarehouseLayout
from ..world.scanner import DIAGONAL_SCANNERS, ScannerSpec
from ._distributions import Distribution, error_text, find_parameters, with_numbers
from ._files import camera_data, parse_yaml, read_file, require_version, shipped_text
from ._for_robot import fit
from ._networks import networks_data

# The key of a robot to which the scenario is fitted.
_FOR_ROBOT: Final = "for_robot"
# Largest distance between neighbours on the reference path.
_PATH_SPACING_M: Final = 0.25


class CameraSpec(SimConfig):
    """The robot's camera: image size, field of view, sensor and timing.

    A camera that sees more than a pinhole can, a fisheye or a panorama, has several flat views cut
    from its image (:mod:`perception.surround`). Sizes and angles are those of one view.

    Attributes:
        width_px: image width.
        height_px: image height.
        horizontal_fov_deg: horizontal field of view.
        views_deg: headings of the flat views from straight ahead, left positive; the first is 0.
        mount: ``"front"``: in front of the head of the robot's post; ``"top"``: on top of it, where
            nothing hides the sides.
        picture_scale: with ``perception="pixels"`` the images have this share of the width and
            height; half the width and height render four times as fast.
        scenery_divisor: these images take one sample of the scenery per block of this many pixels a
            side; people get full resolution.
        sensor: noise of rendered images; the default adds none.
        timing: frame rate, losses and delays; the default is one frame per control cycle, without
            delay.
    """

    width_px: int = Field(default=1280, ge=16, le=8192)
    height_px: int = Field(default=960, ge=16, le=8192)
    horizontal_fov_deg: float = Field(default=90.0, gt=0.0, lt=180.0)
    views_deg: tuple[float, ...] = (0.0,)
    mount: Literal["front", "top"] = "front"
    picture_scale: float = Field(default=1.0, gt=0.0, le=1.0)
    scenery_divisor: int = Field(default=1, ge=1, le=8)
    sensor: SensorConfig = SensorConfig()
    timing: CameraTiming = CameraTiming()

    @model_validator(mode="after")
    def _blocks_fill_the_image(self) -> CameraSpec:
        size = (
            round(self.width_px * self.picture_scale),
            round(self.height_px * self.picture_scale),
        )
        if any(length % self.scenery_divisor for length in size):
            raise ValueError(
                f"scenery_divisor must divide the width and height of the images, {size[0]} and "
                f"{size[1]} px, got {self.scenery_divisor}"
            )
        return self

    @model_validator(mode="after")
    def _first_view_ahead(self) -> CameraSpec:
        if not self.views_deg or self.views_deg[0] != 0.0:
            raise ValueError(
                f"views_deg must begin with 0, straight ahead, got {list(self.views_deg)}"
            )
        if not all(-180.0 <= heading <= 180.0 for heading in self.views_deg):
            raise ValueError(f"views_deg must lie in [-180, 180], got {list(self.views_deg)}")
        return self

    def flat_views(self, camera: Camera) -> tuple[FlatView, ...]:
        """Return the views, each with this camera model."""
        return ring_of_views(camera, np.radians(self.views_deg))

    def camera(self, scale: float = 1.0) -> Camera:
        """Return the camera model of one view, with width and height times ``scale``."""
        return Camera.from_fov(
            round(self.width_px * scale),
            round(self.height_px * scale),
            math.radians(self.horizontal_fov_deg),
        )


class RobotTask(SimConfig):
    """The robot's start and goal, in odom.

    Attributes:
        start_x_m: start position.
        start_y_m: start position.
        start_heading_deg: heading at the start.
        goal_x_m: goal position.
        goal_y_m: goal position.
        goal_tolerance_m: distance from the goal at which it counts as reached.
        straight_on_speed_mps: the robot drives straight ahead at this speed without a planner, as
            in the paper's encounter; None for a planner.
        lane_half_width_m: the robot keeps to a lane this wide on either side of the straight line
            to its goal, as fleet managers ask for with keep-out zones. The planner sees everything
            beyond as a wall; without it a local planner would follow people into the aisles. People
            ignore the lane. None for no lane.
    """

    start_x_m: float = 0.0
    start_y_m: float = 0.0
    start_heading_deg: float = 0.0
    goal_x_m: float
    goal_y_m: float = 0.0
    goal_tolerance_m: float = Field(default=0.25, gt=0.0)
    straight_on_speed_mps: float | None = Field(default=None, gt=0.0)
    lane_half_width_m: float | None = Field(default=None, ge=0.5)

    @model_validator(mode="after")
    def _lane_along_an_axis(self) -> RobotTask:
        along_axis = self.start_x_m == self.goal_x_m or self.start_y_m == self.goal_y_m
        if self.lane_half_width_m is not None and not along_axis:
            raise ValueError(
                "lane_half_width_m needs a start and goal along odom x or y, got "
                f"({self.start_x_m:g}, {self.start_y_m:g}) to ({self.goal_x_m:g}, "
                f"{self.goal_y_m:g}) m"
            )
        return self

    def window_odom_m(self, margin_m: float) -> tuple[float, float, float, float]:
        """Return x_min, y_min, x_max, y_max of the robot's way with a margin, for a plan."""
        return (
            min(self.start_x_m, self.goal_x_m) - margin_m,
            min(self.start_y_m, self.goal_y_m) - margin_m,
            max(self.start_x_m, self.goal_x_m) + margin_m,
            max(self.start_y_m, self.goal_y_m) + margin_m,
        )

    @property
    def path_odom_m(self) -> FloatArray:
        """The reference path (M, 2) for planners that follow one: straight from start to goal.

        Neighbours are at most 0.25 m apart. It ignores racks and people, as the line of a fleet
        manager does.
        """
        start = np.array([self.start_x_m, self.start_y_m])
        goal = np.array([self.goal_x_m, self.goal_y_m])
        steps = max(1, math.ceil(float(np.hypot(*(goal - start))) / _PATH_SPACING_M))
        return np.asarray(np.linspace(start, goal, steps + 1))


def _robot_model(value: Any) -> Any:
    return RobotModel.of(value) if isinstance(value, str) else value


def _layout(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value not in LAYOUTS:
        raise ValueError(
            f"layout must be one of {', '.join(map(repr, LAYOUTS))} or a mapping, got {value!r}"
        )
    return WarehouseLayout.named(value)


class Scenario(SimConfig):
    """One crossing, or any number of them where some of its numbers are distributions.

    In its file any number under ``people`` and ``robot`` may be a mapping such as
    ``{uniform: {low: 1.0, high: 2.0}}``, ``{normal: {mean:, std:, low:, high:}}``,
    ``{lognormal: {median:, quartiles: [,]}}``, ``{integers: {low:, high:}}`` or
    ``{choice: [...]}``. The attributes have the medians; :meth:`draw` draws the scenario of an
    episode. A copy with other values (``model_copy``) has no distributions.

    The key ``for_robot`` names a robot (a shipped one, a YAML file, or the keys of a
    :class:`~sim_tests.actors.robot.RobotModel`) to which every draw is fitted. *Room*: the lane,
    the aisle along it, and everything beside the line from start to goal move outward by what the
    robot is wider, and by half of what it reaches farther from its base. *Time*: the duration grows
    with the time that the way takes, and people come later, so that they still meet the robot.
    Recorded people stay as they were recorded. The name becomes ``scenario_robot``.

    Attributes:
        name: identifier, also of the shipped file.
        version: number that grows with every change after which results cannot be compared.
        description: one sentence.
        attention: ``"attentive"`` if everybody notices the robot in time, ``"unaware"`` if nobody
            does, ``"mixed"`` otherwise.
        duration_s: longest duration of an episode.
        control_hz: control cycles per second; each is one frame.
        layout: the hall, a name of :data:`LAYOUTS` or a mapping of :class:`WarehouseLayout`.
        robot: the robot's task.
        robot_model: the robot; a shipped name, a YAML file or the keys of a
            :class:`~sim_tests.actors.robot.RobotModel`; None for the Nova Carter. See
            :meth:`with_robot`, which fits room and time as well.
        camera: the robot's camera; a robot model has its place.
        networks: networks for the pictures of the camera, instead of the shipped ones: the keys of
            a file for ``--networks``, and ``sha256`` of each file among them; see
            :meth:`with_networks`.
        scanners: the robot's laser scanners; they are used where a crossing asks for them.
        people: people who look, react and walk by themselves; names are unique.
        population: habits of the people: ``"classic"``, or ``"recorded"`` as fitted to recorded
            people, see :meth:`with_population`.
        hearing: how people hear a robot that asks for attention, and answer it.
        replay_csv: table of recorded people to replay, see :func:`read_recordings`; relative
            to the scenario's own file.
        replay_reacts: the recorded people leave their paths where the robot forces them off, and
            return; see :class:`Person`. Otherwise they walk on whatever the robot does.
        replay_leaves: the recorded people are away before their first and after their last row;
            otherwise they stand there.
        start_jitter_s: each person starts up to this much earlier or later, drawn
            from the seed.
    """

    name: str = Field(min_length=1)
    version: int = Field(default=1, ge=1)
    description: str = ""
    attention: Literal["attentive", "unaware", "mixed"] = "mixed"
    duration_s: float = Field(gt=0.0, le=600.0)
    control_hz: float = Field(default=20.0, gt=0.0, le=240.0)
    layout: Annotated[WarehouseLayout, BeforeValidator(_layout)] = WarehouseLayout.named("crossing")
    robot: RobotTask
    robot_model: Annotated[RobotModel | None, BeforeValidator(_robot_model)] = None
    camera: CameraSpec = CameraSpec()
    networks: dict[str, Any] = Field(default_factory=dict)
    scanners: tuple[ScannerSpec, ...] = DIAGONAL_SCANNERS
    people: tuple[PersonSpec, ...] = ()
    population: PopulationName = DEFAULT_POPULATION
    hearing: Hearing = Hearing()
    replay_csv: str | None = None
    replay_reacts: bool = False
    replay_leaves: bool = False
    start_jitter_s: float = Field(default=0.0, ge=0.0)
    # The keys as they were given, with distributions; empty for fields that were set.
    _written: dict[str, Any] = PrivateAttr(default_factory=dict)
    _distributions: dict[str, Distribution] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _unique_names(self) -> Scenario:
        names = [person.name for person in self.people]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"names of people must be unique, got {', '.join(twice)} twice")
        return self

    @model_validator(mode="after")
    def _settings_of_a_replay(self) -> Scenario:
        if self.replay_csv is None and (self.replay_reacts or self.replay_leaves):
            raise ValueError("replay_reacts and replay_leaves need recorded people: replay_csv")
        return self

    @classmethod
    def shipped(cls, name: str) -> Scenario:
        """Load one that comes with the package, by ``name``, or by ``name@2`` with a version."""
        plain, text = shipped_text(name)
        scenario = cls.from_text(text, plain)
        require_version(name, scenario.version)
        return scenario

    @classmethod
    def from_yaml(cls, path: str | Path) -> Scenario:
        """Read a file; its ``replay_csv`` is relative to its folder.

        Raises:
            SimError: naming the file and the wrong key.
        """
        return cls.from_data(read_file(Path(path), cls.model_fields), str(path))

    @classmethod
    def named(cls, name: str) -> Scenario:
        """Load a YAML file if the name ends in ``.yaml`` or ``.yml``, else a shipped one."""
        return cls.from_yaml(name) if name.endswith((".yaml", ".yml")) else cls.shipped(name)

    @classmethod
    def from_text(cls, text: str, source: str = "scenario") -> Scenario:
        """Read YAML, for example the text of :meth:`to_text`."""
        return cls.from_data(parse_yaml(text, source), source)

    @classmethod
    def from_data(cls, data: Mapping[str, Any], source: str = "scenario") -> Scenario:
        """Validate the keys of a scenario, at the medians of its distributions.

        Args:
            data: the keys, as read from YAML.
            source: name of the scenario in messages.

        Raises:
            SimError: naming the wrong path, for unknown keys, impossible distributions, and a
                scenario that is not valid at the medians.
        """
        distributions = find_parameters(data, source)
        scenario = cls._valid(with_numbers(data, distributions, {}, source), source)
        scenario._written = copy.deepcopy(dict(data))
        scenario._distributions = distributions
        return scenario

    @classmethod
    def _valid(cls, data: dict[str, Any], source: str) -> Scenario:
        """Return the scenario of keys without distributions, fitted to its robot."""
        robot = data.get(_FOR_ROBOT)
        model = None if robot is None else _robot_of(robot, source)
        try:
            scenario = cls.model_validate({k: data[k] for k in data if k != _FOR_ROBOT})
            if model is not None:
                scenario = scenario._fitted_to(model)
        except ValidationError as cause:
            raise SimError(f"{source}: {error_text(cause)}") from cause
        scenario._written = data
        return scenario

    def _fitted_to(self, model: RobotModel) -> Scenario:
        own = self.robot_model
        if own is not None and own != model:
            raise SimError(
                f"scenario {self.name!r} is for the robot {own.name!r} already, got {model.name!r}"
            )
        if own is not None or model.body == "nova_carter":
            return self
        data = self.model_dump()
        fit(data, model)
        return self.model_validate(data)

    @property
    def id(self) -> str:
        """Name and version, such as ``"crossing_from_left@1"``."""
        return f"{self.name}@{self.version}"

    @property
    def distributions(self) -> Mapping[str, Distribution]:
        """The distributions by dotted path, such as ``"people.0.speed_mps"``."""
        return self._distributions

    def draw(self, seed: int) -> Scenario:
        """Return the scenario of the episode with this seed; itself without distributions.

        Each distribution has a random stream of its own, which depends only on the seed and on its
        path: adding or removing one changes none of the others.

        Raises:
            SimError: for a seed that is no whole number from 0 on, and if the values drawn are not
                valid together.
        """
        seed = checked_seed(seed)
        if not self._distributions:
            return self
        key = np.random.default_rng(seed).integers(0, 2**32, 4, dtype=np.uint64).tolist()
        values = {p: each.quantile(_uniform(key, p)) for p, each in self._distributions.items()}
        return self._with_values(values, f"{self.name}, seed {seed}")

    def with_values(self, values: Mapping[str, float]) -> Scenario:
        """Return the scenario with these values for distributions and the medians of the others.

        Raises:
            SimError: for a path without a distribution, and for values that are not valid.
        """
        return self._with_values(values, self.name)

    def _with_values(self, values: Mapping[str, float], source: str) -> Scenario:
        return self._valid(with_numbers(self._keys, self._distributions, values, source), source)

    def model_copy(
        self, *, update: Mapping[str, Any] | None = None, deep: bool = False
    ) -> Scenario:
        """Return a copy with other values, which are not checked, and without distributions."""
        changed = super().model_copy(update=update, deep=deep)
        changed._written, changed._distributions = {}, {}
        return changed

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scenario) and (self.model_dump(), self._distributions) == (
            other.model_dump(),
            other._distributions,
        )

    def __hash__(self) -> int:
        return hash(self.id)

    @property
    def robot_profile(self) -> RobotProfile:
        """Outline and limits of the robot that drives: its ``robot_model``, or the Nova Carter."""
        return NOVA_CARTER if self.robot_model is None else self.robot_model.profile

    @property
    def planner_boxes_odom_m(self) -> FloatArray:
        """Boxes (N, 4) that a planner must avoid: those of the hall, and the area off the lane."""
        boxes, task = self.layout.obstacle_boxes_odom, self.robot
        half = task.lane_half_width_m
        if half is None:
            return boxes
        hall = self.layout
        x, y = task.start_x_m, task.start_y_m
        low, high = (hall.x_min_m, hall.y_min_m), (hall.x_max_m, hall.y_max_m)
        if task.start_y_m == task.goal_y_m:
            beyond = [(low[0], low[1], high[0], y - half), (low[0], y + half, high[0], high[1])]
        else:
            beyond = [(low[0], low[1], x - half, high[1]), (x + half, low[1], high[0], high[1])]
        real = [box for box in beyond if box[0] < box[2] and box[1] < box[3]]
        return np.vstack([boxes, *np.array(real).reshape(-1, 1, 4)])

    def to_text(self) -> str:
        """Return YAML for :meth:`from_text`, with the shared defaults written out."""
        return yaml_text(self._keys)

    @property
    def _keys(self) -> dict[str, Any]:
        unused = {"robot_model"} if self.robot_model is None else None
        return self._written or self.model_dump(mode="json", exclude=unused)

    def with_robot(self, robot: RobotModel | RobotProfile | str | Path) -> Scenario:
        """Return the same scenario fitted to another robot.

        Raises:
            SimError: for an unknown robot, or a scenario that is another robot's already.
        """
        if robot == "":
            return self
        model = RobotModel.of(robot)
        return self._with(model.name, **{_FOR_ROBOT: model.model_dump(mode="json")})

    def with_camera(self, name: str) -> Scenario:
        """Return the same scenario with another camera on the robot."""
        return self._with(name, camera=camera_data(name)) if name else self

    def with_networks(self, named: str | Path) -> Scenario:
        """Return the same scenario with other networks for the pictures of its camera."""
        return self._with(named, networks=networks_data(named)) if named else self

    def with_population(self, text: str) -> Scenario:
        """Return the same task among people with other habits.

        Args:
            text: a population, ``"classic"`` or ``"recorded"``, numbers of :class:`Hearing`, or
                both: ``"recorded"``, ``"recorded,answers=0.8,startles=0.2"``, ``"answers=0.3"``.
        """
        if not text:
            return self
        name, numbers = population_of(text)
        changes: dict[str, Any] = {} if name is None else {"population": name}
        if numbers:
            changes["hearing"] = {**self._keys.get("hearing", {}), **numbers}
        return self._with(text, **changes)

    def _with(self, what: object, **changes: Any) -> Scenario:
        return self.from_data({**self._keys, **changes}, f"{self.name} with {what}")

    def without_people(self) -> Scenario:
        """Return the same task in a hall without people."""
        empty: dict[str, Any] = {"people": (), "replay_csv": None}
        empty |= {"replay_reacts": False, "replay_leaves": False}
        return self.model_copy(update={"name": f"{self.name}_without_people", **empty})


def _robot_of(value: Any, source: str) -> RobotModel:
    try:
        if not isinstance(value, str):
            return RobotModel.model_validate(value)
        return RobotModel.of(value)
    except ValidationError as cause:
        raise SimError(f"{source}: {_FOR_ROBOT}: {error_text(cause)}") from cause


def _uniform(key: list[int], path: str) -> float:
    """Return a number in [0, 1) that depends only on the key and the path."""
    digest = hashlib.sha256(path.encode()).digest()
    words = [int.from_bytes(digest[at : at + 4], "little") for at in range(0, 16, 4)]
    stream = np.random.default_rng(np.random.SeedSequence([*key, *words]))
    return float(stream.random())
