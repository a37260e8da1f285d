"""The robot file of the bridge: profile and mounts of its sensors in one YAML file."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray
from perception.laser import Scanner

from .._config import NavConfig
from .._robot import RobotProfile

# No sensor is mounted further from the base origin.
_FARTHEST_M: Final = 10.0


def _near_base(position_m: list[float]) -> list[float]:
    if math.hypot(*position_m) > _FARTHEST_M:
        raise ValueError(
            f"must lie within {_FARTHEST_M:g} m of the base origin, got {position_m} m; is it in "
            "millimetres or centimetres?"
        )
    return position_m


# Keys of Nav2's costmaps and controllers, which people copy, and what this file has instead.
_OF_NAV2: Final = {
    "robot_radius": "give the corners of the outline in footprint_m, of a round robot those of a "
    "polygon about its circle, with 8 corners or more",
    "footprint": "give its corners in footprint_m, as a list and not as text",
    "footprint_padding": "give footprint_m with it",
    "max_vel_x": "it is max_speed_mps here",
    "vx_max": "it is max_speed_mps here",
    "acc_lim_x": "it is max_acceleration_mps2 here",
    "decel_lim_x": "it is max_deceleration_mps2 here, a positive number",
    "max_vel_theta": "it is max_yaw_rate_radps here",
    "wz_max": "it is max_yaw_rate_radps here",
}

_Position = Annotated[list[float], Field(min_length=3, max_length=3), AfterValidator(_near_base)]
_Corner = Annotated[list[float], Field(min_length=2, max_length=2)]


class CameraMount(NavConfig):
    """Position and direction of a fixed camera.

    Attributes:
        position_base_m: x, y, z of its optical centre in the base frame, metres; the base frame
            lies on the floor.
        yaw_deg: angle to the left of straight ahead.
        pitch_down_deg: angle below the horizontal.
        roll_deg: angle clockwise as seen from behind the camera: 90 for one on its right side, 180
            for one upside down. Pictures are turned to the nearest quarter turn.
    """

    position_base_m: _Position
    yaw_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    pitch_down_deg: float = Field(default=0.0, ge=-90.0, le=90.0)
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0)

    def T_base_camera(self) -> FloatArray:  # noqa: N802 - frames in names
        """(4, 4) pose of the optical frame (x right, y down, z forward) in the base frame."""
        angles = self.yaw_deg, self.pitch_down_deg, self.roll_deg
        turn = Rotation.from_euler("ZYX", angles, degrees=True)
        T = np.eye(4)
        T[:3, :3] = turn.as_matrix() @ [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
        T[:3, 3] = self.position_base_m
        return T


class ScannerMount(NavConfig):
    """Position and direction of a level laser scanner.

    Attributes:
        position_base_m: x, y, z of its centre in the base frame, metres; the base frame lies on the
            floor.
        yaw_deg: direction of its x axis, to the left of straight ahead.
        upside_down: its z axis points down.
        field_of_view_deg: lowest and highest angle about its z axis that is used; None for all.
    """

    position_base_m: _Position
    yaw_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    upside_down: bool = False
    field_of_view_deg: _Corner | None = None

    @field_validator("field_of_view_deg")
    @classmethod
    def _check_order(cls, view: list[float] | None) -> list[float] | None:
        if view is not None and not -360.0 <= view[0] < view[1] <= 360.0:
            raise ValueError(
                "field_of_view_deg must be the lowest and the highest angle, within -360 to 360, "
                f"got {view}"
            )
        return view

    @property
    def field_of_view_rad(self) -> tuple[float, float]:
        """Lowest and highest angle."""
        low, high = self.field_of_view_deg or (-360.0, 360.0)
        return math.radians(low), math.radians(high)

    def T_base_scanner(self) -> FloatArray:  # noqa: N802 - frames in names
        """(4, 4) pose of the scanner in the base frame."""
        x_m, y_m, z_m = self.position_base_m
        yaw_rad = math.radians(self.yaw_deg)
        mounted = Scanner.mounted(x_m, y_m, z_m, yaw_rad, upside_down=self.upside_down)
        return mounted.T_base_scanner


class RobotFile(NavConfig):
    """The file that ``awarenav bridge --robot`` reads.

    The bounds of :class:`~nav_adapter.RobotProfile` hold.

    Attributes:
        footprint_m: corners x, y in the base frame, metres.
        max_speed_mps: > 0.01, the maximum that the controller is configured with.
        max_acceleration_mps2: > 0.
        max_deceleration_mps2: > 0, a deceleration that the brakes always reach.
        reaction_time_s: ≥ 0, from exposure to the start of braking.
        drive: ``differential``; ``ackermann`` for a robot that steers; ``holonomic`` for one that
            can move sideways. Without it the odometry tells, and Nav2's limit is as for
            ``holonomic`` (:func:`speed_limit`). A ``differential`` or ``ackermann`` robot whose
            odometry moves sideways is stopped.
        max_yaw_rate_radps: > 0, the fastest turn of the controller, either way. This and the next
            two limit commands (``constraints.yaw_rate_limit_radps``, :mod:`nav_adapter.motion`),
            not the speed. Nav2's limit is lower for this one (:func:`speed_limit`).
        max_yaw_acceleration_radps2: > 0, the fastest change of the yaw rate.
        min_turning_radius_m: > 0, the tightest curve of the base origin; needed with ``ackermann``
            and refused with another drive.
        brakes_on_curve: true for a robot whose controller keeps to a path and slows down on it:
            people beside the path limit it less (:class:`~nav_adapter.RobotProfile`).
        camera: mount of the camera; without it the pose is read from tf.
        scanners: mounts of the laser scanners, in the order of their topics; without it the poses
            are read from tf.
    """

    footprint_m: list[_Corner]
    max_speed_mps: float = Field(gt=0.01)
    max_acceleration_mps2: float = Field(gt=0.0)
    max_deceleration_mps2: float = Field(gt=0.0)
    reaction_time_s: float = Field(ge=0.0)
    drive: Literal["differential", "ackermann", "holonomic"] | None = None
    max_yaw_rate_radps: float | None = Field(default=None, gt=0.0)
    max_yaw_acceleration_radps2: float | None = Field(default=None, gt=0.0)
    min_turning_radius_m: float | None = Field(default=None, gt=0.0)
    brakes_on_curve: bool = False
    camera: CameraMount | None = None
    scanners: list[ScannerMount] | None = Field(default=None, min_length=1, max_length=2)

    @model_validator(mode="before")
    @classmethod
    def _check_nav2(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key in _OF_NAV2:
                raise ValueError(f"unknown key {key!r} in {cls.__name__}: {_OF_NAV2[key]}")
        corners = data.get("footprint_m") if isinstance(data, dict) else None
        if isinstance(corners, str):
            raise ValueError(
                f"footprint_m must be a list of corners, got the text {corners!r:.60}: leave out "
                "its quotation marks"
            )
        return data

    @model_validator(mode="after")
    def _has_a_profile(self) -> RobotFile:
        self.profile()
        return self

    def profile(self) -> RobotProfile:
        """Return the robot's profile."""
        return RobotProfile.of_settings(self)
