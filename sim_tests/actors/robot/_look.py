"""The visual actor of a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world.hall import Colour, Mesh, box, merge, read_meshes, scenery_texture
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._model import TRACK_M, WHEEL_RADIUS_M, RobotModel
from ._robots import Amr, KinematicRobot

# Meshes of the Nova Carter; training/hall of commit 3030439d made them.
_AMR_FILE: Final = resources.files(__package__) / "nova_carter.npz"
# Low and high corner of a box that holds the Nova Carter in its base frame.
_AMR_BOUNDS_M: Final = np.array([[-0.38, -0.26, -0.01], [0.38, 0.26, 1.46]])
# Colour of a robot without parts, and how far above the floor it begins.
_COLOUR: Final[Colour] = (0.2, 0.3, 0.45)
_LOW_M: Final = 0.05


class LookPart(NamedTuple):
    """A rigid part of a robot's surface.

    Attributes:
        mesh: surface about the origin of the part.
        colour: its colour; None takes the texture of the Nova Carter.
        origin_m: the part's origin in the base frame; a wheel turns about base y there.
    """

    mesh: Mesh
    colour: Colour | None = None
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


class RobotLook:
    """The visual actor of a robot.

    Args:
        parts: its parts; wheels come last.
        bounds_base_m: (2, 3) low and high corner of a box that holds the robot in its base frame.
        triangles: its surface in the base frame, in pieces.
        base_pose: returns the present T_odom_base (4, 4).
        wheel_angles: returns the present rotation of each wheel about base y, radians.

    Attributes:
        kind: ``"robot"``.
    """

    kind: Final = "robot"

    def __init__(
        self,
        parts: Sequence[LookPart],
        bounds_base_m: FloatArray,
        triangles: TriangleSet,
        base_pose: Callable[[], FloatArray],
        wheel_angles: Callable[[], tuple[float, ...]] = tuple,
    ) -> None:
        self._parts = parts
        self._middle_m = 0.5 * (bounds_base_m[0] + bounds_base_m[1])
        self._half_m = 0.5 * (bounds_base_m[1] - bounds_base_m[0])
        self._triangles = triangles
        self._base_pose, self._wheel_angles = base_pose, wheel_angles
        self._bodies: list[int] = []

    @classmethod
    def of(cls, robot: Amr | KinematicRobot) -> RobotLook:
        """Make the visual actor of a robot in the physics world."""

        def base_pose() -> FloatArray:
            return robot.T_odom_base

        if not isinstance(robot, KinematicRobot):
            return cls.nova_carter(base_pose, lambda: robot.wheel_angles_rad)
        parts = [LookPart(mesh, colour) for mesh, colour in model_meshes(robot.model)]
        corners = np.vstack([part.mesh.vertices_m for part in parts])
        surface = [(part.mesh.vertices_m, part.mesh.indices.reshape(-1, 3)) for part in parts]
        bounds = np.array([corners.min(axis=0), corners.max(axis=0)])
        return cls(parts, bounds, TriangleSet(surface), base_pose)

    @classmethod
    def nova_carter(
        cls,
        base_pose: Callable[[], FloatArray],
        wheel_angles: Callable[[], tuple[float, ...]] = lambda: (0.0, 0.0),
    ) -> RobotLook:
        """Make the visual actor of a Nova Carter: its body and two wheels; args as the class's."""
        meshes = amr_meshes()
        parts = [
            LookPart(meshes["base_link"]),
            LookPart(meshes["left_wheel"], origin_m=(0.0, 0.5 * TRACK_M, WHEEL_RADIUS_M)),
            LookPart(meshes["right_wheel"], origin_m=(0.0, -0.5 * TRACK_M, WHEEL_RADIUS_M)),
        ]
        return cls(parts, _AMR_BOUNDS_M, _amr_triangles(), base_pose, wheel_angles)

    def bounds_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the robot now."""
        T = self._base_pose()
        middle = T[:3, :3] @ self._middle_m + T[:3, 3]
        half = np.abs(T[:3, :3]) @ self._half_m
        return np.array([middle - half, middle + half])

    def reach_odom_m(self) -> FloatArray:
        """Return :meth:`bounds_odom_m`."""
        return self.bounds_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """Return the surface; all levels of detail are the same."""
        places = np.broadcast_to(self._base_pose(), (self._triangles.pieces, 4, 4))
        return PlacedSurface(self._triangles, places)

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        """Return the parts and their poses; all levels of detail are the same."""
        if not self._bodies:
            self._bodies = [self._make(visuals, part) for part in self._parts]
        T_odom_base, wheels = self._base_pose(), self._wheel_angles()
        T_base_parts = np.tile(np.eye(4), (len(self._parts), 1, 1))
        T_base_parts[:, :3, 3] = [part.origin_m for part in self._parts]
        for T, angle in zip(T_base_parts[len(self._parts) - len(wheels) :], wheels, strict=True):
            T[:3, :3] = Rotation.from_rotvec((0.0, angle, 0.0)).as_matrix()
        return self._bodies, T_odom_base @ T_base_parts

    @staticmethod
    def _make(visuals: Visuals, part: LookPart) -> int:
        if part.colour is None:
            return visuals.add_body(part.mesh, texture=visuals.texture(scenery_texture("amr")))
        return visuals.add_body(part.mesh, part.colour)


@cache
def amr_meshes() -> dict[str, Mesh]:
    """Return the meshes of ``base_link``, ``left_wheel`` and ``right_wheel`` in their link frames.

    The base frame is that of :class:`Amr`. A wheel's frame has its origin in the hub and its axis
    along y.
    """
    return read_meshes(_AMR_FILE.read_bytes())


@cache
def _amr_triangles() -> TriangleSet:
    """Return the triangles of ``base_link`` in pieces; the body hides the wheels.

    A line of sight skips every piece that it passes above.
    """
    with _AMR_FILE.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        counts = arrays["base_piece_triangles"]
    base = amr_meshes()["base_link"]
    pieces = np.split(base.indices.reshape(-1, 3), np.cumsum(counts)[:-1])
    return TriangleSet([(base.vertices_m, triangles) for triangles in pieces])


def model_meshes(model: RobotModel) -> tuple[tuple[Mesh, Colour], ...]:
    """Return the meshes of a robot in its base frame, one for each colour."""
    if not model.parts:
        return ((_prism(model.outline_m, _LOW_M, model.height_m), _COLOUR),)
    by_colour: dict[Colour, list[Mesh]] = {}
    for part in model.parts:
        low, high = np.array(part.low_m), np.array(part.high_m)
        mesh = box(tuple(0.5 * (low + high)), tuple(high - low))
        by_colour.setdefault(part.colour, []).append(mesh)
    return tuple((merge(meshes), colour) for colour, meshes in by_colour.items())


def _prism(outline_m: FloatArray, low_m: float, high_m: float) -> Mesh:
    """Return an outline (M, 2), counter-clockwise, extruded from one height to another."""
    count = len(outline_m)
    ends = np.roll(outline_m, -1, axis=0)
    sides = np.stack([outline_m, ends, ends, outline_m], axis=1)  # (M, 4, 2) corners
    heights = np.broadcast_to([low_m, low_m, high_m, high_m], (count, 4))
    edges = ends - outline_m
    out = np.column_stack([edges[:, 1], -edges[:, 0], np.zeros(count)])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    top = np.column_stack([outline_m, np.full(count, high_m)])
    quads = 4 * np.arange(count)[:, None] + [0, 1, 2, 0, 2, 3]
    fans = np.arange(1, count - 1)
    lid = 4 * count + np.column_stack([np.zeros_like(fans), fans, fans + 1])
    return Mesh(
        np.vstack([np.dstack([sides, heights]).reshape(-1, 3), top]),
        np.vstack([np.repeat(out, 4, axis=0), np.tile([0.0, 0.0, 1.0], (count, 1))]),
        np.concatenate([quads.ravel(), lid.ravel()]),
    )
