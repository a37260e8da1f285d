"""A hall as data: props, the layout of walls, aisles and racks, and the lighting.

Props are pallets, trucks, containers, shelves, bins, barriers and posts.
"""

from __future__ import annotations

import math
from functools import cache
from importlib import resources
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from pydantic import Field, field_validator, model_validator

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..config import SimConfig
from ..errors import SimError


class PropPart(NamedTuple):
    """A solid box of a prop; it stands on the floor, in the prop's frame (x forward, y left)."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    height_m: float


def _single(length_m: float, width_m: float, height_m: float) -> tuple[PropPart, ...]:
    return (PropPart(0.0, 0.0, length_m, width_m, height_m),)


#: The solid boxes of every kind of prop. Euro pallets are 1.2 m × 0.8 m.
PROP_PARTS: Final[dict[str, tuple[PropPart, ...]]] = {
    "pallet": _single(1.2, 0.8, 0.15),
    "pallet_stack": _single(1.2, 0.8, 1.04),
    "pallet_goods": _single(1.2, 0.8, 1.30),
    "pallet_wrapped": _single(1.2, 0.8, 1.75),
    "pallet_sacks": _single(1.2, 0.8, 0.95),
    "pallet_drums": _single(1.2, 0.8, 1.02),
    "pallet_truck": (
        PropPart(-0.2, 0.0, 1.15, 0.54, 0.20),
        PropPart(0.48, 0.0, 0.21, 0.40, 0.56),
        PropPart(0.64, 0.0, 0.10, 0.10, 1.22),
    ),
    "stacker": (
        PropPart(-0.55, 0.0, 1.1, 0.56, 0.12),
        PropPart(0.1, 0.0, 0.2, 0.78, 2.0),
        PropPart(0.5, 0.0, 0.6, 0.78, 1.15),
    ),
    "forklift": (
        PropPart(1.35, 0.0, 1.0, 0.80, 0.12),
        PropPart(0.74, 0.0, 0.22, 0.96, 2.15),
        PropPart(-0.06, 0.0, 1.38, 1.06, 2.10),
        PropPart(-1.0, 0.0, 0.5, 1.06, 1.05),
    ),
    "roller_container": _single(0.8, 0.7, 1.70),
    "shelf": _single(1.2, 0.45, 2.0),
    "crates": _single(0.6, 0.4, 1.25),
    "bin": _single(0.6, 0.55, 1.08),
    "barrier": _single(2.0, 0.12, 0.42),
    "post": _single(0.16, 0.16, 1.0),
}

# Corners of a rectangle of half extents 1, counter-clockwise from its back right.
_UNIT_CORNERS: Final = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


class Prop(SimConfig):
    """A thing on the floor: its kind and its place.

    Its frame has x forward (forks point along −x for pallet truck and stacker, along +x for the
    forklift) and its origin near the middle of its footprint. Its collision shape is the
    axis-aligned bound of each part: exact at multiples of 90°, larger in between.

    Attributes:
        kind: one of :data:`PROP_PARTS`.
        x_m: place of the origin in odom.
        y_m: place of the origin in odom.
        yaw_deg: heading, counter-clockwise from odom x.
    """

    kind: str
    x_m: float
    y_m: float
    yaw_deg: float = Field(default=0.0, ge=-360.0, le=360.0)

    @field_validator("kind", mode="before")
    @classmethod
    def _is_known(cls, value: Any) -> Any:
        if value not in PROP_PARTS:
            raise ValueError(not_one_of("kind", value, PROP_PARTS))
        return value

    @property
    def turn(self) -> tuple[float, float]:
        """The cosine and sine of the yaw, exact at multiples of 90°."""
        quarters = self.yaw_deg / 90.0
        if quarters == round(quarters):
            return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
        yaw = math.radians(self.yaw_deg)
        return math.cos(yaw), math.sin(yaw)

    @property
    def corners_odom_m(self) -> FloatArray:
        """Corners (K, 4, 2) of each part's footprint, counter-clockwise from its back right."""
        cos, sin = self.turn
        parts = np.array([part[:4] for part in PROP_PARTS[self.kind]])
        corners = parts[:, None, :2] + 0.5 * _UNIT_CORNERS * parts[:, None, 2:]
        return np.asarray(corners @ np.array([[cos, sin], [-sin, cos]]) + (self.x_m, self.y_m))

    @property
    def boxes_odom_m(self) -> tuple[tuple[float, float, float, float], ...]:
        """The bounds x_min, y_min, x_max, y_max of each part."""
        corners = self.corners_odom_m
        bounds = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
        return tuple((x0, y0, x1, y1) for x0, y0, x1, y1 in bounds.tolist())

    @property
    def heights_m(self) -> tuple[float, ...]:
        """The height of each part."""
        return tuple(part.height_m for part in PROP_PARTS[self.kind])


