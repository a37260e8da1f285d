"""Visual actor of a kinematic robot."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world.bullet import pybullet
from ...world.errors import SimError
from ...world.hall import Colour, Mesh, box, merge
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._kinematic_robot import KinematicRobot
from ._model import RobotModel

_COLOUR: Final[Colour] = (0.2, 0.3, 0.45)
_LOW_M: Final = 0.05


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


class KinematicLook:
    """The visual actor of a kinematic robot.

    Args:
        robot: the robot.

    Attributes:
        kind: ``"robot"``.
    """

    kind: Final = "robot"

    def __init__(self, robot: KinematicRobot) -> None:
        self._robot = robot
        self._meshes = model_meshes(robot.model)
        corners = np.vstack([mesh.vertices_m for mesh, _ in self._meshes])
        low, high = corners.min(axis=0), corners.max(axis=0)
        self._middle_m, self._half_m = 0.5 * (low + high), 0.5 * (high - low)
        self._triangles = TriangleSet(
            [(mesh.vertices_m, mesh.indices.reshape(-1, 3)) for mesh, _ in self._meshes]
        )
        self._visuals: Visuals | None = None
        self._bodies: list[int] = []
        self._shown = True

    def bounds_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the robot now."""
        T = self._robot.T_odom_base
        middle = T[:3, :3] @ self._middle_m + T[:3, 3]
        half = np.abs(T[:3, :3]) @ self._half_m
        return np.array([middle - half, middle + half])

    def reach_odom_m(self) -> FloatArray:
        """Return :meth:`bounds_odom_m`."""
        return self.bounds_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """Return the surface; all levels of detail are the same."""
        places = np.broadcast_to(self._robot.T_odom_base, (self._triangles.pieces, 4, 4))
        return PlacedSurface(self._triangles, places)

    def build(self, visuals: Visuals) -> None:
        """Make the robot's bodies in the render world."""
        self._visuals = visuals
        for mesh, colour in self._meshes:
            self._bodies.append(visuals.add_body(visuals.shape(mesh, colour, None)))

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
        """Pose the bodies for the next image; None hides them."""
        if self._visuals is None:
            raise SimError("KinematicLook.show() needs bodies: call build() first")
        shown = pixels_per_m is not None
        if shown != self._shown:
            change = self._visuals.reveal if shown else self._visuals.hide
            for body in self._bodies:
                change(body)
            self._shown = shown
        if not shown:
            return
        T = self._robot.T_odom_base
        turn = Rotation.from_euler("z", math.atan2(T[1, 0], T[0, 0])).as_quat().tolist()
        for body in self._bodies:
            pybullet.resetBasePositionAndOrientation(
                body, T[:3, 3].tolist(), turn, physicsClientId=self._visuals.client
            )

    def bodies(self) -> frozenset[int]:
        """Return the ids of the robot's bodies in the render world."""
        return frozenset(self._bodies)


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
