"""Painters of the goods atlas: each fills a canvas with one kind of surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from ._canvas import (
    Canvas,
    band,
    fade,
    grain,
    noise,
    plain,
    polygon,
    round_shade,
    shade_edges,
    stripes,
    text,
)

_KRAFT_RGB: Final = np.array(
    [
        (184, 146, 102),
        (168, 128, 84),
        (196, 164, 122),
        (152, 116, 78),
        (176, 150, 116),
        (206, 196, 180),
        (160, 134, 108),
        (188, 152, 98),
    ],
    dtype=np.float64,
)
_PRINT_RGB: Final = np.array(
    [(40, 60, 120), (150, 40, 36), (40, 96, 60), (46, 44, 44), (196, 110, 30), (30, 104, 128)],
    dtype=np.float64,
)
_CRATE_RGB: Final = ((46, 84, 150), (112, 116, 120), (158, 48, 40), (52, 116, 74), (206, 166, 44))


def _carton(canvas: Canvas, rng: np.random.Generator, _: int = 0) -> None:
    base = _KRAFT_RGB[rng.integers(len(_KRAFT_RGB))] * rng.uniform(0.88, 1.06)
    canvas[:] = base
    grain(canvas, rng, 0.035, 5)
    tape = base * 0.5 + np.array((196, 174, 140)) * 0.5 if rng.random() < 0.7 else base * 0.82
    middle = 0.5
    band(canvas, (middle - 0.05, 0.0, middle + 0.05, rng.uniform(0.14, 0.3)), tape, 0.8)
    band(canvas, (middle - 0.05, 0.86, middle + 0.05, 1.0), tape, 0.8)
    rgb = _PRINT_RGB[rng.integers(len(_PRINT_RGB))]
    kind = rng.integers(5)
    if kind == 0:  # two arrows: this side up
        for x in (0.68, 0.84):
            polygon(canvas, [(x - 0.06, 0.5), (x, 0.38), (x + 0.06, 0.5)], rgb)
            band(canvas, (x - 0.02, 0.5, x + 0.02, 0.66), rgb)
    elif kind == 1:  # a maker's band
        band(canvas, (0.0, 0.42, 1.0, 0.62), rgb, 0.75)
        band(canvas, (0.2, 0.48, 0.8, 0.56), (235, 230, 215), 0.8)
    elif kind == 2:  # a maker's block with lines of print
        band(canvas, (0.08, 0.34, 0.4, 0.56), rgb, 0.85)
        for row in range(3):
            band(canvas, (0.08, 0.64 + 0.08 * row, 0.5 - 0.08 * row, 0.67 + 0.08 * row), rgb, 0.6)
    if rng.random() < 0.6:  # address label with a bar code
        x, y = rng.uniform(0.55, 0.68), rng.uniform(0.68, 0.74)
        if kind in (0, 1):
            x = rng.uniform(0.08, 0.2)
        band(canvas, (x, y, x + 0.26, y + 0.18), (236, 234, 226))
        for k in range(5):
            band(canvas, (x + 0.03 + 0.042 * k, y + 0.03, x + 0.05 + 0.042 * k, y + 0.1), (40,) * 3)
    shade_edges(canvas, 0.05, 0.28)


def _stack(canvas: Canvas, rng: np.random.Generator, _: int = 0) -> None:
    rows, columns = ((2, 2), (3, 3), (3, 2), (2, 3), (4, 3))[rng.integers(5)]
    high, wide = canvas.shape[0] / rows, canvas.shape[1] / columns
    seed = int(rng.integers(1 << 30))
    canvas[:] = (70, 54, 38)
    for row in range(rows):
        for column in range(columns):
            x0, x1 = round(column * wide), round((column + 1) * wide) - 1
            y0, y1 = round(row * high), round((row + 1) * high) - 1
            carton = plain(x1 - x0, y1 - y0, (0, 0, 0))
            # All cartons of a stack are of one kind; each has its own tone.
            _carton(carton, np.random.default_rng(seed))
            carton *= rng.uniform(0.9, 1.05)
            canvas[y0:y1, x0:x1] = carton[:, : canvas.shape[1] - x0]
    if rng.random() < 0.35:  # strapping
        for x in (0.3, 0.7):
            band(canvas, (x - 0.008, 0.0, x + 0.008, 1.0), (230, 230, 224), 0.7)


def _wrap(canvas: Canvas, rng: np.random.Generator, _: int = 0) -> None:
    _stack(canvas, rng)
    film = np.array((206, 212, 216)) if rng.random() < 0.7 else np.array((92, 96, 102))
    canvas += np.float32(0.5) * (film.astype(np.float32) - canvas)
    creases = noise(rng, canvas.shape[0], canvas.shape[1], 14, 5)
    canvas += (18.0 * np.maximum(creases - 0.7, 0.0))[..., None]
    for _ in range(5):
        y = rng.uniform(0.0, 0.9)
        slant = rng.uniform(-0.12, 0.12)
        polygon(
            canvas,
            [(0.0, y), (1.0, y + slant), (1.0, y + slant + 0.012), (0.0, y + 0.012)],
            film * 1.08,
        )
    shade_edges(canvas, 0.06, 0.15)


def _crates(canvas: Canvas, rng: np.random.Generator, index: int) -> None:
    rgb = np.array(_CRATE_RGB[index % len(_CRATE_RGB)]) * rng.uniform(0.9, 1.08)
    rows, columns = ((4, 2), (3, 2), (5, 2))[rng.integers(3)]
    canvas[:] = rgb * 0.3
    for row in range(rows):
        tone = rgb * rng.uniform(0.92, 1.06)
        for column in range(columns):
            x, y, w, h = column / columns, row / rows, 1.0 / columns, 1.0 / rows
            band(canvas, (x + 0.01, y + 0.012, x + w - 0.01, y + h), tone)
            band(canvas, (x + 0.005, y + 0.012, x + w - 0.005, y + 0.2 * h), tone * 1.15)
            for rib in range(4):
                at = x + w * (0.12 + 0.22 * rib)
                band(canvas, (at, y + 0.26 * h, at + 0.012, y + 0.94 * h), tone * 0.8)
            band(canvas, (x + 0.36 * w, y + 0.3 * h, x + 0.64 * w, y + 0.48 * h), tone * 0.35)
    grain(canvas, rng, 0.02)


def _sacks(canvas: Canvas, rng: np.random.Generator, index: int) -> None:
    paper = np.array(((206, 196, 176), (176, 186, 196))[index % 2]) * rng.uniform(0.92, 1.03)
    print_rgb = _PRINT_RGB[rng.integers(len(_PRINT_RGB))]
    rows = 6
    canvas[:] = paper * 0.45
    for row in range(rows):
        cut = 0.5 + 0.14 * (-1) ** row
        for x0, x1 in ((0.0, cut - 0.01), (cut + 0.01, 1.0)):
            y0, y1 = row / rows, (row + 1) / rows
            tone = paper * rng.uniform(0.93, 1.05)
            polygon(
                canvas,
                [
                    (x0 + 0.03, y0 + 0.01),
                    (x1 - 0.03, y0 + 0.01),
                    (x1, 0.5 * (y0 + y1)),
                    (x1 - 0.03, y1),
                    (x0 + 0.03, y1),
                    (x0, 0.5 * (y0 + y1)),
                ],
                tone,
            )
            band(canvas, (x0 + 0.1, y0 + 0.05, x0 + 0.3, y1 - 0.04), print_rgb, 0.7)
    grain(canvas, rng, 0.04, 12)


def _drums(canvas: Canvas, rng: np.random.Generator, index: int) -> None:
    rgb = np.array(((40, 84, 146), (60, 116, 96))[index % 2]) * rng.uniform(0.9, 1.1)
    canvas[:] = rgb
    for y in (0.02, 0.32, 0.64, 0.96):
        band(canvas, (0.0, y - 0.02, 1.0, y + 0.01), rgb * 1.25)
        band(canvas, (0.0, y + 0.01, 1.0, y + 0.03), rgb * 0.7)
    for k in range(3):
        band(canvas, (k / 3 + 0.1, 0.42, k / 3 + 0.23, 0.56), (232, 224, 206), 0.9)  # label on each
    round_shade(canvas, 3, 0.6)
    grain(canvas, rng, 0.02)


def _cage(canvas: Canvas, rng: np.random.Generator, index: int) -> None:
    """Paint a wire cage with parcels behind the wire."""
    _stack(canvas, rng) if index == 0 else _crates(canvas, rng, int(rng.integers(5)))
    canvas *= 0.72
    for k in range(9):
        band(canvas, (k / 8 - 0.008, 0.0, k / 8 + 0.008, 1.0), (168, 172, 176))
    for k in range(7):
        band(canvas, (0.0, k / 6 - 0.008, 1.0, k / 6 + 0.008), (160, 164, 168))
    for x in (0.0, 0.97):
        band(canvas, (x, 0.0, x + 0.03, 1.0), (188, 192, 196))


def _parts(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint a shelf with small bins in rows."""
    canvas[:] = (60, 62, 66)
    for row in range(5):
        for column in range(5):
            rgb = np.array(_CRATE_RGB[rng.integers(len(_CRATE_RGB))]) * rng.uniform(0.85, 1.1)
            x, y = column / 5 + 0.012, row / 5 + 0.055
            band(canvas, (x, y, x + 0.176, y + 0.115), rgb)
            band(canvas, (x, y, x + 0.176, y + 0.045), rgb * 0.35)
            band(canvas, (x + 0.05, y + 0.065, x + 0.13, y + 0.095), (228, 226, 216))
        band(canvas, (0.0, row / 5 + 0.172, 1.0, row / 5 + 0.2), (146, 150, 154))


