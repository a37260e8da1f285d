"""The layout of a warehouse as data: walls, aisles, racks and props, and the shipped layouts."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..config import SimConfig
from ..errors import SimError
from ._props import Prop

_Positive = Annotated[float, Field(gt=0.0)]
#: Names of the shipped layouts.
LAYOUTS: Final = ("crossing", "open", "blind_corner", "aisles", "staging_hall")


class RackBox(SimConfig):
    """A pallet rack as the box that it fills; it stands on the floor, its sides along the axes.

    Attributes:
        x_m: centre in odom.
        y_m: centre in odom.
        length_m: extent along odom x.
        width_m: extent along odom y.
        height_m: height above the floor.
    """

    x_m: float
    y_m: float
    length_m: _Positive
    width_m: _Positive
    height_m: _Positive = 4.0

    @property
    def box_odom_m(self) -> tuple[float, float, float, float]:
        """The bounds x_min, y_min, x_max, y_max."""
        half_x, half_y = 0.5 * self.length_m, 0.5 * self.width_m
        return self.x_m - half_x, self.y_m - half_y, self.x_m + half_x, self.y_m + half_y


class WarehouseLayout(SimConfig):
    """A walled hall; the robot's aisle runs along odom x, centred on y = 0.

    Attributes:
        x_min_m: inner side of the wall towards negative odom x.
        y_min_m: inner side of the wall towards negative odom y.
        x_max_m: inner side of the wall towards positive odom x.
        y_max_m: inner side of the wall towards positive odom y.
        wall_height_m: height of the walls.
        aisle_width_m: width of the robot's aisle between its painted lines.
        cross_aisle_x_m: centre of an aisle along y that crosses the robot's aisle at a painted
            zebra; None for no such aisle.
        cross_aisle_width_m: width of that aisle.
        racks: pallet racks.
        props: other things on the floor.
        floor_friction: Coulomb friction of the floor; PyBullet multiplies it by the wheel's.

    Raises pydantic's ``ValidationError`` (a ``ValueError``) or, from a file, :class:`SimError`.
    """

    x_min_m: float
    y_min_m: float
    x_max_m: float
    y_max_m: float
    wall_height_m: _Positive = 6.0
    aisle_width_m: _Positive = 3.0
    cross_aisle_x_m: float | None = None
    cross_aisle_width_m: _Positive = 3.0
    racks: tuple[RackBox, ...] = ()
    props: tuple[Prop, ...] = ()
    floor_friction: _Positive = 0.9

    @model_validator(mode="after")
    def _fits_inside(self) -> WarehouseLayout:
        if not (self.x_min_m < self.x_max_m and self.y_min_m < self.y_max_m):
            raise ValueError(
                "the hall must have x_min_m < x_max_m and y_min_m < y_max_m, got "
                f"x {self.x_min_m:g} to {self.x_max_m:g} m, "
                f"y {self.y_min_m:g} to {self.y_max_m:g} m"
            )
        for rack in self.racks:
            self._check_inside("rack", (rack.x_m, rack.y_m), rack.box_odom_m)
        for prop in self.props:
            for box in prop.boxes_odom_m:
                self._check_inside(prop.kind, (prop.x_m, prop.y_m), box)
        return self

    def _check_inside(
        self, what: str, position_m: tuple[float, float], box_odom_m: tuple[float, ...]
    ) -> None:
        x_min, y_min, x_max, y_max = box_odom_m
        if (
            x_min < self.x_min_m
            or y_min < self.y_min_m
            or x_max > self.x_max_m
            or y_max > self.y_max_m
        ):
            raise ValueError(
                f"the {what} at ({position_m[0]:g}, {position_m[1]:g}) m reaches outside the hall: "
                f"it spans x {x_min:g} to {x_max:g} m, y {y_min:g} to {y_max:g} m"
            )

    @classmethod
    def named(cls, name: str) -> WarehouseLayout:
        """Return one of :data:`LAYOUTS` by its name; raises SimError for other names."""
        if name not in LAYOUTS:
            raise SimError(not_one_of("layout", name, LAYOUTS))
        return _shipped(name)

    @property
    def obstacle_boxes_odom(self) -> FloatArray:
        """The bounds (N, 4) x_min, y_min, x_max, y_max in metres: racks, the four walls, props."""
        x_min, y_min, x_max, y_max = self.x_min_m, self.y_min_m, self.x_max_m, self.y_max_m
        thick = self.wall_thickness_m
        walls = [
            (x_min - thick, y_min - thick, x_min, y_max + thick),
            (x_max, y_min - thick, x_max + thick, y_max + thick),
            (x_min, y_min - thick, x_max, y_min),
            (x_min, y_max, x_max, y_max + thick),
        ]
        props = [box for prop in self.props for box in prop.boxes_odom_m]
        boxes = np.array([*(rack.box_odom_m for rack in self.racks), *walls, *props])
        boxes.setflags(write=False)
        return boxes

    @property
    def obstacle_heights_m(self) -> FloatArray:
        """The heights (N,) of :attr:`obstacle_boxes_odom` above the floor."""
        racks = [rack.height_m for rack in self.racks]
        props = [height for prop in self.props for height in prop.heights_m]
        heights = np.array([*racks, *[self.wall_height_m] * 4, *props])
        heights.setflags(write=False)
        return heights

    @property
    def wall_thickness_m(self) -> float:
        """The thickness of the outer walls, outside the hall's extent."""
        return 0.2


@cache
def _shipped(name: str) -> WarehouseLayout:
    with resources.as_file(resources.files(__package__) / "layouts" / f"{name}.yaml") as path:
        return WarehouseLayout.from_yaml(path)
