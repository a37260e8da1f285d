"""Visual actor of the robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world import Warehouse
from ...world.bullet import pybullet
from ...world.errors import SimError
from ...world.hall import scenery_texture
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface
from ._amr import TRACK_M, WHEEL_RADIUS_M, Amr
from ._meshes import amr_meshes, base_triangles

# Low and high corner of a box that holds the robot in its base frame.
_BOUNDS_BASE_M: Final = np.array([[-0.38, -0.26, -0.01], [0.38, 0.26, 1.46]])
_MIDDLE_BASE_M: Final = _BOUNDS_BASE_M.mean(axis=0)
_HALF_BASE_M: Final = 0.5 * (_BOUNDS_BASE_M[1] - _BOUNDS_BASE_M[0])

#: T_odom_base (4, 4), and the rotation of the left and the right wheel about base y, radians.
Pose = tuple[Any, float, float]


class AmrLook:
    """The visual actor of a robot.

    Args:
        pose: returns the robot's present pose.
        base_pose: returns T_odom_base alone, where that is quicker.

    Attributes:
        kind: ``"robot"``.
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
        """Make the visual actor of a robot in the physics world."""
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
        """Return (2, 3) the low and high corner of a box that holds the robot now."""
        T = self._base_pose()
        middle = T[:3, :3] @ _MIDDLE_BASE_M + T[:3, 3]
        half = np.abs(T[:3, :3]) @ _HALF_BASE_M
        return np.array([middle - half, middle + half])

    def reach_odom_m(self) -> FloatArray:
        """Return :meth:`bounds_odom_m`."""
        return self.bounds_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """Return the surface without the wheels, which the body hides.

        All levels of detail are the same.
        """
        triangles = base_triangles()
        places = np.broadcast_to(self._base_pose(), (triangles.pieces, 4, 4))
        return PlacedSurface(triangles, places)

    def build(self, visuals: Visuals) -> None:
        """Make the robot's bodies in the render world."""
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
        """Pose the bodies for the next image; None hides them.

        All levels of detail are the same.
        """
        if self._visuals is None:
            raise SimError("AmrLook.show() needs bodies: call build() first")
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
        """Return the ids of the robot's bodies in the render world."""
        return frozenset(body for body, _, _ in self._parts)