def _backing(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint the wire mesh and the dim goods deep inside a rack."""
    canvas[:] = (66, 66, 66)
    grain(canvas, rng, 0.16, 6)
    for k in range(16):
        band(canvas, (k / 16, 0.0, k / 16 + 0.01, 1.0), (96, 98, 100), 0.7)
        band(canvas, (0.0, k / 16, 1.0, k / 16 + 0.01), (96, 98, 100), 0.7)
    fade(canvas, 0.75, 1.0)


def _end(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint the perforated sheet that closes a rack's end, with a guard at the bottom."""
    canvas[:] = (122, 130, 138)
    grain(canvas, rng, 0.02)
    canvas[6:-40:8, 5::8] *= 0.55
    for y in (0.0, 0.33, 0.66):
        band(canvas, (0.0, y, 1.0, y + 0.014), (94, 100, 108))
    for x in (0.0, 0.9):
        band(canvas, (x, 0.0, x + 0.1, 1.0), (38, 72, 132))
    guard = plain(64, 26, (0, 0, 0))
    stripes(guard, 4, (228, 182, 36), (40, 40, 42))
    canvas[-26:] = guard
    fade(canvas, 1.0, 0.92)


def _upright(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = np.array((40, 76, 138)) * rng.uniform(0.92, 1.05)
    canvas[4::8, 4:6] *= 0.35
    canvas[4::8, 10:12] *= 0.35
    canvas[:, :2] *= 1.2
    canvas[:, -2:] *= 0.75
    canvas[-34:-6] = (228, 182, 36)  # guard at the foot
    fade(canvas, 1.0, 0.9)


def _ladder(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint zigzag bracing on a dark background."""
    canvas[:] = (58, 60, 62)
    grain(canvas, rng, 0.1, 6)
    for k in range(4):
        y = k / 4
        for x0, x1, shift in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.125)):
            polygon(
                canvas,
                [
                    (x0, y + shift),
                    (x1, y + shift + 0.125),
                    (x1, y + shift + 0.14),
                    (x0, y + shift + 0.015),
                ],
                (46, 84, 146),
            )


def _window(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = (36, 42, 48)
    polygon(canvas, [(0.1, 1.0), (0.45, 0.0), (0.65, 0.0), (0.3, 1.0)], (62, 70, 78))
    for box in ((0, 0, 1, 0.08), (0, 0.92, 1, 1), (0, 0, 0.05, 1), (0.95, 0, 1, 1)):
        band(canvas, box, (28, 28, 30))


def _deck(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint a wire deck or chipboard, seen from below."""
    canvas[:] = (108, 106, 102)
    grain(canvas, rng, 0.04, 6)
    for k in range(8):
        band(canvas, (0.0, k / 8, 1.0, k / 8 + 0.02), (84, 84, 84))
    for k in range(4):
        band(canvas, (k / 4, 0.0, k / 4 + 0.05, 1.0), (92, 92, 92))


def _top(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = _KRAFT_RGB[rng.integers(len(_KRAFT_RGB))]
    grain(canvas, rng, 0.04, 4)
    for k in (0.0, 0.5):
        band(canvas, (0.0, k + 0.21, 1.0, k + 0.29), (200, 178, 142), 0.7)
        band(canvas, (0.0, k - 0.01, 1.0, k + 0.01), (84, 66, 48))
        band(canvas, (k - 0.01, 0.0, k + 0.01, 1.0), (84, 66, 48))


def _wrap_top(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = (188, 190, 188)
    grain(canvas, rng, 0.06, 6)


def _crates_top(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = (96, 98, 102)
    for x0, y0 in ((0.02, 0.02), (0.52, 0.02), (0.02, 0.52), (0.52, 0.52)):
        band(canvas, (x0, y0, x0 + 0.46, y0 + 0.46), (120, 122, 126))
        band(canvas, (x0 + 0.05, y0 + 0.05, x0 + 0.41, y0 + 0.41), (52, 54, 58))


def _pallet_top(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    planks = 6
    canvas[:] = (60, 46, 32)
    for k in range(planks):
        tone = np.array((178, 142, 98)) * rng.uniform(0.84, 1.08)
        band(canvas, (0.0, (k + 0.04) / planks, 1.0, (k + 0.86) / planks), tone)
    canvas *= 1.0 + 0.05 * noise(rng, canvas.shape[0], canvas.shape[1], 24, 4)[..., None]


def _pallet_side(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint boards above and below three blocks, dark between them: 1.2 m × 0.144 m."""
    wood = np.array((172, 138, 94)) * rng.uniform(0.92, 1.05)
    canvas[:] = (34, 28, 22)
    band(canvas, (0.0, 0.0, 1.0, 0.26), wood)
    band(canvas, (0.0, 0.26, 1.0, 0.34), wood * 0.5)
    band(canvas, (0.0, 0.84, 1.0, 1.0), wood * 0.9)
    for x0, x1 in ((0.0, 0.12), (0.44, 0.56), (0.88, 1.0)):
        band(canvas, (x0, 0.3, x1, 0.86), wood * 0.82)
    grain(canvas, rng, 0.05)


def _mast(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    """Paint a lift mast: profiles, chains and a dark guard between them."""
    canvas[:] = (74, 78, 82)
    for x in (0.0, 0.14, 0.78, 0.92):
        band(canvas, (x, 0.0, x + 0.08, 1.0), (46, 48, 50))
    for x in (0.4, 0.56):
        band(canvas, (x, 0.0, x + 0.04, 1.0), (120, 118, 112))
    for y in (0.0, 0.48):
        band(canvas, (0.0, y, 1.0, y + 0.05), (52, 54, 56))


def _sign(canvas: Canvas, rng: np.random.Generator, index: int) -> None:
    plate, letters = (((236, 196, 40), (30, 30, 30)), ((232, 234, 232), (26, 60, 130)))[index % 2]
    canvas[:] = plate
    text(canvas, f"{'ABCDEF'[index % 6]}{index + 1:02d}", (0.5, 0.5), 0.5, letters)
    shade_edges(canvas, 0.04, 0.4)


def _hazard(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    stripes(canvas, 4, (230, 184, 34), (36, 36, 38))
    grain(canvas, rng, 0.03)


def _beam(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = np.array((220, 104, 30)) * rng.uniform(0.92, 1.04)
    band(canvas, (0.0, 0.0, 1.0, 0.2), (236, 132, 58))
    band(canvas, (0.0, 0.8, 1.0, 1.0), (160, 70, 18))


def _label(canvas: Canvas, _rng: np.random.Generator, _index: int) -> None:
    """Paint the label of a storage place: a bar code and a number."""
    canvas[:] = (236, 236, 230)
    for k in range(6):
        band(canvas, (0.06 + 0.07 * k, 0.2, 0.09 + 0.07 * k, 0.8), (44, 44, 46))
    band(canvas, (0.56, 0.3, 0.94, 0.7), (70, 72, 76))


def _grille(canvas: Canvas, rng: np.random.Generator, _: int) -> None:
    canvas[:] = (64, 66, 70)
    canvas[::4] *= 0.4


#: Painters by the name of a cell without its number; called with canvas, generator and number.
GOODS_PAINTERS: Final[dict[str, Callable[[Canvas, np.random.Generator, int], None]]] = {
    "carton": _carton,
    "stack": _stack,
    "wrap": _wrap,
    "crates": _crates,
    "sacks": _sacks,
    "drums": _drums,
    "cage": _cage,
    "parts": _parts,
    "backing": _backing,
    "end": _end,
    "upright": _upright,
    "ladder": _ladder,
    "window": _window,
    "deck": _deck,
    "top": _top,
    "wrap_top": _wrap_top,
    "crates_top": _crates_top,
    "pallet_top": _pallet_top,
    "pallet_side": _pallet_side,
    "mast": _mast,
    "sign": _sign,
    "hazard": _hazard,
    "beam": _beam,
    "grille": _grille,
    "label": _label,
}
