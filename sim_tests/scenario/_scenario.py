"""A crossing as data: hall, robot task, camera and what each worker does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import yaml
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from perception import Camera
from perception.arrays import FloatArray
from perception.surround import FlatView, ring_of_views
from tracking.config import StrictConfig

from ..actors.behaviour import PersonSpec, WorkerScript
from ..world.camera import CameraTiming, SensorConfig
from ..world.errors import SimError
from ..world.hall import LAYOUTS, WarehouseLayout
from ._distributions import error_text
from ._files import parse, read_file, require_version, shipped_text
from ._parameters import find_parameters, with_numbers


def _layout(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value not in LAYOUTS:
        raise ValueError(
            f"layout must be one of {', '.join(map(repr, LAYOUTS))} or a mapping, got {value!r}"
        )
    return LAYOUTS[value]()


class CameraSpec(StrictConfig):
    """The robot's camera: image size, horizontal field of view, sensor and timing.

    A camera that sees more than a pinhole can, a fisheye or a panorama, has several flat views cut
    from its picture (:mod:`perception.surround`); sizes and angles are those of each.
    """

    error: ClassVar[type[ValueError]] = SimError

    width_px: int = Field(default=1280, ge=16, le=8192)
    height_px: int = Field(default=960, ge=16, le=8192)
    horizontal_fov_deg: float = Field(default=90.0, gt=0.0, lt=180.0)
    #: Headings of the flat views from straight ahead, left positive; the first is 0.
    views_deg: tuple[float, ...] = (0.0,)
    #: In front of the head of the robot's post, or on its top, from where nothing hides the sides.
    mount: Literal["front", "top"] = "front"
    #: Share of these pixels a side that the pictures of ``perception="pixels"`` have: half as many
    #: are rendered four times as fast.
    picture_scale: float = Field(default=1.0, gt=0.0, le=1.0)
    #: Those pictures have one sample of scenery in a block of so many pixels a side; people have as
    #: many samples as they need.
    scenery_divisor: int = Field(default=1, ge=1, le=8)
    #: Exposure, noise and blur of rendered pictures; the default adds none.
    sensor: SensorConfig = SensorConfig()
    #: Frame rate, losses and delays; the default is a frame every control cycle, at once.
    timing: CameraTiming = CameraTiming()

    @model_validator(mode="after")
    def _blocks_fill_the_picture(self) -> CameraSpec:
        size = (
            round(self.width_px * self.picture_scale),
            round(self.height_px * self.picture_scale),
        )
        if any(length % self.scenery_divisor for length in size):
            raise ValueError(
                f"scenery_divisor must divide the width and height of the pictures, {size[0]} and "
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
        """The views, each with this camera model."""
        return ring_of_views(camera, np.radians(self.views_deg))

    def camera(self, scale: float = 1.0) -> Camera:
        """The camera model of a view, or one with ``scale`` times the pixels a side."""
        return Camera.from_fov(
            round(self.width_px * scale),
            round(self.height_px * scale),
            math.radians(self.horizontal_fov_deg),
        )


class RobotTask(StrictConfig):
    """Where the robot starts and where it shall go; metres in odom."""

    error: ClassVar[type[ValueError]] = SimError

    start_x_m: float = 0.0
    start_y_m: float = 0.0
    start_heading_deg: float = 0.0
    goal_x_m: float
    goal_y_m: float = 0.0
    goal_tolerance_m: float = Field(default=0.25, gt=0.0)
    #: Drives straight on at this speed without a planner, as in the paper's encounter.
    straight_on_speed_mps: float | None = Field(default=None, gt=0.0)
    #: The robot keeps to a lane this wide on either side of the straight way to its goal,
    #: as fleets ask for with keep-out zones: the planner sees everything beyond as a wall, a local
    #: one would else follow people into the aisles that they take. People walk where they like.
    lane_half_width_m: float | None = Field(default=None, ge=0.5)

    @model_validator(mode="after")
    def _lane_along_an_axis(self) -> RobotTask:
        along_axis = self.start_x_m == self.goal_x_m or self.start_y_m == self.goal_y_m
        if self.lane_half_width_m is not None and not along_axis:
            raise ValueError(
                "lane_half_width_m needs a way along odom x or y, got one from "
                f"({self.start_x_m:g}, {self.start_y_m:g}) to ({self.goal_x_m:g}, "
                f"{self.goal_y_m:g}) m"
            )
        return self


class Scenario(StrictConfig):
    """One crossing, named by a sentence.

    Attributes:
        name: identifier, also of the shipped file.
        version: counts changes after which results do not compare with earlier ones.
        description: what happens, in one sentence.
        attention: ``"attentive"`` where everybody notices the robot in time, ``"unaware"`` where
            nobody does, ``"mixed"`` otherwise.
        duration_s: the longest an episode lasts.
        control_hz: frames, planning cycles and log rows a second.
        layout: the hall, a name of :data:`LAYOUTS` or a mapping of :class:`WarehouseLayout`.
        robot: the robot's task.
        camera: the robot's camera.
        workers: scripted people: the same whatever the robot does.
        people: those who look, react and walk by themselves; every name once.
        replay_csv: table of recorded people to replay, see :func:`read_recordings`; relative
            to the scenario's own file.
        start_jitter_s: each worker and each person starts up to this much earlier or later, drawn
            from the seed.
    """

    error: ClassVar[type[ValueError]] = SimError

    name: str = Field(min_length=1)
    version: int = Field(default=1, ge=1)
    description: str = ""
    attention: Literal["attentive", "unaware", "mixed"] = "mixed"
    duration_s: float = Field(gt=0.0, le=600.0)
    control_hz: float = Field(default=20.0, gt=0.0, le=240.0)
    layout: Annotated[WarehouseLayout, BeforeValidator(_layout)] = WarehouseLayout.crossing()
    robot: RobotTask
    camera: CameraSpec = CameraSpec()
    workers: tuple[WorkerScript, ...] = ()
    people: tuple[PersonSpec, ...] = ()
    replay_csv: str | None = None
    start_jitter_s: float = Field(default=0.0, ge=0.0)

    @model_validator(mode="after")
    def _names_once(self) -> Scenario:
        names = [person.name for person in self.people]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"names of people must be unique, got {', '.join(twice)} twice")
        return self

    @classmethod
    def shipped(cls, name: str) -> Scenario:
        """One of the scenarios that come with the package, its distributions at their medians.

        Raises:
            SimError: for another name; ``name@2`` also for another version.
        """
        plain, text = shipped_text(name)
        scenario = cls._at_medians(parse(text, plain), plain)
        require_version(name, scenario.version)
        return scenario

    @classmethod
    def from_yaml(cls, path: str | Path) -> Scenario:
        """Read a scenario's file, its distributions at their medians.

        Raises:
            SimError: naming file and key of what is wrong.
        """
        return cls._at_medians(read_file(Path(path)), str(path))

    @classmethod
    def from_data(cls, data: Mapping[str, Any], source: str = "scenario") -> Scenario:
        """Validate the keys of a scenario.

        Args:
            data: without distributions.
            source: what to call it in messages.

        Raises:
            SimError: naming the key of what is wrong.
        """
        try:
            return cls.model_validate(data)
        except ValidationError as cause:
            raise SimError(f"{source}: {error_text(cause)}") from cause

    @classmethod
    def _at_medians(cls, data: dict[str, Any], source: str) -> Scenario:
        return cls.from_data(with_numbers(data, find_parameters(data, source), {}, source), source)

    @property
    def planner_boxes_odom_m(self) -> FloatArray:
        """(N, 4) what a planner has to keep clear of: the hall's boxes and what is off the lane."""
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
        """YAML for :meth:`ScenarioTemplate.from_text`: the scenario as plain data."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False, allow_unicode=True)

    def without_people(self) -> Scenario:
        """The same task in an empty hall: what the robot could do if nobody were there."""
        nobody: dict[str, Any] = {"workers": (), "people": (), "replay_csv": None}
        return self.model_copy(update={"name": f"{self.name}_without_people", **nobody})
