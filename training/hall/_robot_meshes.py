"""Meshes of the robot by link."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from sim_tests.actors.robot import CAMERA_HEIGHT_M, WHEEL_RADIUS_M
from sim_tests.world.hall import Mesh, Region, box, merge, quad

from ._robot import AMR_ATLAS
from ._round_meshes import ellipsoid, tube

_HALF_LENGTH_M: Final = 0.3625
_HALF_WIDTH_M: Final = 0.25
# Rotation about x that takes z to y.
_Z_TO_Y: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_SIDE_FACES: Final = ("-x", "+x", "-y", "+y")

_region = AMR_ATLAS.region


def robot_meshes() -> dict[str, Mesh]:
    """Return the meshes of ``base_link``, ``left_wheel`` and ``right_wheel`` in their link frames.

    The base frame is that of :class:`Amr`. A wheel's frame has its origin in the hub and its axis
    along y. Every part lies within the robot's footprint and outside the view of its own camera
    looking ahead: the camera's housing ends behind the optical centre.
    """
    return {
        "base_link": merge(base_pieces()),
        "left_wheel": _wheel(1.0),
        "right_wheel": _wheel(-1.0),
    }


def base_pieces() -> list[Mesh]:
    """Return the pieces of ``base_link``: a line of sight skips each that it passes above."""
    return [*_body(), *_deck(), *_post(), *_casters()]


def _outline(half_x: float, half_y: float, radius: float) -> FloatArray:
    """Return (M, 2) the outline of a rounded rectangle, counter-clockwise from its front."""
    steps = np.linspace(0.0, 0.5 * np.pi, 4)
    points = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        for step in steps + 0.5 * np.pi * quarter:
            points.append(
                (
                    sx * (half_x - radius) + radius * np.cos(step),
                    sy * (half_y - radius) + radius * np.sin(step),
                )
            )
    return np.array(points)


def _shell(
    half_x: float, half_y: float, radius: float, low: float, high: float, name: str
) -> Iterator[Mesh]:
    """Make a wall around a rounded rectangle, with smooth shading of its corners."""
    rim = _outline(half_x, half_y, radius)
    count = len(rim)
    corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]).repeat(4, axis=0)
    normals = (rim - corners * np.array([half_x - radius, half_y - radius])) / radius
    region = _region(name)
    for k in range(count):
        n = (k + 1) % count
        (ax, ay), (bx, by) = rim[k], rim[n]
        face = quad([(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)], region)
        bent = np.array([(*normals[i], 0.0) for i in (k, n, n, k)])
        yield Mesh(face.vertices_m, bent, face.indices, face.uv)


def _lid(half_x: float, half_y: float, radius: float, z: float, name: str) -> Mesh:
    """Make a flat top over a rounded rectangle."""
    rim = _outline(half_x, half_y, radius)
    count = len(rim)
    vertices = np.column_stack([rim, np.full(count, z)])
    u_min, v_min, u_max, v_max = _region(name)
    share = rim / np.array([2.0 * half_x, 2.0 * half_y]) + 0.5
    uv = np.array([u_min, v_min]) + share * np.array([u_max - u_min, v_max - v_min])
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)]).ravel()
    return Mesh(vertices, np.tile((0.0, 0.0, 1.0), (count, 1)), fan, uv)


def _body(wheel_gap_m: float = 0.06) -> Iterator[Mesh]:
    """Make bumper, painted shell, light strip, cover and dark wheel arches."""
    x, y = _HALF_LENGTH_M, _HALF_WIDTH_M
    inner = y - wheel_gap_m
    # The chassis is narrow between the wheels, and as wide as the cover ahead and behind.
    yield _solid((0.0, 0.0, 0.27), (0.36, 2.0 * inner, 0.34), "dark")
    for side in (1.0, -1.0):
        middle = side * (x - 0.095)
        yield _solid((middle, 0.0, 0.11), (0.19, 2.0 * y, 0.08), "dark")  # bumper
        yield box(
            (middle - side * 0.005, 0.0, 0.275), (0.18, 2.0 * y - 0.02, 0.25), _shell_sides(side)
        )
        yield _solid((middle, 0.0, 0.165), (0.186, 2.0 * y - 0.006, 0.03), "rubber")
    yield from _shell(x, y, 0.06, 0.40, 0.435, "dark")
    yield from _shell(x - 0.006, y - 0.006, 0.06, 0.435, 0.455, "glow")
    yield from _shell(x, y, 0.06, 0.455, 0.545, "shell")
    yield from _shell(x - 0.012, y - 0.012, 0.05, 0.545, 0.556, "trim")
    yield _lid(x - 0.012, y - 0.012, 0.05, 0.556, "deck")
    yield quad([(-x, -y, 0.4), (-x, y, 0.4), (x, y, 0.4), (x, -y, 0.4)], _region("dark"))
    for side in (1.0, -1.0):  # name plate on the cover's sides
        face = [(-0.24, 0.46), (0.24, 0.46), (0.24, 0.54), (-0.24, 0.54)]
        yield quad(
            [(-side * px, side * (y + 0.002), pz) for px, pz in face],
            AMR_ATLAS.region("flank", (0.02, 0.38, 0.9, 0.84)),
        )


def _solid(
    center: tuple[float, float, float],
    size: tuple[float, float, float],
    sides: str,
    top: str = "",
    under: str = "",
) -> Mesh:
    """Return a box with one atlas cell on its sides; no top or underside unless they are named."""
    regions = dict.fromkeys(_SIDE_FACES, _region(sides))
    regions |= {face: _region(name) for face, name in (("+z", top), ("-z", under)) if name}
    return box(center, size, regions)


def _shell_sides(side: float) -> dict[str, Region]:
    outward, inward = ("+x", "-x") if side > 0.0 else ("-x", "+x")
    return {
        outward: _region("front"),
        inward: _region("dark"),
        "-y": _region("shell"),
        "+y": _region("shell"),
    }


def _deck() -> Iterator[Mesh]:
    """Make front and rear lidar, emergency stops, and the tote with its lid."""
    for px in (0.31, -0.33):
        radius = 0.045 if px > 0.0 else 0.026
        yield tube(
            [(px, 0.0, 0.62, radius, radius), (px, 0.0, 0.556, radius, radius)],
            12,
            _region("puck"),
            _region("dark"),
        )
    for py in (-0.19, 0.19):
        yield tube(
            [(0.24, py, 0.578, 0.022, 0.022), (0.24, py, 0.556, 0.03, 0.03)], 8, _region("yellow")
        )
        yield tube(
            [(0.24, py, 0.6, 0.018, 0.018), (0.24, py, 0.578, 0.02, 0.02)], 8, _region("red")
        )
    yield _solid((-0.12, 0.0, 0.706), (0.40, 0.42, 0.298), "tote_side")
    yield _solid((-0.12, 0.0, 0.866), (0.42, 0.44, 0.03), "lid", "lid", "lid")
    yield _solid((-0.12, 0.0, 0.885), (0.34, 0.36, 0.01), "lid", "tote")


def _post() -> Iterator[Mesh]:
    """Make the post with stereo camera, handle and beacon, all behind the optical centre."""
    yield tube(
        [(0.12, 0.0, 1.385, 0.019, 0.019), (0.12, 0.0, 0.556, 0.021, 0.021)], 10, _region("steel")
    )
    yield tube(
        [(0.12, 0.0, 0.60, 0.032, 0.032), (0.12, 0.0, 0.556, 0.05, 0.05)], 10, _region("dark")
    )
    top = CAMERA_HEIGHT_M
    yield _solid((0.118, 0.0, top), (0.06, 0.17, 0.05), "dark", "dark", "dark")
    for py in (-0.055, 0.055):
        yield quad(
            [
                (0.1495, py - 0.02, top - 0.02),
                (0.1495, py + 0.02, top - 0.02),
                (0.1495, py + 0.02, top + 0.02),
                (0.1495, py - 0.02, top + 0.02),
            ],
            _region("lens"),
        )
    yield tube(
        [(0.1, 0.0, 1.45, 0.016, 0.016), (0.1, 0.0, 1.425, 0.018, 0.018)], 8, _region("glow")
    )
    yield _solid((0.075, 0.0, 1.02), (0.05, 0.03, 0.03), "dark")
    bar = tube([(0, 0, 0.1, 0.013, 0.013), (0, 0, -0.1, 0.013, 0.013)], 8, _region("rubber"))
    yield bar.transformed(_Z_TO_Y, (0.05, 0.0, 1.02))


def _casters() -> Iterator[Mesh]:
    for py in (-0.15, 0.15):
        yield ellipsoid((-0.27, py, 0.04), (0.04, 0.025, 0.04), 10, 6, _region("rubber"))
        yield _solid((-0.27, py, 0.075), (0.05, 0.06, 0.03), "dark")


def _wheel(side: float) -> Mesh:
    """Make a drive wheel (``side`` +1: left) with its hub on the outer side."""
    radius, half = WHEEL_RADIUS_M, 0.025
    tyre = tube(
        [
            (0, 0, half, radius - 0.01, radius - 0.01),
            (0, 0, half - 0.008, radius, radius),
            (0, 0, -half + 0.008, radius, radius),
            (0, 0, -half, radius - 0.01, radius - 0.01),
        ],
        20,
        _region("tyre"),
        _region("hub"),
    )
    return tyre.transformed(_Z_TO_Y if side > 0.0 else _Z_TO_Y.T)