_Positive = Annotated[float, Field(gt=0.0)]
# Thickness of the outer walls, outside the hall's extent.
_WALL_THICKNESS_M: Final = 0.2
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
        thick = _WALL_THICKNESS_M
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


@cache
def _shipped(name: str) -> WarehouseLayout:
    with resources.as_file(resources.files(__package__) / "layouts" / f"{name}.yaml") as path:
        return WarehouseLayout.from_yaml(path)


_Share = Annotated[float, Field(ge=0.0, le=1.0)]
# Largest ambient + diffuse: a white surface that faces the light is then barely washed out.
_MAX_BRIGHTNESS: Final = 1.06


class Lighting(SimConfig):
    """A directional light and an ambient light of the same colour.

    A face of colour c whose normal makes the angle φ with the direction to the light shows
    ``c * colour_rgb * (ambient + diffuse * max(0, cos φ))``.
    """

    #: From the scene towards the light, in odom; any length > 0.
    direction_odom: tuple[float, float, float] = (-3.0, 4.0, 8.0)
    #: Colour of both lights.
    colour_rgb: tuple[_Share, _Share, _Share] = (1.0, 1.0, 1.0)
    ambient: float = Field(default=0.66, ge=0.0, le=1.0)
    diffuse: float = Field(default=0.40, ge=0.0, le=1.0)
    #: Strength of highlights, which only the renderer ``"tiny"`` draws; matt surfaces have none.
    specular: float = Field(default=0.0, ge=0.0, le=1.0)
    #: Whether people, robots and other actors cast shadows on the floor. The soft shade around
    #: racks and props is always there: it is painted on the floor.
    shadows: bool = False

    @model_validator(mode="after")
    def _is_usable(self) -> Lighting:
        if math.hypot(*self.direction_odom) < 1e-6:
            raise ValueError(
                f"direction_odom must point towards the light, got {self.direction_odom}"
            )
        if self.ambient + self.diffuse > _MAX_BRIGHTNESS:
            raise ValueError(
                f"ambient + diffuse must be at most {_MAX_BRIGHTNESS:g}, or surfaces that face "
                f"the light wash out, got {self.ambient:g} + {self.diffuse:g}"
            )
        return self

    @classmethod
    def preset(cls, name: str) -> Lighting:
        """Return one of :data:`LIGHTINGS` by its name; raises SimError for other names."""
        if name not in LIGHTINGS:
            raise SimError(not_one_of("lighting", name, LIGHTINGS))
        return LIGHTINGS[name]


#: Presets by name. ``bright_led``, the default, lights from high up and from one side, so that
#: faces and folds of cloth keep their shape.
LIGHTINGS: Final[dict[str, Lighting]] = {
    "bright_led": Lighting(),
    "overcast_skylight": Lighting(
        direction_odom=(1.0, -1.0, 9.0), colour_rgb=(0.94, 0.97, 1.0), ambient=0.74, diffuse=0.26
    ),
    "warm_sodium": Lighting(
        direction_odom=(2.0, 3.0, 8.0), colour_rgb=(1.0, 0.87, 0.66), ambient=0.52, diffuse=0.42
    ),
    "dock_daylight": Lighting(
        direction_odom=(9.0, -2.5, 3.0), colour_rgb=(1.0, 0.99, 0.95), ambient=0.46, diffuse=0.58
    ),
    "low_sun": Lighting(
        direction_odom=(-4.0, -5.0, 5.5), colour_rgb=(1.0, 0.93, 0.80), ambient=0.44, diffuse=0.60
    ),
    "dim_evening": Lighting(
        direction_odom=(-2.0, -3.0, 8.0), colour_rgb=(1.0, 0.95, 0.86), ambient=0.40, diffuse=0.36
    ),
    "night": Lighting(
        direction_odom=(3.0, 1.0, 6.0), colour_rgb=(0.86, 0.92, 1.0), ambient=0.27, diffuse=0.34
    ),
}
