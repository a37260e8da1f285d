"""A robot as data: outline, limits, kinematics, body and sensors, and the shipped robots."""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import Field, model_validator
from shapely.geometry import MultiPoint

from awarenav.errors import not_one_of
from nav_adapter import NavError, RobotProfile
from perception.arrays import FloatArray

from ...world.config import SimConfig
from ...world.errors import SimError
from ...world.scanner import DIAGONAL_SCANNERS, ScannerSpec

_FOLDER: Final = resources.files("sim_tests.actors.robot") / "shipped"
#: Name of the robot with its own body and wheels, the default of every crossing.
NOVA_CARTER_NAME: Final = "nova_carter"

#: Nova Carter's published outline; its centre is midway between the drive wheels.
NOVA_CARTER: Final = RobotProfile(
    footprint_m=np.array([[0.3625, 0.25], [-0.3625, 0.25], [-0.3625, -0.25], [0.3625, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
    drive="differential",
    max_yaw_rate_radps=1.5,
    max_yaw_acceleration_radps2=3.0,
)

WHEEL_RADIUS_M: Final = 0.14
TRACK_M: Final = 0.414
CAMERA_HEIGHT_M: Final = 1.4
# Just ahead of the camera's housing, so that the robot does not see itself.
CAMERA_FORWARD_M: Final = 0.165

Point = tuple[float, float]


class BodyPart(SimConfig):
    """A box of a robot's body in the base frame, and its colour.

    Attributes:
        low_m: (x, y, z) of the low corner.
        high_m: (x, y, z) of the high corner.
        colour: red, green and blue, from 0 to 1.
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    colour: tuple[float, float, float] = (0.2, 0.3, 0.45)

    @model_validator(mode="after")
    def _has_a_size(self) -> BodyPart:
        if not all(low < high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError(f"low_m must be below high_m, got {self.low_m} and {self.high_m}")
        return self


class RobotModel(SimConfig):
    """A robot for crossings: any convex outline, with the limits and the drive of its profile.

    Attributes:
        name: identifier.
        description: one sentence.
        footprint_m: corners (x, y) in the base frame, x forward, y left. The base origin of a robot
            that steers lies on the axle that does not steer.
        max_speed_mps: see :class:`~nav_adapter.RobotProfile`, as all limits.
        max_acceleration_mps2: largest acceleration.
        max_deceleration_mps2: deceleration that the brakes always reach.
        reaction_time_s: from a change in the scene to the start of braking.
        drive: ``"differential"``, ``"ackermann"`` (it steers) or ``"holonomic"`` (it moves
            sideways).
        max_yaw_rate_radps: fastest turn.
        max_yaw_acceleration_radps2: fastest change of the yaw rate.
        min_turning_radius_m: tightest curve of the base origin, with ``"ackermann"`` only.
        brakes_on_curve: whether it keeps to its curve until it stands, whatever planner drives it.
        body: ``"kinematic"``: the outline is moved within the limits; ``"nova_carter"``: the
            shipped robot with wheels and motors.
        height_m: height of the body, without a mast for the camera.
        parts: boxes that the robot looks like; none for its outline up to ``height_m``. Contacts
            always count the outline, from the floor to the height.
        camera_m: (x, y, z) of the camera in the base frame; it looks ahead.
        scanners: laser scanners.
    """

    name: str = Field(min_length=1)
    description: str = ""
    footprint_m: tuple[Point, ...] = Field(min_length=3)
    max_speed_mps: float = Field(gt=0.0, le=5.0)
    max_acceleration_mps2: float = Field(gt=0.0)
    max_deceleration_mps2: float = Field(gt=0.0)
    reaction_time_s: float = Field(default=0.3, ge=0.0)
    drive: Literal["differential", "ackermann", "holonomic"] | None = "differential"
    max_yaw_rate_radps: float = Field(gt=0.0)
    max_yaw_acceleration_radps2: float = Field(gt=0.0)
    min_turning_radius_m: float | None = Field(default=None, gt=0.0)
    brakes_on_curve: bool = False
    body: Literal["kinematic", "nova_carter"] = "kinematic"
    height_m: float = Field(default=0.5, gt=0.0, le=4.0)
    parts: tuple[BodyPart, ...] = ()
    camera_m: tuple[float, float, float] = (0.0, 0.0, 1.4)
    scanners: tuple[ScannerSpec, ...] = DIAGONAL_SCANNERS

    @model_validator(mode="after")
    def _has_a_profile(self) -> RobotModel:
        hull = MultiPoint(self.footprint_m).convex_hull
        for part in self.parts:
            (x0, y0, _), (x1, y1, _) = part.low_m, part.high_m
            if not hull.buffer(1e-6).covers(MultiPoint([(x0, y0), (x0, y1), (x1, y0), (x1, y1)])):
                raise ValueError(
                    f"a part of the body must lie within footprint_m, got x {x0:g} to {x1:g} m, "
                    f"y {y0:g} to {y1:g} m"
                )
        try:
            RobotProfile.of_settings(self)
        except NavError as cause:
            raise ValueError(str(cause)) from cause
        return self

    @classmethod
    def shipped(cls, name: str) -> RobotModel:
        """Load a robot that comes with the package."""
        names = shipped_robots()
        if name not in names:
            raise SimError(not_one_of("robot", name, names, or_else="a YAML file"))
        if name == NOVA_CARTER_NAME:
            return _nova_carter()
        with resources.as_file(_FOLDER / f"{name}.yaml") as path:
            return cls.from_yaml(path)

    @classmethod
    def of(cls, robot: RobotModel | RobotProfile | str | Path) -> RobotModel:
        """Return a robot from a model, a shipped name, a YAML file, or a profile.

        A profile becomes a kinematic body: its convex outline, extruded.

        Raises:
            SimError: for another name, a file that cannot be read, or a profile without the limits
                that a body needs.
        """
        if isinstance(robot, RobotModel):
            return robot
        if isinstance(robot, RobotProfile):
            return _from_profile(robot)
        if Path(robot).suffix in (".yaml", ".yml"):
            return cls.from_yaml(robot)
        return cls.shipped(str(robot))

    @cached_property
    def profile(self) -> RobotProfile:
        """The profile, for adapter and planner."""
        return NOVA_CARTER if self.body == "nova_carter" else RobotProfile.of_settings(self)

    @cached_property
    def outline_m(self) -> FloatArray:
        """The corners (M, 2) of the convex outline, counter-clockwise."""
        hull = MultiPoint(self.footprint_m).convex_hull
        return np.array(hull.exterior.coords, dtype=np.float64)[-2::-1]


def shipped_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with the package, sorted."""
    files = (each.name for each in _FOLDER.iterdir() if each.name.endswith(".yaml"))
    return tuple(sorted([NOVA_CARTER_NAME, *(name.removesuffix(".yaml") for name in files)]))


def _nova_carter() -> RobotModel:
    """Return the shipped robot with wheels; its profile is :data:`NOVA_CARTER` itself."""
    return RobotModel(
        name=NOVA_CARTER_NAME,
        description="Nova Carter, a differential drive with a camera on a post.",
        body="nova_carter",
        camera_m=(CAMERA_FORWARD_M, 0.0, CAMERA_HEIGHT_M),
        height_m=CAMERA_HEIGHT_M,
        **_limits(NOVA_CARTER),
    )


def _from_profile(profile: RobotProfile) -> RobotModel:
    """Return a kinematic robot with the outline and the limits of a profile."""
    if profile.max_yaw_rate_radps is None or profile.max_yaw_acceleration_radps2 is None:
        raise SimError(
            "a robot needs max_yaw_rate_radps and max_yaw_acceleration_radps2 in its profile, got "
            f"{profile.max_yaw_rate_radps} and {profile.max_yaw_acceleration_radps2}"
        )
    x_min, y_min = profile.footprint_m.min(axis=0).tolist()
    x_max, y_max = profile.footprint_m.max(axis=0).tolist()
    front, back = DIAGONAL_SCANNERS
    return RobotModel(
        name="custom",
        camera_m=(max(x_max - 0.2, 0.5 * x_max), 0.0, CAMERA_HEIGHT_M),
        scanners=(
            front.model_copy(update={"x_m": x_max + 0.0125, "y_m": y_max + 0.01}),
            back.model_copy(update={"x_m": x_min - 0.0125, "y_m": y_min - 0.01}),
        ),
        **_limits(profile),
    )


def _limits(profile: RobotProfile) -> dict[str, Any]:
    values = {each.name: getattr(profile, each.name) for each in fields(profile)}
    return {**values, "footprint_m": tuple((x, y) for x, y in profile.footprint_m.tolist())}
