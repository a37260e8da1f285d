"""The shipped workers: women and men of several builds, ages and skins, in work wear."""

from __future__ import annotations

from typing import Final

from ._person import Person


def build(amount: float, belly: float = 0.0) -> dict[str, float]:
    """Return shape changes for a girth, 1 heavy to −1 thin; the model's weight does little."""
    girths = {"waist": 0.9, "hips": 0.6, "bust": 0.5, "thigh": 0.5, "upperarm": 0.6, "neck": 0.5}
    out = {f"measure-{name}-circ-incr": amount * share for name, share in girths.items()}
    return out | {"stomach-pregnant-incr": belly, "head-fat-incr": 0.6 * amount}


_ATHLETIC: Final = {
    "measure-bust-circ-incr": 0.5,
    "measure-shoulder-dist-incr": 0.5,
    "measure-upperarm-circ-incr": 0.5,
    "measure-neck-circ-incr": 0.3,
    "torso-vshape-incr": 0.5,
}
_YELLOW: Final = (214, 236, 40)
_ORANGE: Final = (250, 104, 24)
_NAVY: Final = (36, 46, 78)
_CHARCOAL: Final = (58, 60, 64)
_KHAKI: Final = (128, 116, 90)

PEOPLE: Final = (
    Person(
        "amina", "woman, slim, black hair in a bun, yellow vest over a plum shirt", 1.62,
        {"gender": 1.0, "age": 0.64, "muscle": 0.45, "weight": 0.40, "proportions": 0.6},
        skin=(112, 74, 54), hair_colour=(24, 20, 20), hair="bun",
        top="shirt", top_colour=(110, 52, 84), top_trim=(88, 40, 68), trousers=_NAVY,
        vest=_YELLOW, shoes=(50, 46, 44),
        changes=build(-0.4) | {"mouth-lowerlip-volume-incr": 0.6, "nose-scale-horiz-incr": 0.4},
    ),
    Person(
        "bjorn", "man, tall and broad, white helmet, orange vest over a grey hoodie", 1.94,
        {"gender": 0.0, "age": 0.72, "muscle": 0.75, "weight": 0.56, "proportions": 0.5},
        skin=(226, 178, 152), hair_colour=(150, 112, 66), hair="short", beard=0.7,
        headwear=("helmet", (236, 236, 230)),
        top="hoodie", top_colour=(108, 112, 118), top_trim=(88, 92, 98), trousers=_CHARCOAL,
        vest=_ORANGE, reflective_legs=True, gloves=(66, 70, 74),
        changes=_ATHLETIC | {"measure-waist-circ-incr": 0.3, "chin-width-incr": 0.4},
    ),
    Person(
        "carmen", "woman, average build, ponytail, yellow cap, blue polo, work trousers", 1.66,
        {"gender": 1.0, "age": 0.68, "muscle": 0.5, "weight": 0.52, "proportions": 0.5},
        skin=(198, 144, 112), hair_colour=(52, 32, 22), hair="ponytail",
        headwear=("cap", (226, 178, 34)),
        top="polo", top_colour=(44, 96, 158), top_trim=(30, 66, 112), trousers=_KHAKI,
        shoes=(84, 62, 44),
    ),
    Person(
        "daniel", "man, average build, short dark hair, yellow vest over a checked shirt", 1.79,
        {"gender": 0.0, "age": 0.66, "muscle": 0.55, "weight": 0.48, "proportions": 0.5},
        skin=(214, 164, 134), hair_colour=(48, 34, 26), hair="short", beard=0.25,
        top="checked", top_colour=(164, 52, 46), top_trim=(44, 40, 48), trousers=(62, 84, 124),
        denim=True, vest=_YELLOW, shoes=(120, 84, 50),
    ),
    Person(
        "elif", "woman, sturdy, bobbed hair, glasses, green jacket", 1.58,
        {"gender": 1.0, "age": 0.80, "muscle": 0.45, "weight": 0.68, "proportions": 0.45},
        skin=(222, 172, 142), hair_colour=(92, 60, 40), hair="bob", glasses=True,
        top="jacket", top_colour=(48, 84, 66), top_trim=(36, 62, 50), trousers=_CHARCOAL,
        changes=build(0.8, 0.15) | {"nose-hump-incr": 0.4},
    ),
    Person(
        "femi", "man, lean and tall, shaved head, orange vest over a white T-shirt", 1.88,
        {"gender": 0.0, "age": 0.64, "muscle": 0.62, "weight": 0.38, "proportions": 0.6},
        skin=(84, 56, 42), hair_colour=(22, 18, 18), hair="crop", beard=0.35,
        top="tshirt", top_colour=(214, 214, 210), top_trim=(196, 196, 192), trousers=_NAVY,
        vest=_ORANGE, reflective_legs=True,
        changes=build(-0.5) | {"nose-scale-horiz-incr": 0.6, "mouth-lowerlip-volume-incr": 0.5},
    ),
    Person(
        "giulia", "woman, average build, long fair hair tied back, blue helmet, yellow vest", 1.72,
        {"gender": 1.0, "age": 0.66, "muscle": 0.55, "weight": 0.47, "proportions": 0.55},
        skin=(236, 190, 166), hair_colour=(186, 144, 84), hair="ponytail",
        headwear=("helmet", (40, 92, 176)),
        top="jacket", top_colour=(44, 48, 60), top_trim=(34, 36, 46), trousers=(48, 52, 62),
        vest=_YELLOW, gloves=(196, 108, 44),
    ),
    Person(
        "hiroshi", "man, slim, grey hair, glasses, light blue shirt", 1.67,
        {"gender": 0.05, "age": 0.88, "muscle": 0.42, "weight": 0.44, "proportions": 0.5},
        skin=(220, 176, 140), hair_colour=(128, 126, 124), hair="short", glasses=True,
        top="shirt", top_colour=(138, 168, 198), top_trim=(112, 140, 170), trousers=(70, 66, 64),
        shoes=(34, 34, 36),
        changes=build(-0.3) | {"l-eye-epicanthus-out": 0.7, "r-eye-epicanthus-out": 0.7},
    ),
    Person(
        "ivan", "man, heavy, bald under a dark cap, beard, blue overalls", 1.80,
        {"gender": 0.0, "age": 0.80, "muscle": 0.55, "weight": 0.80, "proportions": 0.45},
        skin=(216, 164, 140), hair_colour=(98, 72, 52), hair="bald", beard=1.0,
        headwear=("cap", (52, 54, 62)),
        top="overalls", top_colour=(124, 128, 130), top_trim=(40, 62, 108), trousers=(40, 62, 108),
        shoes=(60, 52, 46), changes=build(1.0, 0.45) | {"neck-double-incr": 0.4},
    ),
    Person(
        "jamila", "woman, short, cropped black hair, orange vest over a dark polo", 1.52,
        {"gender": 1.0, "age": 0.66, "muscle": 0.5, "weight": 0.50, "proportions": 0.5},
        skin=(146, 100, 72), hair_colour=(28, 22, 22), hair="crop",
        top="polo", top_colour=(44, 50, 56), top_trim=(34, 38, 44), trousers=(84, 88, 94),
        vest=_ORANGE, shoes=(70, 66, 62),
    ),
    Person(
        "kofi", "man, muscular, yellow helmet, dark T-shirt, cargo trousers", 1.84,
        {"gender": 0.0, "age": 0.70, "muscle": 0.85, "weight": 0.54, "proportions": 0.55},
        skin=(98, 66, 48), hair_colour=(24, 20, 20), hair="crop", beard=0.5,
        headwear=("helmet", (240, 190, 30)),
        top="tshirt", top_colour=(52, 74, 70), top_trim=(42, 62, 58), trousers=(112, 100, 76),
        gloves=(54, 56, 60), changes=_ATHLETIC,
    ),
    Person(
        "linnea", "woman, tall, red bob, blue checked shirt, jeans", 1.80,
        {"gender": 1.0, "age": 0.64, "muscle": 0.55, "weight": 0.44, "proportions": 0.6},
        skin=(240, 198, 176), hair_colour=(138, 62, 30), hair="bob",
        top="checked", top_colour=(60, 92, 130), top_trim=(214, 214, 208), trousers=(48, 62, 92),
        denim=True, shoes=(96, 70, 48),
    ),
    Person(
        "mateo", "man, stocky, bearded, red cap, yellow vest over a navy jacket", 1.72,
        {"gender": 0.0, "age": 0.74, "muscle": 0.6, "weight": 0.66, "proportions": 0.42},
        skin=(184, 128, 96), hair_colour=(34, 26, 24), hair="short", beard=0.5,
        headwear=("cap", (168, 40, 38)),
        top="jacket", top_colour=(40, 50, 80), top_trim=(30, 38, 62), trousers=_CHARCOAL,
        vest=_YELLOW, reflective_legs=True, shoes=(40, 40, 42), changes=build(0.6, 0.2),
    ),
)  # fmt: skip
