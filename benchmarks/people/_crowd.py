"""Simulated crowds in the layout of the recordings: two groups, or one, walk across a yard."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from sim_tests.actors.behaviour import (
    Glances,
    MovingBody,
    Person,
    PersonSpec,
    RobotBody,
    Surroundings,
    habits_of,
)

from ._motion import RATE_HZ, Scene

# Groups start within this area, on either side of the yard, and walk on beyond its other side.
_WIDTH_M: Final = 3.4
_DEPTH_M: Final = 5.0
_LENGTH_M: Final = 13.0
_BEYOND_M: Final = 12.0
_SPACING_M: Final = 0.85
# People walk for this time before they are recorded.
_BEFORE_S: Final = 1.5
_SHOWN_S: Final = 7.5
_NO_BOXES: Final = np.zeros((0, 4))
# The vehicle: a utility cart that drives across the middle, and waits for nobody.
_CART_M: Final = (1.2, 0.65)
_CART_MPS: Final = 1.4
_CART_FROM_M: Final = -8.0


@dataclass(frozen=True)
class Layout:
    """Layout of a crowd: people of the two groups, and whether a cart crosses their way."""

    up: int
    down: int
    cart: bool = False


#: One layout for each of the six clips.
LAYOUTS: Final = (
    Layout(7, 3),
    Layout(5, 5),
    Layout(8, 0, cart=True),
    Layout(4, 4, cart=True),
    Layout(4, 4, cart=True),
    Layout(0, 8, cart=True),
)


def simulate(layout: Layout, seed: int, people: str = "classic") -> Scene:
    """Return a crowd that walks across the yard.

    Args:
        layout: of the crowd.
        seed: the same seed gives the same crowd.
        people: the population: ``"classic"`` or ``"recorded"``.
    """
    rng = np.random.default_rng(seed)
    starts = _places(layout.up, rng), _places(layout.down, rng)
    walkers = []
    for side, group in zip((1.0, -1.0), starts, strict=True):
        for x, y in group:
            aside = float(rng.normal(0.0, 0.4))
            spec = PersonSpec.model_validate(
                {
                    "name": f"person {len(walkers)}",
                    "route": [
                        {"x_m": x, "y_m": -side * (0.5 * _LENGTH_M + y)},
                        {"x_m": x + aside, "y_m": side * (0.5 * _LENGTH_M + _BEYOND_M)},
                    ],
                    "speed_mps": float(np.clip(rng.normal(1.34, 0.15), 1.0, 1.7)),
                    "glances": Glances(notices_within_m=25.0),
                }
            )
            own = rng.spawn(1)[0]
            walkers.append(Person(spec, own, _NO_BOXES, habits=habits_of(people)))
    return _recorded(walkers, layout.cart)


def _places(count: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return places in the start area that are not too near to each other."""
    places: list[tuple[float, float]] = []
    while len(places) < count:
        place = float(rng.uniform(-0.5, 0.5) * _WIDTH_M), float(rng.uniform(0.0, _DEPTH_M))
        if all(math.dist(place, other) > _SPACING_M for other in places):
            places.append(place)
    return places


def _recorded(walkers: list[Person], cart: bool) -> Scene:
    """Let people walk; return their positions, sampled like a recording."""
    frames = round((_BEFORE_S + _SHOWN_S) * RATE_HZ)
    first = round(_BEFORE_S * RATE_HZ)
    shown: FloatArray = np.zeros((len(walkers), frames - first, 2))
    bodies = [MovingBody(*walker.place_odom_m, 0.0, 0.0) for walker in walkers]
    for frame in range(frames):
        t_s = frame / RATE_HZ
        robot = _cart(t_s) if cart else None
        for index, walker in enumerate(walkers):
            others = tuple(bodies[:index] + bodies[index + 1 :])
            walker.advance(t_s, Surroundings(robot, others, _always))
        for index, walker in enumerate(walkers):
            x, y = walker.place_odom_m
            before = bodies[index]
            bodies[index] = MovingBody(x, y, (x - before.x_m) * RATE_HZ, (y - before.y_m) * RATE_HZ)
            if frame >= first:
                shown[index, frame - first] = x, y
    return Scene(shown, vehicle=cart)


def _cart(t_s: float) -> RobotBody:
    x = _CART_FROM_M + _CART_MPS * t_s
    return RobotBody(x, 0.0, 0.0, _CART_MPS, 0.0, *_CART_M, (x, 0.0, 1.2))


def _always() -> bool:
    return True
