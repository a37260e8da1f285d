"""Where racks, walls and painted lines stand: a warehouse as data."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from perception.arrays import FloatArray
from tracking.config import StrictConfig

from ._errors import SimError


class RackBox(StrictConfig):
    """A pallet rack as the box that it fills; it stands on the floor, its sides along the axes."""

    error: ClassVar[type[ValueError]] = SimError

    #: Centre in odom.
    x_m: float
    y_m: float
    #: Extent along odom x.
    length_m: float = Field(gt=0.0)
    #: Extent along odom y.
    width_m: float = Field(gt=0.0)
    height_m: float = Field(default=4.0, gt=0.0)

    @property
    def box_odom_m(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max in odom."""
        half_x, half_y = 0.5 * self.length_m, 0.5 * self.width_m
        return self.x_m - half_x, self.y_m - half_y, self.x_m + half_x, self.y_m + half_y


class WarehouseLayout(StrictConfig):
    """A walled hall whose robot aisle runs along odom x about y = 0.

    ``cross_aisle_x_m`` is where an aisle along y crosses it (a zebra is painted there), or None.
    Raises pydantic's ``ValidationError`` (a ``ValueError``) or, from a file, :class:`SimError`.
    """

    error: ClassVar[type[ValueError]] = SimError

    #: The hall's inner walls.
    x_min_m: float
    y_min_m: float
    x_max_m: float
    y_max_m: float
    wall_height_m: float = Field(default=6.0, gt=0.0)
    #: Width of the robot's aisle between its painted lines.
    aisle_width_m: float = Field(default=3.0, gt=0.0)
    cross_aisle_x_m: float | None = None
    cross_aisle_width_m: float = Field(default=3.0, gt=0.0)
    racks: tuple[RackBox, ...] = ()
    #: Coulomb friction of the floor; PyBullet multiplies it with that of the wheel.
    floor_friction: float = Field(default=0.9, gt=0.0)

    @model_validator(mode="after")
    def _stands_inside(self) -> WarehouseLayout:
        if not (self.x_min_m < self.x_max_m and self.y_min_m < self.y_max_m):
            raise ValueError(
                "the hall must have x_min_m < x_max_m and y_min_m < y_max_m, got "
                f"x {self.x_min_m:g} to {self.x_max_m:g} m, "
                f"y {self.y_min_m:g} to {self.y_max_m:g} m"
            )
        for rack in self.racks:
            x_min, y_min, x_max, y_max = rack.box_odom_m
            if (
                x_min < self.x_min_m
                or y_min < self.y_min_m
                or x_max > self.x_max_m
                or y_max > self.y_max_m
            ):
                raise ValueError(
                    f"the rack at ({rack.x_m:g}, {rack.y_m:g}) m reaches outside the hall: "
                    f"it spans x {x_min:g} to {x_max:g} m, y {y_min:g} to {y_max:g} m"
                )
        return self

    @classmethod
    def crossing(cls) -> WarehouseLayout:
        """Racks on both sides of a 3 m aisle along x, crossed at x = 6 m by a 3 m aisle along y."""
        racks = [
            RackBox(x_m=x, y_m=side * y, length_m=length, width_m=1.1)
            for side in (1.0, -1.0)
            for y in (2.15, 5.65)
            for x, length in ((0.6, 7.8), (11.4, 7.8))
        ]
        return cls(
            x_min_m=-5.0,
            y_min_m=-8.5,
            x_max_m=17.0,
            y_max_m=8.5,
            cross_aisle_x_m=6.0,
            racks=tuple(racks),
        )

    @classmethod
    def open_floor(cls) -> WarehouseLayout:
        """A wide free floor with racks along its sides, as in the encounter of the paper."""
        racks = [
            RackBox(x_m=5.0, y_m=side * 5.2, length_m=13.5, width_m=1.1) for side in (1.0, -1.0)
        ]
        return cls(
            x_min_m=-5.0,
            y_min_m=-7.0,
            x_max_m=14.0,
            y_max_m=7.0,
            aisle_width_m=4.0,
            racks=tuple(racks),
        )

    @property
    def obstacle_boxes_odom(self) -> FloatArray:
        """(N, 4) x_min, y_min, x_max, y_max of the racks, then of the four walls, metres."""
        x_min, y_min, x_max, y_max = self.x_min_m, self.y_min_m, self.x_max_m, self.y_max_m
        thick = self.wall_thickness_m
        walls = [
            (x_min - thick, y_min - thick, x_min, y_max + thick),
            (x_max, y_min - thick, x_max + thick, y_max + thick),
            (x_min, y_min - thick, x_max, y_min),
            (x_min, y_max, x_max, y_max + thick),
        ]
        boxes = np.array([*(rack.box_odom_m for rack in self.racks), *walls])
        boxes.setflags(write=False)
        return boxes

    @property
    def wall_thickness_m(self) -> float:
        """Thickness of the outer walls, outside the hall's extent."""
        return 0.2
