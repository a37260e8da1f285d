"""Description of one worker."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Person:
    """One worker.

    Attributes:
        name: name of the files.
        description: one line about the person.
        stature_m: height with shoes, without hat.
        phenotype: inputs of the body model, each in [0, 1]: gender (0 male, 1 female), age (0.66
            is a young adult, 1 old), muscle, weight, proportions.
        changes: further shape changes of the body model, in [−1, 1].
        skin: colour of the skin.
        hair_colour: of hair, brows and beard.
        hair: hair style.
        beard: 0 shaved to 1 full.
        headwear: kind and colour.
        glasses: True with glasses.
        top: kind of upper garment.
        top_colour: its main colour.
        top_trim: the second colour of checks, collar, hood or bib.
        vest: colour of a hi-vis vest over it, if any.
        trousers: colour of the trousers.
        denim: True for jeans.
        reflective_legs: True for reflective bands about the shins.
        shoes: colour of the shoes.
        gloves: colour of the gloves, if any.
    """

    name: str
    description: str
    stature_m: float
    phenotype: dict[str, float]
    skin: Colour
    hair_colour: Colour
    hair: Literal["short", "crop", "bob", "bun", "ponytail", "bald"]
    top: Literal["tshirt", "polo", "shirt", "checked", "hoodie", "jacket", "overalls"]
    top_colour: Colour
    top_trim: Colour
    trousers: Colour
    shoes: Colour = (45, 42, 40)
    headwear: tuple[Literal["none", "cap", "helmet"], Colour] = ("none", (0, 0, 0))
    vest: Colour | None = None
    beard: float = 0.0
    glasses: bool = False
    denim: bool = False
    reflective_legs: bool = False
    gloves: Colour | None = None
    changes: dict[str, float] = field(default_factory=dict)
