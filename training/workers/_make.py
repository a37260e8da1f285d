"""All steps that make one worker."""

from __future__ import annotations

import zlib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from ._atlas import Fine, bake, shade_of, with_lip
from ._body import Body, BodyModel
from ._capsules import capsules
from ._hats import hat_line, hats
from ._head import Head
from ._outfit import Outfit
from ._pack import pack
from ._paint import Painter
from ._person import Person
from ._piece import Array, Piece
from ._places import Places
from ._shoes import SOLE_M, shoes

#: Side of the texture at each level of detail.
TEXTURE_PX: Final = (1024, 512, 256)
#: Angle of the arms from the body; larger for heavier people.
_ABDUCTION_RAD: Final = np.radians(9.0)


@lru_cache(maxsize=1)
def model() -> BodyModel:
    """Return the body model, loaded once."""
    return BodyModel()


def make(person: Person, folder: Path) -> int:
    """Make a worker and write its files; return their size in bytes."""
    cv2.setNumThreads(1)
    body = _body(person)
    places = Places(model().average())
    pieces = _dress(body, person, places)
    folded = [with_lip(piece) for piece in pieces]
    whole, still = (shade_of(folded, forearms=arms) for arms in (True, False))
    fine = [Fine(piece, whole if piece.label in ("skin", "glove") else still) for piece in folded]
    paint = Painter(person, np.random.default_rng(zlib.crc32(person.name.encode())))
    levels = [
        bake(folded if level < len(TEXTURE_PX) - 1 else pieces, fine, level, size, paint)
        for level, size in enumerate(TEXTURE_PX)
    ]
    return pack(folder, person, body, levels, capsules(body, pieces))


def _body(person: Person) -> Body:
    """Return the naked body, standing on the soles of its shoes."""
    shape = model().height_for(person.stature_m - SOLE_M, person.phenotype, person.changes)
    heavy = max(0.0, person.phenotype["weight"] - 0.5)
    body = model().rest(shape, person.changes, abduction_rad=_ABDUCTION_RAD + 0.16 * heavy)
    up = np.array([0.0, 0.0, SOLE_M])
    return replace(
        body,
        vertices_m=body.vertices_m + up,
        joints_m=body.joints_m + up,
        keypoints_m=body.keypoints_m + up,
        bones_m={name: head + up for name, head in body.bones_m.items()},
    )


def _dress(body: Body, person: Person, places: Places) -> list[Piece]:
    neighbours = model().neighbours()
    average = model().average()
    outfit = Outfit(body, average, person, places, neighbours)
    line: Array | None = hat_line(person, places)
    head = Head(body, person, places, neighbours, outfit.neckline, line)
    return [
        *head.pieces(),
        *hats(body, person, places, head.hair_m),
        *outfit.pieces(),
        *shoes(body, average),
    ]
