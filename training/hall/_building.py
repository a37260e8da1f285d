"""Textures of the building: floor slab, wall, ceiling, floor markings, doors and signs."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ._atlas import PaintedAtlas
from ._canvas import (
    Canvas,
    band,
    disc,
    fade,
    finished,
    grain,
    noise,
    plain,
    polygon,
    shade_edges,
    stripes,
    text,
)

# Extent that a texture covers: side of a square of floor or ceiling, width of a piece of wall.
_TILE_M: Final = 4.0
# The mean colour of the slab's textures: worn paint shows it, and shades end in it.
_SLAB_RGB: Final = (158.0, 157.0, 152.0)

FIXTURE_ATLAS: Final = PaintedAtlas(
    512,
    {
        "dock": (192, 192),
        "dock_open": (192, 192),
        "door": (72, 144),
        "exit": (48, 24),
        "extinguisher": (32, 96),
        "cabinet": (64, 96),
        "board": (128, 96),
        "warning": (48, 48),
        "duty": (48, 48),
        "number0": (48, 48),
        "number1": (48, 48),
        "number2": (48, 48),
        "number3": (48, 48),
        "hazard": (128, 24),
        "window": (128, 48),
        "heater": (64, 48),
        "clock": (48, 48),
        "pipe": (16, 64),
    },
)

MARKING_ATLAS: Final = PaintedAtlas(
    256,
    {
        "line": (256, 24),
        "zebra": (32, 128),
        "shade": (64, 64),
        "under": (64, 64),
        "arrow": (64, 64),
        "place": (96, 80),
    },
)


def floor_texture(number: int) -> NDArray[np.uint8]:
    """Return (512, 512, 3) of 4 m of slab between saw-cut joints, lighter under a lamp."""
    rng = np.random.default_rng((51, number))
    canvas = plain(512, 512, (158, 157, 152))
    grain(canvas, rng, 0.035, 3)
    grain(canvas, rng, 0.022, 11)
    grain(canvas, rng, 0.014, 60)
    grain(canvas, rng, 0.012)
    marks: NDArray[np.float32] = np.zeros((512, 512), np.float32)
    for _ in range(7):  # tyres that braked and turned
        turn = rng.uniform(-0.6, 0.6)
        start, heading = rng.uniform(0, 512, 2), rng.uniform(0, 2 * np.pi)
        steps = np.linspace(0.0, rng.uniform(120, 420), 24)
        angles = heading + turn * steps / 200.0
        path = start + np.cumsum(np.stack([np.cos(angles), np.sin(angles)], -1) * 16, axis=0)
        one = np.zeros_like(marks)
        cv2.polylines(
            one,
            [np.round(path * 16).astype(np.int32).reshape(-1, 1, 2)],
            False,
            float(rng.uniform(0.06, 0.15)),
            int(rng.integers(5, 13)),
            cv2.LINE_8,
            4,
        )
        marks = np.maximum(marks, one)
    for _ in range(5):  # stains
        centre = tuple(int(v) for v in rng.integers(20, 492, 2))
        axes = tuple(int(v) for v in rng.integers(6, 34, 2))
        one = np.zeros_like(marks)
        cv2.ellipse(one, centre, axes, float(rng.uniform(0, 180)), 0, 360, 0.14, -1)
        marks = np.maximum(marks, cv2.GaussianBlur(one, (0, 0), 3.0))
    marks *= 0.75 + 0.25 * noise(rng, 512, 512, 40, 40)
    canvas *= 1.0 - np.clip(cv2.GaussianBlur(marks, (0, 0), 1.2), 0.0, 0.4)[..., None]
    centre_m = (np.arange(512) + 0.5) / 512 * _TILE_M - 0.5 * _TILE_M
    pool = np.exp(-(centre_m[:, None] ** 2 + centre_m[None, :] ** 2) / (2.0 * 1.3**2))
    canvas *= (0.94 + 0.13 * pool)[..., None].astype(np.float32)
    for edge in (slice(0, 2), slice(510, 512)):
        canvas[edge] *= 0.72
        canvas[:, edge] *= 0.72
    return finished(canvas)


def wall_texture() -> NDArray[np.uint8]:
    """Return (512, 256, 3) of 4 m of wall: blocks below sheet panels, a pilaster on the left."""
    rng = np.random.default_rng(52)
    canvas = plain(256, 512, (206, 208, 206))
    phase = (np.arange(256) * 20 / 256) % 1.0  # sheet profile: 0.2 m pitch
    profile = np.interp(phase, [0, 0.1, 0.2, 0.55, 0.65, 0.75, 1.0], [1, 1, 1.05, 1.05, 0.88, 1, 1])
    canvas *= profile[None, :, None].astype(np.float32)
    for y in (0.28, 0.56):
        band(canvas, (0.0, y, 1.0, y + 0.006), (150, 154, 154))
    base = round(512 * 0.8)
    canvas[base:] = (150, 152, 152)
    for row in range(5):  # concrete blocks
        y = base + round(row * (512 - base) / 5)
        canvas[y : y + 2] = (124, 126, 126)
        for column in range(8):
            x = round((column + 0.5 * (row % 2)) * 32) % 256
            canvas[y : y + 20, x : x + 2] = (124, 126, 126)
    canvas[base - 4 : base] = (96, 108, 120)
    canvas[-10:] *= 0.7
    grain(canvas, rng, 0.02, 7)
    grain(canvas, rng, 0.01)
    streaks = np.maximum(noise(rng, 512, 256, 3, 40) - 0.8, 0.0)
    canvas *= (1.0 - 0.05 * streaks)[..., None]
    canvas[:, :22] = np.array((132, 138, 146))  # pilaster, lit from one side
    canvas[:, :3] *= 0.8
    canvas[:, 18:22] *= 1.12
    canvas[:, 22:28] *= 0.86
    canvas[-90:-4, :22] = (222, 178, 40)
    for k in range(4):
        canvas[-90 + 22 * k : -80 + 22 * k, :22] = (44, 44, 46)
    fade(canvas, 0.8, 1.02)
    return finished(canvas)


def ceiling_texture() -> NDArray[np.uint8]:
    """Return (256, 256, 3) of 4 m of trapezoidal sheet with purlins; lamps have their own mesh."""
    rng = np.random.default_rng(53)
    canvas = plain(256, 256, (150, 154, 156))
    canvas[::8] *= 0.86
    canvas[1::8] *= 0.93
    for k in range(3):
        band(canvas, (k / 3, 0.0, k / 3 + 0.03, 1.0), (118, 122, 126))
    grain(canvas, rng, 0.02, 5)
    x = (np.arange(256) + 0.5) / 64.0 - 2.0
    glow = np.exp(-(x[:, None] ** 2 / 0.5 + x[None, :] ** 2 / 2.5))
    canvas *= (0.86 + 0.26 * glow)[..., None].astype(np.float32)
    return finished(canvas)


def marking_texture() -> NDArray[np.uint8]:
    """Return the texture (256, 256, 3) of :data:`MARKING_ATLAS`: worn paint, and shades."""
    rng = np.random.default_rng(54)

    def paint(canvas: Canvas, name: str, _: int) -> None:
        if name == "line":
            canvas[:] = (222, 180, 48)
        elif name == "zebra":
            canvas[:] = (226, 226, 218)
        elif name == "arrow":
            polygon(canvas, [(0.1, 0.42), (0.55, 0.42), (0.55, 0.2), (0.95, 0.5)], (222, 180, 48))
            polygon(canvas, [(0.1, 0.42), (0.1, 0.58), (0.55, 0.58), (0.55, 0.42)], (222, 180, 48))
            polygon(canvas, [(0.55, 0.5), (0.55, 0.8), (0.95, 0.5)], (222, 180, 48))
        elif name == "place":  # a storage place: a white frame on the slab
            for box in ((0, 0, 1, 0.05), (0, 0.95, 1, 1), (0, 0, 0.045, 1), (0.955, 0, 1, 1)):
                band(canvas, box, (216, 216, 208))
        elif name == "shade":  # from the open floor (below) into the dark under a rack (above)
            fade(canvas, 0.5, 1.0)
        else:
            canvas *= 0.42
        grain(canvas, rng, 0.02)
        if name in ("line", "zebra", "arrow", "place"):
            _wear(canvas, rng)

    return MARKING_ATLAS.painted(_SLAB_RGB, paint)


def _wear(canvas: Canvas, rng: np.random.Generator) -> None:
    """Let the slab show through where wheels have worn the paint off."""
    height, width = canvas.shape[:2]
    field = noise(rng, height, width, max(2, height // 10), max(2, width // 10))
    fine = noise(rng, height, width, max(3, height // 3), max(3, width // 3))
    share = np.clip(0.9 * (field + 0.5 * fine - 0.95), 0.0, 0.85)[..., None]
    canvas += share * (np.array(_SLAB_RGB, np.float32) - canvas)


def fixture_texture() -> NDArray[np.uint8]:
    """Return the texture (512, 512, 3) of :data:`FIXTURE_ATLAS`: doors, signs and equipment."""

    def paint(canvas: Canvas, name: str, number: int) -> None:
        rng = np.random.default_rng((55, number))
        if name.startswith("dock"):
            _dock(canvas, rng, name == "dock_open")
        elif name.startswith("number"):
            canvas[:] = (40, 72, 128)
            text(canvas, str(int(name[6:]) + 1), (0.5, 0.5), 0.6, (236, 236, 232))
        elif name == "hazard":
            stripes(canvas, 5, (230, 184, 34), (36, 36, 38))
        else:
            _FIXTURE_PAINTERS[name](canvas, rng)
        grain(canvas, rng, 0.012)

    return FIXTURE_ATLAS.painted((200, 200, 200), paint)


def _dock(canvas: Canvas, rng: np.random.Generator, is_open: bool) -> None:
    """Paint a sectional dock door in its seal, or an open one with a dim trailer behind it."""
    canvas[:] = (44, 46, 48)
    inner = (0.08, 0.08, 0.92, 1.0)
    band(canvas, inner, (188, 192, 192))
    for k in range(5):
        y = 0.08 + 0.184 * k
        band(canvas, (0.08, y, 0.92, y + 0.012), (132, 136, 138))
        band(canvas, (0.08, y + 0.012, 0.92, y + 0.03), (206, 210, 210))
    for x in (0.26, 0.62):
        band(canvas, (x, 0.48, x + 0.12, 0.56), (52, 64, 76))
        band(canvas, (x + 0.01, 0.49, x + 0.07, 0.53), (120, 138, 150))
    if is_open:
        band(canvas, (0.08, 0.24, 0.92, 1.0), (62, 60, 58))
        band(canvas, (0.2, 0.36, 0.8, 0.88), (98, 92, 86))
        polygon(canvas, [(0.08, 1.0), (0.2, 0.88), (0.8, 0.88), (0.92, 1.0)], (112, 92, 70))
        band(canvas, (0.2, 0.58, 0.48, 0.88), (150, 120, 84))
        band(canvas, (0.5, 0.64, 0.76, 0.88), (134, 106, 74))
        band(canvas, (0.2, 0.725, 0.76, 0.735), (90, 68, 46))
    # The guards at the foot of the frame are plain: a person detector takes narrow stripes one
    # above the other for a hi-vis vest.
    for x in (0.0, 0.92):
        band(canvas, (x, 0.84, x + 0.08, 1.0), (224, 178, 38))
    fade(canvas, 0.94, 1.0)


def _door(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (92, 98, 104)
    band(canvas, (0.06, 0.03, 0.94, 1.0), (116, 132, 146))
    band(canvas, (0.3, 0.14, 0.7, 0.42), (58, 72, 84))
    band(canvas, (0.32, 0.15, 0.5, 0.3), (104, 122, 134))
    band(canvas, (0.14, 0.5, 0.86, 0.535), (196, 198, 196))
    band(canvas, (0.1, 0.9, 0.9, 0.98), (150, 154, 156))


def _exit(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (28, 128, 72)
    text(canvas, "EXIT", (0.4, 0.5), 0.5, (238, 242, 238))
    polygon(canvas, [(0.76, 0.25), (0.94, 0.5), (0.76, 0.75)], (238, 242, 238))


def _extinguisher(canvas: Canvas, _: np.random.Generator) -> None:
    """Paint a red box with a window for an extinguisher, and its sign above."""
    canvas[:] = (186, 190, 190)
    band(canvas, (0.1, 0.02, 0.9, 0.27), (182, 36, 32))
    band(canvas, (0.4, 0.08, 0.6, 0.2), (236, 232, 228))
    band(canvas, (0.0, 0.4, 1.0, 1.0), (168, 34, 30))
    band(canvas, (0.14, 0.46, 0.86, 0.88), (92, 30, 30))
    band(canvas, (0.3, 0.5, 0.44, 0.88), (150, 150, 150))


def _cabinet(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (172, 176, 174)
    band(canvas, (0.48, 0.0, 0.52, 1.0), (128, 132, 132))
    polygon(canvas, [(0.25, 0.2), (0.14, 0.34), (0.36, 0.34)], (236, 192, 32))
    for y in (0.7, 0.76, 0.82):
        band(canvas, (0.1, y, 0.4, y + 0.02), (110, 114, 114))
    shade_edges(canvas, 0.05, 0.4)


def _board(canvas: Canvas, rng: np.random.Generator) -> None:
    """Paint a notice board: sheets with lines and charts, no photographs."""
    canvas[:] = (54, 92, 138)
    for row in range(2):
        for column in range(4):
            x, y = 0.04 + 0.24 * column, 0.08 + 0.46 * row
            band(canvas, (x, y, x + 0.19, y + 0.38), (232, 232, 226))
            for k in range(5):
                length = rng.uniform(0.06, 0.15)
                band(
                    canvas,
                    (x + 0.02, y + 0.06 + 0.06 * k, x + 0.02 + length, y + 0.08 + 0.06 * k),
                    (120, 124, 130) if rng.random() < 0.7 else (186, 74, 50),
                )
    shade_edges(canvas, 0.03, 0.5)


def _warning(canvas: Canvas, _: np.random.Generator) -> None:
    polygon(canvas, [(0.5, 0.04), (0.02, 0.94), (0.98, 0.94)], (34, 34, 34))
    polygon(canvas, [(0.5, 0.16), (0.12, 0.87), (0.88, 0.87)], (238, 196, 36))
    band(canvas, (0.46, 0.4, 0.54, 0.66), (34, 34, 34))
    band(canvas, (0.46, 0.72, 0.54, 0.8), (34, 34, 34))


def _duty(canvas: Canvas, _: np.random.Generator) -> None:
    """Paint a blue mandatory sign with an arrow: keep this way."""
    disc(canvas, 0.48, (34, 82, 158))
    polygon(canvas, [(0.5, 0.85), (0.24, 0.55), (0.76, 0.55)], (240, 240, 238))
    band(canvas, (0.42, 0.16, 0.58, 0.58), (240, 240, 238))


def _window(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (222, 230, 236)
    fade(canvas, 1.05, 0.94)
    for x in (0.0, 0.24, 0.49, 0.74, 0.98):
        band(canvas, (x, 0.0, x + 0.025, 1.0), (96, 102, 106))
    for y in (0.0, 0.94):
        band(canvas, (0.0, y, 1.0, y + 0.06), (96, 102, 106))


def _heater(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (190, 190, 186)
    canvas[::4] *= 0.6
    shade_edges(canvas, 0.06, 0.5)


def _clock(canvas: Canvas, _: np.random.Generator) -> None:
    disc(canvas, 0.48, (40, 42, 44))
    disc(canvas, 0.42, (238, 238, 234))
    polygon(canvas, [(0.48, 0.5), (0.52, 0.5), (0.52, 0.16), (0.48, 0.16)], (30, 30, 30))
    polygon(canvas, [(0.5, 0.48), (0.5, 0.53), (0.74, 0.58), (0.74, 0.55)], (30, 30, 30))


def _pipe(canvas: Canvas, _: np.random.Generator) -> None:
    canvas[:] = (168, 170, 170)
    canvas[:, :4] *= 0.7
    canvas[:, 6:9] *= 1.2
    canvas[:, 12:] *= 0.6


_FIXTURE_PAINTERS: Final = {
    "door": _door,
    "exit": _exit,
    "extinguisher": _extinguisher,
    "cabinet": _cabinet,
    "board": _board,
    "warning": _warning,
    "duty": _duty,
    "window": _window,
    "heater": _heater,
    "clock": _clock,
    "pipe": _pipe,
}
