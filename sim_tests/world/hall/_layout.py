"""The layout of a warehouse as data: walls, aisles, racks and props, and the shipped layouts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..config import SimConfig
from ..errors import SimError
from ._props import Prop

_Positive = Annotated[float, Field(gt=0.0)]
# Depth of the racks of every shipped layout.
_RACK_DEPTH_M: Final = 1.1


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
    def crossing(cls) -> WarehouseLayout:
        """Return a 3 m aisle along x between racks, crossed at x = 6 m by a 3 m aisle along y."""
        return cls(
            x_min_m=-5.0,
            y_min_m=-8.5,
            x_max_m=17.0,
            y_max_m=8.5,
            cross_aisle_x_m=6.0,
            racks=_racks_on_both_sides((2.15, 5.65), (0.6, 11.4), 7.8),
        )

    @classmethod
    def open_floor(cls) -> WarehouseLayout:
        """Return a wide free floor with racks along its sides, as in the paper's encounter."""
        return cls(
            x_min_m=-5.0,
            y_min_m=-7.0,
            x_max_m=14.0,
            y_max_m=7.0,
            aisle_width_m=4.0,
            racks=_racks_on_both_sides((5.2,), (5.0,), 13.5),
        )

    @classmethod
    def blind_corner(cls) -> WarehouseLayout:
        """Return a 3 m aisle along x that turns left at x = 6 m, behind racks that hide it."""
        return cls(
            x_min_m=-4.5,
            y_min_m=-4.5,
            x_max_m=10.5,
            y_max_m=12.5,
            cross_aisle_x_m=6.0,
            racks=(
                _rack(2.75, -2.15, 11.7),
                _rack(0.6, 2.15, 7.8),
                RackBox(x_m=3.95, y_m=6.65, length_m=_RACK_DEPTH_M, width_m=7.9),
                RackBox(x_m=8.05, y_m=4.5, length_m=_RACK_DEPTH_M, width_m=12.2),
            ),
            props=(
                Prop(kind="pallet_truck", x_m=7.0, y_m=8.6, yaw_deg=90.0),
                Prop(kind="pallet_wrapped", x_m=1.6, y_m=5.2, yaw_deg=90.0),
                Prop(kind="pallet_goods", x_m=0.2, y_m=5.2, yaw_deg=90.0),
                Prop(kind="roller_container", x_m=-3.6, y_m=3.4),
                Prop(kind="bin", x_m=-4.0, y_m=-3.2, yaw_deg=90.0),
                Prop(kind="barrier", x_m=9.55, y_m=-3.0, yaw_deg=90.0),
                Prop(kind="post", x_m=4.6, y_m=1.35),
            ),
        )

    @classmethod
    def aisles(cls) -> WarehouseLayout:
        """Return five aisles along x between six rows of racks; a 3 m aisle along y crosses all."""
        return cls(
            x_min_m=-5.0,
            y_min_m=-10.5,
            x_max_m=21.0,
            y_max_m=10.5,
            wall_height_m=7.0,
            cross_aisle_x_m=7.8,
            racks=_racks_on_both_sides((2.15, 5.85, 7.0), (1.75, 13.85), 9.1),
            props=(
                Prop(kind="stacker", x_m=-3.95, y_m=6.4, yaw_deg=180.0),
                Prop(kind="pallet_truck", x_m=12.4, y_m=4.85, yaw_deg=180.0),
                Prop(kind="pallet_goods", x_m=4.4, y_m=-4.85),
                Prop(kind="pallet_stack", x_m=-4.3, y_m=-3.4, yaw_deg=90.0),
                Prop(kind="pallet_stack", x_m=-4.3, y_m=-4.9, yaw_deg=90.0),
                Prop(kind="roller_container", x_m=20.3, y_m=3.6, yaw_deg=90.0),
                Prop(kind="roller_container", x_m=20.3, y_m=4.6, yaw_deg=90.0),
                Prop(kind="bin", x_m=20.4, y_m=-3.0),
                Prop(kind="crates", x_m=20.4, y_m=-4.2, yaw_deg=90.0),
                *(Prop(kind="post", x_m=x, y_m=y) for x in (6.4, 9.2) for y in (1.4, -1.4)),
            ),
        )

    @classmethod
    def staging_hall(cls) -> WarehouseLayout:
        """Return a wide hall: racks on its left, waiting pallets and parked trucks on its right.

        The robot's aisle is 4 m wide; people step out between the pallets.
        """
        pallets = [
            Prop(kind=kind, x_m=x, y_m=y, yaw_deg=90.0)
            for x, kinds in (
                (-2.4, ("pallet_wrapped", "pallet_wrapped", "pallet_goods")),
                (-1.3, ("pallet_wrapped", "pallet_goods", "pallet")),
                (2.6, ("pallet_goods", "pallet_drums", "pallet_sacks")),
                (3.7, ("pallet_goods", "pallet_sacks", "pallet_stack")),
                (9.4, ("pallet_wrapped", "pallet_goods", "pallet_goods")),
                (13.0, ("pallet_wrapped", "pallet_wrapped", "pallet_stack")),
                (14.1, ("pallet_wrapped", "pallet_drums", "pallet")),
            )
            for y, kind in zip((-6.1, -4.8, -3.5), kinds, strict=True)
        ]
        return cls(
            x_min_m=-6.0,
            y_min_m=-9.5,
            x_max_m=18.0,
            y_max_m=9.0,
            wall_height_m=7.0,
            aisle_width_m=4.0,
            cross_aisle_x_m=6.5,
            cross_aisle_width_m=2.6,
            racks=(
                _rack(0.9, 4.3, 7.8),
                _rack(12.1, 4.3, 7.8),
                _rack(0.9, 5.45, 7.8),
                _rack(12.1, 5.45, 7.8),
            ),
            props=(
                *pallets,
                Prop(kind="forklift", x_m=11.2, y_m=-5.0, yaw_deg=-90.0),
                Prop(kind="pallet_truck", x_m=0.6, y_m=-4.4, yaw_deg=90.0),
                Prop(kind="stacker", x_m=16.6, y_m=2.2, yaw_deg=-90.0),
                Prop(kind="roller_container", x_m=-5.4, y_m=2.9, yaw_deg=90.0),
                Prop(kind="roller_container", x_m=-5.4, y_m=3.9, yaw_deg=90.0),
                Prop(kind="roller_container", x_m=-5.4, y_m=-3.6, yaw_deg=90.0),
                Prop(kind="shelf", x_m=-5.7, y_m=6.4, yaw_deg=90.0),
                Prop(kind="shelf", x_m=-5.7, y_m=7.7, yaw_deg=90.0),
                Prop(kind="crates", x_m=-4.9, y_m=-6.4, yaw_deg=90.0),
                Prop(kind="crates", x_m=-4.4, y_m=-6.4, yaw_deg=90.0),
                Prop(kind="bin", x_m=17.4, y_m=-3.0, yaw_deg=180.0),
                Prop(kind="bin", x_m=17.4, y_m=-3.8, yaw_deg=180.0),
                *(Prop(kind="barrier", x_m=x, y_m=3.2) for x in (-1.4, 0.8, 3.0)),
                *(Prop(kind="post", x_m=x, y_m=-2.5) for x in (5.0, 8.0)),
            ),
        )

    @classmethod
    def named(cls, name: str) -> WarehouseLayout:
        """Return one of :data:`LAYOUTS` by its name; raises SimError for other names."""
        if name not in LAYOUTS:
            raise SimError(not_one_of("layout", name, LAYOUTS))
        return LAYOUTS[name]()

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


def _rack(x_m: float, y_m: float, length_m: float) -> RackBox:
    """Return a rack along x."""
    return RackBox(x_m=x_m, y_m=y_m, length_m=length_m, width_m=_RACK_DEPTH_M)


def _racks_on_both_sides(
    y_m: Sequence[float], x_m: Sequence[float], length_m: float
) -> tuple[RackBox, ...]:
    """Return racks along x at every distance ``y_m`` and every ``x_m``: the left side's first."""
    return tuple(_rack(x, side * y, length_m) for side in (1.0, -1.0) for y in y_m for x in x_m)


#: The shipped layouts by name.
LAYOUTS: Final[dict[str, Callable[[], WarehouseLayout]]] = {
    "crossing": WarehouseLayout.crossing,
    "open": WarehouseLayout.open_floor,
    "blind_corner": WarehouseLayout.blind_corner,
    "aisles": WarehouseLayout.aisles,
    "staging_hall": WarehouseLayout.staging_hall,
}
