"""Random workers as training data of the networks; none of them ships."""

from __future__ import annotations

import colorsys
from typing import Final

import numpy as np

from ._people import build
from ._person import Colour, Person

# Ends of the range of skin tones.
_LIGHT_SKIN: Final = np.array([242.0, 202.0, 178.0])
_DARK_SKIN: Final = np.array([70.0, 46.0, 36.0])
_HAIR: Final = (
    (24, 20, 20), (52, 34, 24), (96, 62, 40), (150, 112, 66),
    (196, 158, 98), (140, 62, 30), (134, 132, 130), (206, 204, 200),
)  # fmt: skip
_HI_VIS: Final = ((214, 236, 40), (250, 104, 24), (240, 60, 110), (120, 220, 60))
_TOPS: Final = ("tshirt", "polo", "shirt", "checked", "hoodie", "jacket", "overalls")
_STYLES: Final = ("short", "crop", "bob", "bun", "ponytail", "bald")
_FACES: Final = (
    "nose-hump-incr",
    "nose-scale-horiz-incr",
    "nose-scale-vert-incr",
    "mouth-lowerlip-volume-incr",
    "chin-width-incr",
    "head-fat-incr",
    "neck-double-incr",
)


def random_person(number: int, seed: int = 0) -> Person:
    """Return person ``number`` of a crowd; the same seed gives the same person.

    Women and men, 18 to 70 years, 1.48 to 2.00 m, any build, skin, hair and work wear. Half of them
    wear caps or helmets, as most people in a warehouse do.
    """
    rng = np.random.default_rng([seed, number])
    woman = bool(rng.random() < 0.5)
    age = float(rng.uniform(0.62, 0.95))
    stature = float(np.clip(rng.normal(1.66 if woman else 1.79, 0.07), 1.48, 2.00))
    weight = float(np.clip(rng.normal(0.5, 0.13), 0.32, 0.85))
    hat = str(rng.choice(["none", "cap", "helmet"], p=[0.5, 0.22, 0.28]))
    hair = str(rng.choice(_STYLES, p=_styles(woman)))
    top_colour = _colour(rng)
    vest = _HI_VIS[int(rng.integers(len(_HI_VIS)))] if rng.random() < 0.45 else None
    # As many thin as heavy people: networks trained on heavy heads only take heads for near.
    girth = float(np.clip(rng.normal(0.05, 0.45), -0.8, 1.1))
    changes = build(girth, max(0.0, 0.35 * girth * float(rng.random())))
    for name in rng.choice(_FACES, size=3, replace=False):
        change = changes.get(str(name), 0.0) + float(rng.uniform(-0.5, 0.6))
        changes[str(name)] = min(max(change, -1.0), 1.0)
    return Person(
        f"random{number:03d}",
        f"{'woman' if woman else 'man'} number {number} of a random crowd",
        stature,
        {
            "gender": float(np.clip((1.0 if woman else 0.0) + rng.normal(0.0, 0.08), 0.0, 1.0)),
            "age": age,
            "muscle": float(rng.uniform(0.4, 0.8)),
            "weight": weight,
            "proportions": float(rng.uniform(0.42, 0.62)),
        },
        skin=_skin(rng),
        hair_colour=_HAIR[int(rng.integers(len(_HAIR)))],
        hair=hair,  # type: ignore[arg-type]
        top=str(rng.choice(_TOPS)),  # type: ignore[arg-type]
        top_colour=top_colour,
        top_trim=_colour(rng) if rng.random() < 0.4 else _darker(top_colour),
        trousers=_colour(rng, muted=True),
        shoes=_colour(rng, muted=True),
        headwear=(hat, _colour(rng)),  # type: ignore[arg-type]
        vest=vest,
        beard=0.0 if woman else float(max(0.0, rng.uniform(-0.5, 1.0))),
        glasses=bool(rng.random() < 0.25),
        denim=bool(rng.random() < 0.25),
        reflective_legs=bool(rng.random() < 0.2),
        gloves=_colour(rng) if rng.random() < 0.25 else None,
        changes=changes,
    )


def _styles(woman: bool) -> list[float]:
    return [0.10, 0.10, 0.30, 0.22, 0.26, 0.02] if woman else [0.48, 0.28, 0.04, 0.04, 0.04, 0.12]


def _skin(rng: np.random.Generator) -> Colour:
    tone = rng.random() ** 1.2
    rgb = (1.0 - tone) * _LIGHT_SKIN + tone * _DARK_SKIN
    return _rounded(rgb * (1.0 + rng.normal(0.0, 0.03, 3)))


def _colour(rng: np.random.Generator, *, muted: bool = False) -> Colour:
    """Return a colour of any hue, more often dull or dark than bright."""
    saturation = rng.beta(1.2, 3.0) if muted else rng.beta(1.2, 1.6)
    value = rng.uniform(0.12, 0.6) if muted else rng.uniform(0.12, 0.95)
    return _rounded(255.0 * np.array(colorsys.hsv_to_rgb(rng.random(), saturation, value)))


def _darker(colour: Colour) -> Colour:
    return _rounded(0.75 * np.array(colour, dtype=np.float64))


def _rounded(rgb: np.ndarray) -> Colour:
    red, green, blue = np.clip(np.rint(rgb), 0, 255).astype(int).tolist()
    return red, green, blue
