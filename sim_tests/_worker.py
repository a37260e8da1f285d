"""A person in the hall: placed, not simulated, with the truth about every keypoint."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from perception import layouts as kp
from perception.anthropometry import EYES_HEAD_M, HEAD_TEMPLATE_M
from perception.arrays import FloatArray, finite_array, finite_number

from ._errors import SimError
from ._gait import Gait, Posture
from ._skeleton import Skeleton
from ._warehouse import Warehouse
from ._worker_body import ARM_SPREAD_RAD, WorkerBody, WorkerColours

#: How far the head turns from the torso, and how far it nods.
MAX_HEAD_YAW_RAD: Final = math.radians(80.0)
MAX_HEAD_PITCH_RAD: Final = math.radians(40.0)

_SIDES: Final = (1.0, -1.0)
_KEYPOINTS: Final = len(kp.COCO_NAMES) + len(kp.FOOT_NAMES)
# Toes and heel in the foot's frame (ahead of the ankle, towards the body's middle, above the sole)
# as fractions of stature: big toe, small toe, heel.
_FOOT_POINTS: Final = ((0.090, 0.010, 0.012), (0.070, -0.022, 0.010), (-0.030, 0.0, 0.018))
# The optical frame (x right, y down, z forward) in the head frame (x down, y forward, z right).
_ROTATION_HEAD_OPTICAL: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_CHEST_SHOULDERS: Final = 0.7


class Worker:
    """An articulated person in a warehouse.

    The body is one kinematic multibody: :meth:`place` sets where it is, a robot that runs into it
    finds it immovable. The body's own frame stands on the floor below its centre line, x forward,
    y left, z up.

    Args:
        warehouse: the world to stand in.
        stature_m: in [1.4, 2.1].
        stride_m: distance of a full gait cycle, see :class:`Gait`; shorter for slow walkers.
        colours: what is worn.
        position_odom_m: (2,) where to stand first; None waits outside the hall, in nobody's way.
        heading_odom_rad: where to face first.

    Attributes:
        body: PyBullet's id of the person.
        skeleton: the proportions.
        gait: how the person walks.

    Raises:
        SimError: for arguments that are not finite or out of range.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        stature_m: float = 1.75,
        *,
        stride_m: float | None = None,
        colours: WorkerColours | None = None,
        position_odom_m: Any = None,
        heading_odom_rad: float = 0.0,
    ) -> None:
        self.skeleton = Skeleton.from_stature(stature_m)
        self.gait = Gait(self.skeleton, stride_m)
        if position_odom_m is None:
            position_odom_m = (warehouse.layout.x_min_m - 5.0, 0.0)
        finite_array("position_odom_m", position_odom_m, (2,), SimError)
        finite_number("heading_odom_rad", heading_odom_rad, SimError)
        self._body = WorkerBody(warehouse, self.skeleton, colours or WorkerColours())
        self.body: int = self._body.body
        self.place(position_odom_m, heading_odom_rad)

    def place(
        self,
        position_odom_m: Any,
        heading_odom_rad: float,
        walked_m: float = 0.0,
        speed_mps: float = 0.0,
        head_yaw_rad: float = 0.0,
        head_pitch_rad: float = 0.0,
    ) -> None:
        """Put the person somewhere in some posture; the same arguments give the same posture.

        Args:
            position_odom_m: (2,) of the body's centre line.
            heading_odom_rad: of the body, counter-clockwise from odom x.
            walked_m: distance walked so far; it sets the phase of the gait.
            speed_mps: ≥ 0; towards 0 the gait fades into standing.
            head_yaw_rad: of the head from the body, left positive, within ±80°.
            head_pitch_rad: up positive, within ±40°.

        Raises:
            SimError: for a value that is not finite or out of range; nothing is moved then.
        """
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        walked = finite_number("walked_m", walked_m, SimError)
        speed = finite_number("speed_mps", speed_mps, SimError, minimum=0.0)
        yaw = _angle("head_yaw_rad", head_yaw_rad, MAX_HEAD_YAW_RAD)
        pitch = _angle("head_pitch_rad", head_pitch_rad, MAX_HEAD_PITCH_RAD)
        posture = self.gait.posture(walked, speed)
        self._x_m, self._y_m, self._heading_rad = x, y, heading
        self._yaw_rad, self._pitch_rad, self._posture = yaw, pitch, posture
        self._keypoints: FloatArray | None = None
        self._head: tuple[FloatArray, FloatArray] | None = None
        self._body.put((x, y, posture.hip_height_m), heading, _joint_angles(posture, yaw, pitch))

    @property
    def stature_m(self) -> float:
        """Height of the body standing."""
        return self.skeleton.stature_m

    @property
    def position_odom_m(self) -> FloatArray:
        """(2,) the body's centre line."""
        return np.array([self._x_m, self._y_m])

    @property
    def heading_odom_rad(self) -> float:
        """Heading of the body."""
        return self._heading_rad

    @property
    def chest_odom_m(self) -> FloatArray:
        """(3,) the body's centre line at chest height: 0.7 shoulders + 0.3 hips."""
        height = self._posture.hip_height_m + _CHEST_SHOULDERS * self.skeleton.torso_m
        return np.array([self._x_m, self._y_m, height])

    @property
    def rotation_odom_head(self) -> FloatArray:
        """(3, 3) the paper's head frame (x down, y forward, z right) in odom."""
        return self._head_pose()[0]

    @property
    def position_nose_odom_m(self) -> FloatArray:
        """(3,) tip of the nose, the origin of the head frame."""
        return self._head_pose()[1]

    @property
    def eyes_odom_m(self) -> FloatArray:
        """(3,) midpoint of the eyes."""
        rotation, nose = self._head_pose()
        return np.asarray(nose + rotation @ EYES_HEAD_M)

    @property
    def T_odom_eyes(self) -> FloatArray:  # noqa: N802
        """(4, 4) optical frame of a camera between the eyes, looking where the head points."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation_odom_head @ _ROTATION_HEAD_OPTICAL
        pose[:3, 3] = self.eyes_odom_m
        return pose

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(23, 3) COCO's 17 keypoints, then big toe, small toe and heel, left and right."""
        if self._keypoints is None:
            rotation, nose = self._head_pose()
            cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
            keypoints = np.empty((_KEYPOINTS, 3))
            keypoints[:5] = nose + HEAD_TEMPLATE_M @ rotation.T
            body = np.array(_body_points(self.skeleton, self._posture))
            keypoints[5:, 0] = self._x_m + cos * body[:, 0] - sin * body[:, 1]
            keypoints[5:, 1] = self._y_m + sin * body[:, 0] + cos * body[:, 1]
            keypoints[5:, 2] = body[:, 2]
            keypoints.setflags(write=False)
            self._keypoints = keypoints
        return self._keypoints

    def _head_pose(self) -> tuple[FloatArray, FloatArray]:
        """Rotation of the head frame and position of the nose in odom."""
        if self._head is None:
            body = self.skeleton
            azimuth = self._heading_rad + self._yaw_rad
            ca, sa = math.cos(azimuth), math.sin(azimuth)
            cp, sp = math.cos(self._pitch_rad), math.sin(self._pitch_rad)
            forward = (cp * ca, cp * sa, sp)
            up = (-sp * ca, -sp * sa, cp)
            right = (sa, -ca, 0.0)
            rotation = np.array([[-u, f, r] for u, f, r in zip(up, forward, right, strict=True)])
            ahead, rise = body.nose_ahead_m, body.nose_up_m - body.head_pivot_up_m
            pivot = self._posture.hip_height_m + body.torso_m + body.head_pivot_up_m
            nose = np.array(
                [
                    self._x_m + ahead * forward[0] + rise * up[0],
                    self._y_m + ahead * forward[1] + rise * up[1],
                    pivot + ahead * forward[2] + rise * up[2],
                ]
            )
            rotation.setflags(write=False)
            nose.setflags(write=False)
            self._head = rotation, nose
        return self._head


