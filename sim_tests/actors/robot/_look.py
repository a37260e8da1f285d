"""What the robot looks like: its meshes by link, and the actor that draws them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world import Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError
from ...world.hall import (
    AMR_ATLAS,
    Colour,
    Mesh,
    Region,
    box,
    ellipsoid,
    merge,
    quad,
    scenery_texture,
    tube,
)
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._amr import CAMERA_HEIGHT_M, TRACK_M, WHEEL_RADIUS_M, Amr

#: A mesh in its link's frame with its colour and the name of its texture.
Piece = tuple[Mesh, Colour, "str | None"]

_WHITE: Final[Colour] = (1.0, 1.0, 1.0)
_HALF_LENGTH_M: Final = 0.3625
_HALF_WIDTH_M: Final = 0.25
# Low and high corner of all of the robot in its base frame, a little generous.
_BOUNDS_BASE_M: Final = np.array([[-0.38, -0.26, -0.01], [0.38, 0.26, 1.46]])
_MIDDLE_BASE_M: Final = _BOUNDS_BASE_M.mean(axis=0)
_HALF_BASE_M: Final = 0.5 * (_BOUNDS_BASE_M[1] - _BOUNDS_BASE_M[0])
_ABOUT_X: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # z to y

_at = AMR_ATLAS.region


@lru_cache(maxsize=1)
def amr_meshes() -> Mapping[str, tuple[Piece, ...]]:
    """Visual meshes of ``base_link``, ``left_wheel`` and ``right_wheel``, each in its link frame.

    The base frame is that of :class:`Amr`; a wheel's frame has its origin in the hub and its
    axis along y. Every part lies within the robot's footprint and in front of nothing that its
    own camera sees when it looks ahead: the camera's housing ends behind the optical centre.
    """
    base = merge([*_body(), *_deck(), *_post(), *_casters()])
    return {
        "base_link": ((base, _WHITE, "amr"),),
        "left_wheel": ((_wheel(1.0), _WHITE, "amr"),),
        "right_wheel": ((_wheel(-1.0), _WHITE, "amr"),),
    }


@lru_cache(maxsize=1)
def _base_triangles() -> TriangleSet:
    # Part by part: most lines of sight start above them all and come near none.
    meshes = [*_body(), *_deck(), *_post(), *_casters()]
    return TriangleSet([(mesh.vertices_m, mesh.indices.reshape(-1, 3)) for mesh in meshes])


def _outline(half_x: float, half_y: float, radius: float) -> FloatArray:
    """(M, 2) corners of a rectangle with rounded corners, counter-clockwise from its front."""
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
    """A wall around a rounded outline; its corners are shaded round."""
    rim = _outline(half_x, half_y, radius)
    count = len(rim)
    corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]).repeat(4, axis=0)
    normals = (rim - corners * np.array([half_x - radius, half_y - radius])) / radius
    region = _at(name)
    for k in range(count):
        n = (k + 1) % count
        (ax, ay), (bx, by) = rim[k], rim[n]
        face = quad([(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)], region)
        bent = np.array([(*normals[i], 0.0) for i in (k, n, n, k)])
        yield Mesh(face.vertices_m, bent, face.indices, face.uv)


def _lid(half_x: float, half_y: float, radius: float, z: float, name: str) -> Mesh:
    """A flat top over a rounded outline."""
    rim = _outline(half_x, half_y, radius)
    count = len(rim)
    vertices = np.column_stack([rim, np.full(count, z)])
    u_min, v_min, u_max, v_max = _at(name)
    share = rim / np.array([2.0 * half_x, 2.0 * half_y]) + 0.5
    uv = np.array([u_min, v_min]) + share * np.array([u_max - u_min, v_max - v_min])
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)]).ravel()
    return Mesh(vertices, np.tile((0.0, 0.0, 1.0), (count, 1)), fan, uv)


def _body(wheel_gap_m: float = 0.06) -> Iterator[Mesh]:
    """Bumper skirt, painted shell, light strip and cover, with the wheels' arches left dark."""
    x, y = _HALF_LENGTH_M, _HALF_WIDTH_M
    inner = y - wheel_gap_m
    # Between the wheels the chassis is narrow; ahead of and behind them it is as wide as the cover.
    yield box((0.0, 0.0, 0.27), (0.36, 2.0 * inner, 0.34), _dark_sides())
    for side in (1.0, -1.0):
        middle = side * (x - 0.095)
        yield box(
            (middle, 0.0, 0.11), (0.19, 2.0 * y, 0.08), dict.fromkeys(_AROUND, _at("dark"))
        )  # bumper
        yield box(
            (middle - side * 0.005, 0.0, 0.275), (0.18, 2.0 * y - 0.02, 0.25), _shell_sides(side)
        )
        yield box(
            (middle, 0.0, 0.165),
            (0.186, 2.0 * y - 0.006, 0.03),
            dict.fromkeys(_AROUND, _at("rubber")),
        )
    yield from _shell(x, y, 0.06, 0.40, 0.435, "dark")
    yield from _shell(x - 0.006, y - 0.006, 0.06, 0.435, 0.455, "glow")
    yield from _shell(x, y, 0.06, 0.455, 0.545, "shell")
    yield from _shell(x - 0.012, y - 0.012, 0.05, 0.545, 0.556, "trim")
    yield _lid(x - 0.012, y - 0.012, 0.05, 0.556, "deck")
    under = quad([(-x, -y, 0.4), (-x, y, 0.4), (x, y, 0.4), (x, -y, 0.4)], _at("dark"))
    yield under
    for side in (1.0, -1.0):  # name plate on the cover's sides
        face = [
            (-0.24, -0.001, 0.46),
            (0.24, -0.001, 0.46),
            (0.24, -0.001, 0.54),
            (-0.24, -0.001, 0.54),
        ]
        yield quad(
            [(-side * px, side * (y + 0.002), pz) for px, _, pz in face],
            AMR_ATLAS.region("flank", (0.02, 0.38, 0.9, 0.84)),
        )


