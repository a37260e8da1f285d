"""People in random postures and looks: :class:`Figure` is a worker's body without its physics."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray
from sim_tests.actors.body import (
    JOINTS,
    BodyPose,
    WorkerAsset,
    WorkerSkin,
    link_transforms,
    load_worker,
    skin_points,
)
from sim_tests.world import Warehouse

from ._postures import Posture

# The columns of the paper's head frame (x down, y forward, z right) in a body's own axes.
_ROTATION_BODY_HEAD: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
# Half the thickness of a body of 1.75 m about keypoints that may rest on the floor, metres.
_SUPPORTS_M: Final[dict[int, float]] = {
    **dict.fromkeys(range(17, 23), 0.02),  # toes and heels
    **dict.fromkeys((15, 16), 0.07),  # ankles
    **dict.fromkeys((13, 14), 0.065),  # knees
    **dict.fromkeys((11, 12), 0.11),  # hips
    **dict.fromkeys((9, 10), 0.03),  # wrists
}
_MEAN_STATURE_M: Final = 1.75
_HIPS_ABOVE_SEAT_M: Final = 0.10
_REACH_M: Final = 1.3


class Figure:
    """A person in the render world, in any posture, with the truth about every keypoint.

    Args:
        warehouse: the hall.
        look: name of a worker, or an ``.npz`` file.
        textures: of each level of detail; None takes the worker's own.

    Attributes:
        skin: the visual actor.
        actor: its number.
        posture: the last posture; None outside the hall.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        look: str,
        textures: tuple[NDArray[np.uint8], ...] | None = None,
    ) -> None:
        self._asset = load_worker(look)
        self._outside = np.array([warehouse.layout.x_min_m - 9.0, 0.0])
        self.posture: Posture | None = None
        self.remove()
        self.skin = WorkerSkin(self, textures)
        self.actor: int = warehouse.add_actor(self.skin)

    @property
    def asset(self) -> WorkerAsset:
        """The worker whose body it is."""
        return self._asset

    @property
    def stature_m(self) -> float:
        """Standing height with shoes."""
        return self._asset.stature_m

    @property
    def pose(self) -> BodyPose:
        """The pose from which the body is drawn."""
        return self._pose

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(23, 3) COCO's 17 keypoints, then big toe, small toe and heel, left before right."""
        return self._keypoints

    @property
    def position_odom_m(self) -> FloatArray:
        """(2,) middle of the hip joints on the floor plan."""
        return self._position

    @property
    def rotation_odom_head(self) -> FloatArray:
        """(3, 3) rotation of the paper's head frame in odom."""
        return self.links_odom[1 + JOINTS.index("neck"), :3, :3] @ _ROTATION_BODY_HEAD

    @property
    def links_odom(self) -> FloatArray:
        """(17, 4, 4) transforms of the links from the scaled body at rest to odom."""
        return link_transforms(self._asset.joints_m, self._pose)

    @property
    def seat_height_m(self) -> float:
        """Height of a seat under the hips."""
        size = self.stature_m / _MEAN_STATURE_M
        return float(self._keypoints[[11, 12], 2].mean()) - _HIPS_ABOVE_SEAT_M * size

    def reach_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the body."""
        low, high = self._position - _REACH_M, self._position + _REACH_M
        return np.array([(*low, -0.1), (*high, 1.3 * self.stature_m)])

    def place(self, position_odom_m: Any, heading_odom_rad: float, posture: Posture) -> None:
        """Place the figure on the floor: the lowest of feet, knees, hips and hands touches it."""
        self.posture = posture
        self._place(np.asarray(position_odom_m, dtype=np.float64), heading_odom_rad, posture)

    def remove(self) -> None:
        """Move the figure out of the hall."""
        self.posture = None
        still = Posture("standing", np.zeros(3), np.zeros((len(JOINTS), 3)))
        self._place(self._outside, 0.0, still)

    def _place(self, position: FloatArray, heading_rad: float, posture: Posture) -> None:
        asset = self._asset
        turn = Rotation.from_rotvec([0.0, 0.0, heading_rad]) * Rotation.from_rotvec(
            posture.pelvis_rotvec
        )
        hips = asset.joints_m[[JOINTS.index("left_hip"), JOINTS.index("right_hip")]].mean(axis=0)
        T_odom_body = np.eye(4)
        T_odom_body[:3, :3] = turn.as_matrix()
        T_odom_body[:3, 3] = np.append(position, 0.0) - turn.apply(hips)
        pose = BodyPose(T_odom_body, 1.0, posture.joint_rotvecs)
        points = self._points(pose)
        size = self.stature_m / _MEAN_STATURE_M
        lowest = min(points[row, 2] - size * below for row, below in _SUPPORTS_M.items())
        T_odom_body[2, 3] -= lowest
        points[:, 2] -= lowest
        for array in (T_odom_body, points, posture.joint_rotvecs):
            array.setflags(write=False)
        self._pose, self._keypoints, self._position = pose, points, position

    def _points(self, pose: BodyPose) -> FloatArray:
        asset = self._asset
        return skin_points(asset.joints_m, pose, asset.keypoints_m, asset.keypoint_weights)