def _angle(name: str, value: float, limit_rad: float) -> float:
    """A finite angle within ±limit; rounding at the limit is forgiven."""
    angle = finite_number(name, value, SimError)
    if abs(angle) > limit_rad + 1e-9:
        raise SimError(
            f"{name} must lie within ±{limit_rad:.3f} rad (±{math.degrees(limit_rad):.0f}°), "
            f"got {angle:g} rad"
        )
    return angle


def _joint_angles(posture: Posture, yaw_rad: float, pitch_rad: float) -> list[float]:
    """Angles in the order of the body's joints."""
    angles = [yaw_rad, pitch_rad]
    for shoulder, elbow in zip(posture.shoulder_rad, posture.elbow_rad, strict=True):
        angles += (shoulder, elbow)
    for hip, knee, foot in zip(posture.hip_rad, posture.knee_rad, posture.foot_rad, strict=True):
        angles += (hip, -knee, knee - hip - foot)
    return angles


def _body_points(body: Skeleton, posture: Posture) -> list[tuple[float, float, float]]:
    """Shoulders, elbows, wrists, hips, knees, ankles and feet in the body's frame.

    Legs move in planes along the heading; arms in planes tilted outwards by ``ARM_SPREAD_RAD``.
    """
    hip_height = posture.hip_height_m
    shoulder_height = hip_height + body.torso_m
    out, down = math.sin(ARM_SPREAD_RAD), math.cos(ARM_SPREAD_RAD)
    shoulders, elbows, wrists, hips, knees, ankles = [], [], [], [], [], []
    feet = []
    for side, shoulder, elbow, hip, knee, foot in zip(
        _SIDES,
        posture.shoulder_rad,
        posture.elbow_rad,
        posture.hip_rad,
        posture.knee_rad,
        posture.foot_rad,
        strict=True,
    ):
        y = side * body.shoulder_half_span_m
        x, hang = body.upper_arm_m * math.sin(shoulder), body.upper_arm_m * math.cos(shoulder)
        shoulders.append((0.0, y, shoulder_height))
        elbows.append((x, y + side * out * hang, shoulder_height - down * hang))
        x += body.forearm_m * math.sin(shoulder + elbow)
        hang += body.forearm_m * math.cos(shoulder + elbow)
        wrists.append((x, y + side * out * hang, shoulder_height - down * hang))
        y = side * body.hip_half_span_m
        x, z = body.thigh_m * math.sin(hip), hip_height - body.thigh_m * math.cos(hip)
        hips.append((0.0, y, hip_height))
        knees.append((x, y, z))
        x += body.shank_m * math.sin(hip - knee)
        z -= body.shank_m * math.cos(hip - knee)
        ankles.append((x, y, z))
        cos, sin = math.cos(foot), math.sin(foot)
        for ahead, inwards, above in _FOOT_POINTS:
            dx = ahead * body.stature_m
            dz = above * body.stature_m - body.ankle_height_m
            feet.append(
                (
                    x + cos * dx + sin * dz,
                    y - side * inwards * body.stature_m,
                    z - sin * dx + cos * dz,
                )
            )
    return [*shoulders, *elbows, *wrists, *hips, *knees, *ankles, *feet]