_AROUND: Final = ("-x", "+x", "-y", "+y")


def _dark_sides() -> dict[str, Region]:
    return dict.fromkeys(_AROUND, _at("dark"))


def _shell_sides(side: float) -> dict[str, Region]:
    outward, inward = ("+x", "-x") if side > 0.0 else ("-x", "+x")
    return {
        outward: _at("front"),
        inward: _at("dark"),
        "-y": _at("shell"),
        "+y": _at("shell"),
    }


def _deck() -> Iterator[Mesh]:
    """Lidars front and rear, emergency stop, and the tote with its lid."""
    for px in (0.31, -0.33):
        radius = 0.045 if px > 0.0 else 0.026
        yield tube(
            [(px, 0.0, 0.62, radius, radius), (px, 0.0, 0.556, radius, radius)],
            12,
            _at("puck"),
            _at("dark"),
        )
    for py in (-0.19, 0.19):
        yield tube(
            [(0.24, py, 0.578, 0.022, 0.022), (0.24, py, 0.556, 0.03, 0.03)], 8, _at("yellow")
        )
        yield tube([(0.24, py, 0.6, 0.018, 0.018), (0.24, py, 0.578, 0.02, 0.02)], 8, _at("red"))
    sides = dict.fromkeys(_AROUND, _at("tote_side"))
    yield box((-0.12, 0.0, 0.706), (0.40, 0.42, 0.298), sides)
    yield box(
        (-0.12, 0.0, 0.866),
        (0.42, 0.44, 0.03),
        {**dict.fromkeys(_AROUND, _at("lid")), "+z": _at("lid"), "-z": _at("lid")},
    )
    yield box(
        (-0.12, 0.0, 0.885),
        (0.34, 0.36, 0.01),
        {**dict.fromkeys(_AROUND, _at("lid")), "+z": _at("tote")},
    )


def _post() -> Iterator[Mesh]:
    """A post with a stereo head, a handle and a beacon; all of it behind the optical centre."""
    yield tube(
        [(0.12, 0.0, 1.385, 0.019, 0.019), (0.12, 0.0, 0.556, 0.021, 0.021)], 10, _at("steel")
    )
    yield tube([(0.12, 0.0, 0.60, 0.032, 0.032), (0.12, 0.0, 0.556, 0.05, 0.05)], 10, _at("dark"))
    top = CAMERA_HEIGHT_M
    yield box(
        (0.118, 0.0, top),
        (0.06, 0.17, 0.05),
        {**dict.fromkeys(_AROUND, _at("dark")), "+z": _at("dark"), "-z": _at("dark")},
    )
    for py in (-0.055, 0.055):
        yield quad(
            [
                (0.1495, py - 0.02, top - 0.02),
                (0.1495, py + 0.02, top - 0.02),
                (0.1495, py + 0.02, top + 0.02),
                (0.1495, py - 0.02, top + 0.02),
            ],
            _at("lens"),
        )
    yield tube([(0.1, 0.0, 1.45, 0.016, 0.016), (0.1, 0.0, 1.425, 0.018, 0.018)], 8, _at("glow"))
    yield box((0.075, 0.0, 1.02), (0.05, 0.03, 0.03), _dark_sides())
    bar = tube([(0, 0, 0.1, 0.013, 0.013), (0, 0, -0.1, 0.013, 0.013)], 8, _at("rubber"))
    yield bar.transformed(_ABOUT_X, (0.05, 0.0, 1.02))


