"""The settings of a simulated scanner: mounting, rays, noise and timing."""

from __future__ import annotations

import math
from typing import Final

from pydantic import Field, model_validator

from perception.arrays import FloatArray
from perception.laser import Scanner

from ..camera import CameraTiming
from ..config import SimConfig


class ScannerSpec(SimConfig):
    """A 2-D laser scanner on a robot; the defaults are those of a common safety scanner.

    Attributes:
        x_m: place ahead of the base frame's origin.
        y_m: place to its left.
        z_m: height above the floor.
        yaw_deg: direction of the scanner's x axis from the robot's, left positive.
        upside_down: its rays turn clockwise.
        field_of_view_deg: lowest and highest angle of its rays about its own z axis.
        resolution_deg: angle between rays.
        range_min_m: shortest range; what is nearer returns −inf.
        range_max_m: longest range; +inf without a return.
        noise_std_m: standard deviation of a range.
        dropout_rate: probability that a ray gives no return (+inf) from any surface.
        dark_dropout_rate: the same from black clothes, in addition; it falls to 0 at a reflectance
            of 30 %.
        timing: sweeps per second, losses and delays.
        scan_share: share of a turn's time that the mirror needs for a turn; 0 measures all rays at
            one instant, 1 is a mirror that turns at the rate of the sweeps.
    """

    x_m: float = 0.375
    y_m: float = 0.0
    z_m: float = Field(default=0.2, gt=0.0, le=2.0)
    yaw_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    upside_down: bool = False
    field_of_view_deg: tuple[float, float] = (-135.0, 135.0)
    resolution_deg: float = Field(default=0.375, ge=0.05, le=5.0)
    range_min_m: float = Field(default=0.05, ge=0.0)
    range_max_m: float = Field(default=20.0, gt=0.0, le=200.0)
    noise_std_m: float = Field(default=0.015, ge=0.0, le=0.5)
    dropout_rate: float = Field(default=0.001, ge=0.0, le=1.0)
    dark_dropout_rate: float = Field(default=0.1, ge=0.0, le=1.0)
    timing: CameraTiming = CameraTiming(rate_hz=25.0)
    scan_share: float = Field(default=1.0, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _in_order(self) -> ScannerSpec:
        low, high = self.field_of_view_deg
        if not low < high <= low + 360.0:
            raise ValueError(
                "field_of_view_deg must be the lowest and the highest angle, at most 360° apart, "
                f"got {low:g} and {high:g}"
            )
        if self.range_min_m >= self.range_max_m:
            raise ValueError(
                f"range_max_m must exceed range_min_m, got {self.range_max_m:g} and "
                f"{self.range_min_m:g} m"
            )
        return self

    @property
    def rays(self) -> int:
        """The number of rays of a sweep; a full turn does not repeat its first ray."""
        low, high = self.field_of_view_deg
        count = math.floor((high - low) / self.resolution_deg + 1e-9) + 1
        return min(count, max(round(360.0 / self.resolution_deg), 1))

    @property
    def time_increment_s(self) -> float:
        """The time from one ray to the next."""
        rate_hz = self.timing.rate_hz
        if rate_hz is None:
            return 0.0
        return self.scan_share * self.resolution_deg / 360.0 / rate_hz

    def scanner(self, body_base_m: FloatArray | None = None) -> Scanner:
        """Return the mounting, with the outline (M, 2) of the robot's body in the base frame."""
        low, high = self.field_of_view_deg
        return Scanner.mounted(
            self.x_m,
            self.y_m,
            self.z_m,
            math.radians(self.yaw_deg),
            upside_down=self.upside_down,
            field_of_view_rad=(math.radians(low), math.radians(high)),
            body_base_m=body_base_m,
        )


#: Two scanners of 270° on opposite corners of the robot, which together see all around.
DIAGONAL_SCANNERS: Final = (
    ScannerSpec(x_m=0.375, y_m=0.26, yaw_deg=45.0),
    ScannerSpec(x_m=-0.375, y_m=-0.26, yaw_deg=-135.0),
)
