"""Props of a hall as data: pallets, trucks, containers, shelves, bins, barriers and posts."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..config import SimConfig


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