def _casters() -> Iterator[Mesh]:
    for py in (-0.15, 0.15):
        yield ellipsoid((-0.27, py, 0.04), (0.04, 0.025, 0.04), 10, 6, _at("rubber"))
        yield box((-0.27, py, 0.075), (0.05, 0.06, 0.03), _dark_sides())


def _wheel(side: float) -> Mesh:
    """A drive wheel, its hub on the outer side (``side`` +1: left)."""
    radius, half = WHEEL_RADIUS_M, 0.025
    tyre = tube(
        [
            (0, 0, half, radius - 0.01, radius - 0.01),
            (0, 0, half - 0.008, radius, radius),
            (0, 0, -half + 0.008, radius, radius),
            (0, 0, -half, radius - 0.01, radius - 0.01),
        ],
        20,
        _at("tyre"),
        _at("hub"),
    )
    return tyre.transformed(_ABOUT_X if side > 0.0 else _ABOUT_X.T)


Pose = tuple[Any, float, float]


class AmrLook:
    """Draws a robot in the picture world.

    Args:
        pose: gives where it is now: T_odom_base (4, 4) and the turn of the left and of the right
            wheel about base y, radians.
        base_pose: gives T_odom_base alone, where that is quicker.
    """

    kind: Final = "robot"

    def __init__(
        self, pose: Callable[[], Pose], base_pose: Callable[[], FloatArray] | None = None
    ) -> None:
        self._pose = pose
        self._base_pose = (lambda: np.asarray(pose()[0])) if base_pose is None else base_pose
        self._visuals: Visuals | None = None
        self._parts: list[tuple[int, FloatArray, int]] = []
        self._shown = True

    @classmethod
    def of(cls, warehouse: Warehouse, amr: Amr) -> AmrLook:
        """Follow a robot of the physics world."""
        wheels = [
            joint
            for joint in range(pybullet.getNumJoints(amr.body, physicsClientId=warehouse.client))
            if pybullet.getJointInfo(amr.body, joint, physicsClientId=warehouse.client)[12]
            in (b"left_wheel", b"right_wheel")
        ]

        def pose() -> Pose:
            left, right = pybullet.getJointStates(
                amr.body, wheels, physicsClientId=warehouse.client
            )
            return amr.T_odom_base, left[0], right[0]

        return cls(pose, lambda: amr.T_odom_base)

    def bounds_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box that holds the robot now."""
        T = self._base_pose()
        middle = T[:3, :3] @ _MIDDLE_BASE_M + T[:3, 3]
        half = np.abs(T[:3, :3]) @ _HALF_BASE_M
        return np.array([middle - half, middle + half])

    def reach_odom_m(self) -> FloatArray:
        """As :meth:`bounds_odom_m`."""
        return self.bounds_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """The robot without its wheels, which its body hides; there is one level of detail."""
        triangles = _base_triangles()
        places = np.broadcast_to(self._base_pose(), (triangles.pieces, 4, 4))
        return PlacedSurface(triangles, places)

    def build(self, visuals: Visuals) -> None:
        """Make its bodies in the picture world."""
        self._visuals = visuals
        half = 0.5 * TRACK_M
        hubs = {"left_wheel": (half, 1), "right_wheel": (-half, 2)}
        for link, pieces in amr_meshes().items():
            y, column = hubs.get(link, (0.0, 0))
            origin = np.array([0.0, y, WHEEL_RADIUS_M]) if column else np.zeros(3)
            for mesh, colour, texture in pieces:
                number = None if texture is None else visuals.texture(scenery_texture(texture))
                body = visuals.add_body(visuals.shape(mesh, colour, number))
                self._parts.append((body, origin, column))

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
        """Pose its bodies for the coming picture; None hides them. One level of detail does."""
        if self._visuals is None:
            raise SimError("the robot's look is shown before build() has made its bodies")
        shown = pixels_per_m is not None
        if shown != self._shown:
            change = self._visuals.reveal if shown else self._visuals.hide
            for body, _, _ in self._parts:
                change(body)
            self._shown = shown
        if not shown:
            return
        pose = self._pose()
        T = np.asarray(pose[0])
        base = Rotation.from_matrix(T[:3, :3])
        for body, origin, column in self._parts:
            turned = base
            if column:
                turned = base * Rotation.from_rotvec((0.0, pose[column], 0.0))
            pybullet.resetBasePositionAndOrientation(
                body,
                (T[:3, :3] @ origin + T[:3, 3]).tolist(),
                turned.as_quat().tolist(),
                physicsClientId=self._visuals.client,
            )

    def bodies(self) -> frozenset[int]:
        """Ids of its bodies in the picture world."""
        return frozenset(body for body, _, _ in self._parts)
