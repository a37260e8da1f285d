"""The floor in the camera frame, and the depth at which rays meet it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from .arrays import FloatArray, finite_number, rigid_transform, set_fields, unit_vector
from .errors import PerceptionError

# Sine of the angle between ray and floor. A flatter ray meets the floor too far away to be useful.
_HORIZON_SINE: Final = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlane:
    """A flat floor in the camera frame: ``normal_camera · p + height_m = 0`` for its points p.

    Attributes:
        normal_camera: (3,) unit vector up from the floor, in the camera frame.
        height_m: height of the camera's centre above the floor, > 0.
        height_std_m: standard deviation of the height, ≥ 0.
        tilt_std_rad: standard deviation of the normal's direction per axis, ≥ 0; it includes the
            error of the camera's mount and the pitching of the robot.
    """

    normal_camera: FloatArray
    height_m: float
    height_std_m: float = 0.02
    tilt_std_rad: float = 0.01

    def __post_init__(self) -> None:
        set_fields(
            self,
            normal_camera=unit_vector("normal_camera", self.normal_camera),
            height_m=finite_number("height_m", self.height_m, minimum=0.0, exclusive_minimum=True),
            height_std_m=finite_number("height_std_m", self.height_std_m, minimum=0.0),
            tilt_std_rad=finite_number("tilt_std_rad", self.tilt_std_rad, minimum=0.0),
        )

    @classmethod
    def from_pose(
        cls, T_odom_camera: Any, *, height_std_m: float = 0.02, tilt_std_rad: float = 0.01
    ) -> FloorPlane:
        """Return the floor z = 0 of odom for a camera at ``T_odom_camera`` (4, 4).

        Raises:
            PerceptionError: for an invalid transform, or a camera that is not above z = 0.
        """
        pose = rigid_transform("T_odom_camera", T_odom_camera)
        if pose[2, 3] <= 0.0:
            raise PerceptionError(
                "T_odom_camera must put the camera above the floor z = 0 of odom, got "
                f"z = {pose[2, 3]:g} m"
            )
        return cls(pose[2, :3], float(pose[2, 3]), height_std_m, tilt_std_rad)

    def in_view(self, rotation_camera_view: FloatArray) -> FloorPlane:
        """Return the floor in the frame of a view that is turned by (3, 3) against the camera."""
        return replace(self, normal_camera=rotation_camera_view.T @ self.normal_camera)

    def depth_of(
        self, rays: FloatArray, above_m: float, above_std_m: float, ray_std: float | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the depths at which rays meet the plane ``above_m`` above the floor.

        Args:
            rays: (N, 2) x/z and y/z of points known to be at that height.
            above_m: height above the floor, ≥ 0.
            above_std_m: standard deviation of that height.
            ray_std: standard deviation of each of the two coordinates of a ray; one for all rays,
                or (N,).

        Returns:
            (N,) depths z in metres and (N,) standard deviations of their logarithms, first order.
            Both are NaN for a ray at or above the horizon.
        """
        points = np.ones((len(rays), 3))
        points[:, :2] = rays
        sine = -points @ self.normal_camera
        clearance = self.height_m - above_m
        length = np.sqrt((points * points).sum(axis=1))
        meets = (sine > _HORIZON_SINE * length) & (clearance > 0.0)
        down = np.where(meets, sine, np.nan)
        height = math.hypot(self.height_std_m, above_std_m) / max(clearance, 1e-9)
        # sine = −n·ray: a tilt of n by δ changes it by |ray| δ, an error of the ray by n's
        # components.
        across = math.hypot(*self.normal_camera[:2].tolist())
        tilted, moved = self.tilt_std_rad * length / down, ray_std * across / down
        return clearance / down, np.sqrt(height * height + tilted * tilted + moved * moved)
