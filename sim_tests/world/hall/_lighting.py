"""The lighting of a hall: one directional light, ambient light, and presets of both."""

from __future__ import annotations

import math
from typing import Annotated, Final

from pydantic import Field, model_validator

from awarenav.errors import not_one_of

from ..config import SimConfig
from ..errors import SimError

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
        direction_odom=(-4.0, -5.0, 5.5),
        colour_rgb=(1.0, 0.93, 0.80),
        ambient=0.44,
        diffuse=0.60,
    ),
    "dim_evening": Lighting(
        direction_odom=(-2.0, -3.0, 8.0), colour_rgb=(1.0, 0.95, 0.86), ambient=0.40, diffuse=0.36
    ),
    "night": Lighting(
        direction_odom=(3.0, 1.0, 6.0), colour_rgb=(0.86, 0.92, 1.0), ambient=0.27, diffuse=0.34
    ),
}
