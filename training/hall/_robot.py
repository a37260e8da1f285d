"""The texture of the robot: painted shell, rubber, hubs, lenses, lights and a label."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ._atlas import PaintedAtlas
from ._canvas import Canvas, Rgb, band, disc, fade, grain, text

_MATERIALS: Final[dict[str, Rgb]] = {
    "shell": (222, 224, 226),
    "trim": (34, 126, 104),
    "dark": (44, 46, 50),
    "rubber": (30, 30, 32),
    "steel": (150, 154, 158),
    "glow": (150, 246, 232),
    "red": (200, 34, 28),
    "yellow": (236, 188, 30),
    "glass": (24, 26, 34),
    "tote": (46, 88, 158),
    "lid": (34, 66, 122),
}

AMR_ATLAS: Final = PaintedAtlas(
    256,
    {
        "flank": (128, 64),
        "front": (64, 64),
        "tyre": (64, 16),
        "tote_side": (96, 64),
        "hub": (64, 64),
        "lens": (32, 32),
        "deck": (64, 64),
        "puck": (64, 32),
        **dict.fromkeys(_MATERIALS, (16, 16)),
    },
)


def amr_texture() -> NDArray[np.uint8]:
    """Return the texture (256, 256, 3) of :data:`AMR_ATLAS`."""

    def paint(canvas: Canvas, name: str, number: int) -> None:
        canvas[:] = _MATERIALS.get(name, _MATERIALS["shell"])
        if name in _PAINTERS:
            _PAINTERS[name](canvas)
        grain(canvas, np.random.default_rng((56, number)), 0.008)

    return AMR_ATLAS.painted((128, 128, 128), paint)


def _flank(canvas: Canvas) -> None:
    fade(canvas, 1.0, 0.9)
    for x in (0.3, 0.72):  # seams of the covers
        band(canvas, (x, 0.0, x + 0.01, 1.0), (150, 152, 156))
    band(canvas, (0.0, 0.78, 1.0, 0.8), (150, 152, 156))
    text(canvas, "AMR 07", (0.52, 0.4), 0.26, (52, 60, 70))
    for k in range(6):  # vents
        band(canvas, (0.06 + 0.03 * k, 0.3, 0.072 + 0.03 * k, 0.62), (92, 96, 100))


def _front(canvas: Canvas) -> None:
    fade(canvas, 1.0, 0.9)
    band(canvas, (0.12, 0.28, 0.88, 0.62), (26, 28, 34))
    for x in (0.2, 0.66):
        band(canvas, (x, 0.38, x + 0.14, 0.52), (70, 84, 104))
    for x in (0.02, 0.9):
        band(canvas, (x, 0.3, x + 0.08, 0.6), (240, 246, 236))


def _tyre(canvas: Canvas) -> None:
    canvas[:] = (34, 34, 36)
    canvas[:, ::4] *= 0.6


def _hub(canvas: Canvas) -> None:
    canvas[:] = (34, 34, 36)
    disc(canvas, 0.36, (158, 162, 166), corners=32)
    disc(canvas, 0.31, (112, 116, 120), corners=32)
    for k in range(5):
        turn = 2.0 * np.pi * k / 5
        centre = (0.5 + 0.2 * np.cos(turn), 0.5 + 0.2 * np.sin(turn))
        disc(canvas, 0.075, (46, 48, 52), centre, corners=32)
    disc(canvas, 0.09, (196, 200, 204), corners=32)


def _lens(canvas: Canvas) -> None:
    canvas[:] = (44, 46, 50)
    for radius, rgb in ((0.42, (16, 18, 22)), (0.3, (34, 42, 66)), (0.12, (120, 140, 180))):
        disc(canvas, radius, rgb)


def _deck(canvas: Canvas) -> None:
    canvas[:] = (62, 64, 68)
    canvas[::6, ::6] *= 1.4
    for box in ((0, 0, 1, 0.06), (0, 0.94, 1, 1)):
        band(canvas, box, (226, 184, 40))


def _puck(canvas: Canvas) -> None:
    canvas[:] = (40, 42, 46)
    band(canvas, (0.0, 0.28, 1.0, 0.68), (18, 18, 26))
    band(canvas, (0.0, 0.32, 1.0, 0.38), (70, 60, 84))


def _tote_side(canvas: Canvas) -> None:
    canvas[:] = _MATERIALS["tote"]
    for k in range(9):
        band(canvas, (k / 8 - 0.01, 0.14, k / 8 + 0.01, 0.96), (36, 70, 128))
    band(canvas, (0.0, 0.0, 1.0, 0.12), (62, 106, 180))
    band(canvas, (0.38, 0.2, 0.62, 0.34), (20, 40, 76))
    band(canvas, (0.62, 0.58, 0.88, 0.82), (232, 232, 226))
    for k in range(5):
        band(canvas, (0.65 + 0.04 * k, 0.62, 0.67 + 0.04 * k, 0.74), (40, 40, 44))


_PAINTERS: Final = {
    "flank": _flank,
    "front": _front,
    "tyre": _tyre,
    "hub": _hub,
    "lens": _lens,
    "deck": _deck,
    "puck": _puck,
    "tote_side": _tote_side,
}
