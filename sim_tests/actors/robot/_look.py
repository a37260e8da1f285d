"""Visual actors of robots."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from importlib import resources
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world import Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError
from ...world.hall import Colour, Mesh, box, merge, read_meshes, scenery_texture
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._amr import TRACK_M, WHEEL_RADIUS_M, Amr
from ._kinematic_robot import KinematicRobot
from ._model import RobotModel

# Meshes of the Nova Carter; training/hall makes them.
_AMR_FILE: Final = resources.files(__package__) / "nova_carter.npz"
# Low and high corner of a box that holds the Nova Carter in its base frame.
_AMR_BOUNDS_M: Final = np.array([[-0.38, -0.26, -0.01], [0.38, 0.26, 1.46]])
_WHEELS: Final = ("left_wheel", "right_wheel")
# Colour of a robot without parts, and how far above the floor it begins.
_COLOUR: Final[Colour] = (0.2, 0.3, 0.45)
_LOW_M: Final = 0.05

#: T_odom_base (4, 4), and the rotation of the left and the right wheel about base y, radians.
Pose = tuple[Any, float, float]


class RobotLook(ABC):
    """The visual actor of a robot.

    Args:
        bounds_base_m: (2, 3) low and high corner of a box that holds the robot in its base frame.
        triangles: its surface in the base frame, in pieces.
        base_pose: returns the present T_odom_base (4, 4).

    Attributes:
        kind: ``"robot"``.
    """

    kind: Final = "robot"

    def __init__(
        self,
        bounds_base_m: FloatArray,
        triangles: TriangleSet,
        base_pose: Callable[[], FloatArray],
    ) -> None:
        self._middle_m = 0.5 * (bounds_base_m[0] + bounds_base_m[1])
        self._half_m = 0.5 * (bounds_base_m[1] - bounds_base_m[0])
        self._triangles = triangles
        self._base_pose = base_pose
        self._visuals: Visuals | None = None
        self._bodies: list[int] = []
        self._shown = True

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

    def build(self, visuals: Visuals) -> None:
        """Make the robot's bodies in the render world."""
        self._visuals = visuals
        self._bodies = [visuals.add_body(shape) for shape in self._shapes(visuals)]

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
        """Pose the bodies for the next image; None hides them.

        All levels of detail are the same.
        """
        if self._visuals is None:
            raise SimError(f"{type(self).__name__}.show() needs bodies: call build() first")
        shown = pixels_per_m is not None
        if shown != self._shown:
            change = self._visuals.reveal if shown else self._visuals.hide
            for body in self._bodies:
                change(body)
            self._shown = shown
        if not shown:
            return
        for body, (position, turn) in zip(self._bodies, self._places(), strict=True):
            pybullet.resetBasePositionAndOrientation(
                body,
                position.tolist(),
                turn.as_quat().tolist(),
                physicsClientId=self._visuals.client,
            )

    def bodies(self) -> frozenset[int]:
        """Return the ids of the robot's bodies in the render world."""
        return frozenset(self._bodies)

    @abstractmethod
    def _shapes(self, visuals: Visuals) -> list[int]:
        """Register the shape of each body."""

    @abstractmethod
    def _places(self) -> list[tuple[FloatArray, Rotation]]:
        """Return the present place and rotation of each body in odom."""


class AmrLook(RobotLook):
    """The visual actor of the Nova Carter: its body and two wheels.

    Args:
        pose: returns the robot's present pose.
        base_pose: returns T_odom_base alone, where that is quicker.
    """

    def __init__(
        self, pose: Callable[[], Pose], base_pose: Callable[[], FloatArray] | None = None
    ) -> None:

        def own_base_pose() -> FloatArray:
            return np.asarray(pose()[0])

        super().__init__(_AMR_BOUNDS_M, _amr_triangles(), base_pose or own_base_pose)
        self._pose = pose

    @classmethod
    def of(cls, warehouse: Warehouse, amr: Amr) -> AmrLook:
        """Make the visual actor of a robot in the physics world."""
        wheels = [
            joint
            for joint in range(pybullet.getNumJoints(amr.body, physicsClientId=warehouse.client))
            if pybullet.getJointInfo(amr.body, joint, physicsClientId=warehouse.client)[12].decode()
            in _WHEELS
        ]

        def pose() -> Pose:
            left, right = pybullet.getJointStates(
                amr.body, wheels, physicsClientId=warehouse.client
            )
            return amr.T_odom_base, left[0], right[0]

        return cls(pose, lambda: amr.T_odom_base)

    def _shapes(self, visuals: Visuals) -> list[int]:
        texture = visuals.texture(scenery_texture("amr"))
        meshes = amr_meshes()
        return [visuals.shape(meshes[link], texture=texture) for link in ("base_link", *_WHEELS)]

    def _places(self) -> list[tuple[FloatArray, Rotation]]:
        T, *turns = self._pose()
        T = np.asarray(T)
        base = Rotation.from_matrix(T[:3, :3])
        places = [(T[:3, :3] @ np.zeros(3) + T[:3, 3], base)]
        for y, turn in zip((0.5 * TRACK_M, -0.5 * TRACK_M), turns, strict=True):
            hub = T[:3, :3] @ np.array([0.0, y, WHEEL_RADIUS_M]) + T[:3, 3]
            places.append((hub, base * Rotation.from_rotvec((0.0, turn, 0.0))))
        return places


class KinematicLook(RobotLook):
    """The visual actor of a kinematic robot.

    Args:
        robot: the robot.
    """

    def __init__(self, robot: KinematicRobot) -> None:
        self._robot = robot
        self._meshes = model_meshes(robot.model)
        corners = np.vstack([mesh.vertices_m for mesh, _ in self._meshes])
        super().__init__(
            np.array([corners.min(axis=0), corners.max(axis=0)]),
            TriangleSet(
                [(mesh.vertices_m, mesh.indices.reshape(-1, 3)) for mesh, _ in self._meshes]
            ),
            lambda: robot.T_odom_base,
        )

    def _shapes(self, visuals: Visuals) -> list[int]:
        return [visuals.shape(mesh, colour) for mesh, colour in self._meshes]

    def _places(self) -> list[tuple[FloatArray, Rotation]]:
        T = self._robot.T_odom_base
        turn = Rotation.from_euler("z", math.atan2(T[1, 0], T[0, 0]))
        return [(T[:3, 3], turn)] * len(self._meshes)


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
    vertices: list[FloatArray] = []
    normals: list[FloatArray] = []
    indices: list[int] = []
    for k in range(count):
        (ax, ay), (bx, by) = outline_m[k], outline_m[(k + 1) % count]
        out = np.array([by - ay, ax - bx, 0.0])
        at = len(vertices)
        vertices += [
            np.array(corner)
            for corner in ((ax, ay, low_m), (bx, by, low_m), (bx, by, high_m), (ax, ay, high_m))
        ]
        normals += [out / np.linalg.norm(out)] * 4
        indices += [at, at + 1, at + 2, at, at + 2, at + 3]
    at = len(vertices)
    vertices += [np.array([x, y, high_m]) for x, y in outline_m.tolist()]
    normals += [np.array([0.0, 0.0, 1.0])] * count
    indices += [at + k for fan in range(1, count - 1) for k in (0, fan, fan + 1)]
    return Mesh(np.array(vertices), np.array(normals), np.array(indices, dtype=np.int64))
