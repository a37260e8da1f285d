"""A person in the hall: placed, not simulated, with the truth about every keypoint."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number
from perception.layouts import LEFT_SHOULDER, RIGHT_SHOULDER

from ...world import Warehouse
from ...world.errors import SimError
from ._asset import JOINTS, WorkerAsset, load_worker
from ._footing import Footing
from ._gait import Gait
from ._held_thing import HeldThing
from ._physics import WorkerBody
from ._pose import (
    BentPoints,
    BodyPose,
    Quaternion,
    Vector,
    about,
    about_x,
    about_y,
    about_z,
    inverse,
    link_transforms,
    matrix,
    product,
    rotation_vector,
    turned,
)
from ._postures import ACTIVITIES, Activity, arm_postures
from ._skeleton import Skeleton, skeleton
from ._skin import WorkerSkin

#: How far the head turns from the torso, and how far it nods.
MAX_HEAD_YAW_RAD: Final = math.radians(80.0)
MAX_HEAD_PITCH_RAD: Final = math.radians(40.0)
#: How far the eyes turn in the head.
MAX_EYE_YAW_RAD: Final = math.radians(35.0)
MAX_EYE_PITCH_RAD: Final = math.radians(25.0)

_STATURE_M: Final = 1.75
_REACH_M: Final = 1.0  # nothing of a body is farther from its centre line
# The optical frame (x right, y down, z forward) in the head frame (x down, y forward, z right).
_ROTATION_HEAD_OPTICAL: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_CHEST_SHOULDERS: Final = 0.7
# The trunk leans into a brisk walk.
_LEAN_RAD: Final = math.radians(3.5)
_KNEE_SHARE: Final = 0.2
_NECK: Final = "neck"
_SPINE: Final = "spine"
_RIGHT_WRIST: Final = JOINTS.index("right_wrist")


class Worker:
    """An articulated person in a warehouse.

    The body is one kinematic multibody: :meth:`place` sets where it is, a robot that runs into it
    finds it immovable. The body's own frame stands on the floor below its centre line, x forward,
    y left, z up.

    Args:
        warehouse: the world to stand in.
        stature_m: height standing, with shoes, in [1.4, 2.1]; None is that of ``look``, or 1.75 m.
        look: name of a shipped worker (:func:`worker_names`), scaled to the stature; None is the
            one of the nearest stature.
        stride_m: distance of a full gait cycle, see :class:`Gait`; None follows the speed.
        position_odom_m: (2,) where to stand first; None waits outside the hall, in nobody's way.
        heading_odom_rad: where to face first.

    Attributes:
        body: PyBullet's id of the person.
        client: PyBullet's id of the world it is in.
        skin: what pictures show of the person.
        actor: number of the skin among the actors of pictures.
        skeleton: the bones.
        gait: how the person walks.

    Raises:
        SimError: for arguments that are not finite, out of range or not shipped.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        stature_m: float | None = None,
        *,
        look: str | None = None,
        stride_m: float | None = None,
        position_odom_m: Any = None,
        heading_odom_rad: float = 0.0,
    ) -> None:
        if stature_m is None:
            stature_m = _STATURE_M if look is None else load_worker(look).stature_m
        self.skeleton: Skeleton = skeleton(look, stature_m)
        self.gait = Gait(self.skeleton, stride_m)
        if position_odom_m is None:
            position_odom_m = (warehouse.layout.x_min_m - 5.0, 0.0)
        finite_array("position_odom_m", position_odom_m, (2,), SimError)
        finite_number("heading_odom_rad", heading_odom_rad, SimError)
        bones = self.skeleton
        self._arms = arm_postures(bones)
        self._hips = tuple(
            _difference(bones.joint_m(f"{side}_hip"), bones.hips_m) for side in ("left", "right")
        )
        self._waist = _difference(bones.joint_m(_SPINE), bones.hips_m)
        self._neck = _difference(bones.joint_m(_NECK), bones.joint_m(_SPINE))
        self._chest = (
            _difference(bones.shoulders_m, bones.joint_m(_SPINE)),
            _difference(bones.hip_keypoints_m, bones.hips_m),
        )
        self._face = tuple(
            _difference(point, bones.joint_m(_NECK)) for point in (bones.nose_m, bones.eyes_m)
        )
        self._body = WorkerBody(warehouse, bones)
        self.client: int = warehouse.client
        self.body: int = self._body.body
        self.place(position_odom_m, heading_odom_rad)
        self.skin = WorkerSkin(self)
        self.actor: int = warehouse.add_actor(self.skin)
        warehouse.add_actor(HeldThing(self))

    def place(
        self,
        position_odom_m: Any,
        heading_odom_rad: float,
        walked_m: float = 0.0,
        speed_mps: float = 0.0,
        head_yaw_rad: float = 0.0,
        head_pitch_rad: float = 0.0,
        *,
        eye_yaw_rad: float = 0.0,
        eye_pitch_rad: float = 0.0,
        activity: str | Activity = "none",
        feet: Footing | None = None,
    ) -> None:
        """Put the person somewhere in some posture; the same arguments give the same posture.

        Args:
            position_odom_m: (2,) of the body's centre line.
            heading_odom_rad: of the body, counter-clockwise from odom x.
            walked_m: distance walked so far; it sets the phase of the gait.
            speed_mps: ≥ 0; of a straight walk, 0 stands.
            head_yaw_rad: of the head from the body, left positive, within ±80°.
            head_pitch_rad: up positive, within ±40°.
            eye_yaw_rad: of the eyes from the head, left positive, within ±35°.
            eye_pitch_rad: up positive, within ±25°.
            activity: what the hands do: ``"none"``, ``"carry_box"``, ``"phone"``, or on the way.
            feet: where feet and hips of this body are, in odom, from :func:`footstep_table`; None
                walks straight on by ``walked_m`` and ``speed_mps``.

        Raises:
            SimError: for a value that is not finite or out of range; nothing is moved then.
        """
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        walked = finite_number("walked_m", walked_m, SimError)
        speed = finite_number("speed_mps", speed_mps, SimError, minimum=0.0, maximum=3.0)
        head = (
            _angle("head_yaw_rad", head_yaw_rad, MAX_HEAD_YAW_RAD),
            _angle("head_pitch_rad", head_pitch_rad, MAX_HEAD_PITCH_RAD),
        )
        eyes = (
            _angle("eye_yaw_rad", eye_yaw_rad, MAX_EYE_YAW_RAD),
            _angle("eye_pitch_rad", eye_pitch_rad, MAX_EYE_PITCH_RAD),
        )
        doing = activity if isinstance(activity, Activity) else _activity(activity)
        if feet is None:
            footing, local = self.gait.footing(walked, speed), True
        else:
            footing, local = feet, False
        self._x_m, self._y_m, self._heading_rad = x, y, heading
        self._activity, self._eyes = doing, eyes
        self._keypoints: FloatArray | None = None
        self._reach: FloatArray | None = None
        self._pose: BodyPose | None = None
        self._links: FloatArray | None = None
        self._head_rotation: FloatArray | None = None
        self._bend(footing, local, head)
        self._body.put(self._hips_odom_m, self._pelvis, self._joints, doing.held == "box")

    @property
    def asset(self) -> WorkerAsset:
        """Whose body it is."""
        return self.skeleton.asset

    @property
    def stature_m(self) -> float:
        """Height of the body standing, with shoes."""
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
    def held(self) -> Literal["box", "phone"] | None:
        """What is in the hands."""
        return self._activity.held

    @property
    def T_odom_held(self) -> FloatArray | None:  # noqa: N802
        """(4, 4) of what is held, its middle as origin; None with empty hands.

        A box of :data:`BOX_SIZE_M` has x forward and z up, a phone of :data:`PHONE_SIZE_M` its
        screen towards −x and its long side along z.
        """
        if self.held is None:
            return None
        links = self.links_odom
        if self.held == "phone":
            return np.asarray(links[1 + _RIGHT_WRIST] @ self._arms.T_hand_phone)
        T_thorax_box = np.eye(4)
        T_thorax_box[:3, 3] = self._arms.box_m
        return np.asarray(links[1] @ T_thorax_box)

    @property
    def pose(self) -> BodyPose:
        """The whole posture: what draws the body needs no more."""
        if self._pose is None:
            T_odom_body = np.eye(4)
            rotation = matrix(self._pelvis)
            T_odom_body[:3, :3] = rotation
            T_odom_body[:3, 3] = self._hips_odom_m - rotation @ self.skeleton.hips_m
            rotvecs = np.array([rotation_vector(joint) for joint in self._joints])
            for array in (T_odom_body, rotvecs):
                array.setflags(write=False)
            self._pose = BodyPose(T_odom_body, self.skeleton.scale, rotvecs)
        return self._pose

    @property
    def links_odom(self) -> FloatArray:
        """(17, 4, 4) of :func:`link_transforms` now."""
        if self._links is None:
            self._links = link_transforms(self.asset.joints_m, self.pose)
        return self._links

    @property
    def chest_odom_m(self) -> FloatArray:
        """(3,) the body's centre line at chest height: 0.7 shoulders + 0.3 hips (keypoints)."""
        shoulders = _sum(self._waist_odom_m, turned(self._thorax, self._chest[0]))
        hips = _sum(self._hips_odom_m, turned(self._pelvis, self._chest[1]))
        rest = 1.0 - _CHEST_SHOULDERS
        return np.array(
            [_CHEST_SHOULDERS * a + rest * b for a, b in zip(shoulders, hips, strict=True)]
        )

    @property
    def rotation_odom_head(self) -> FloatArray:
        """(3, 3) the paper's head frame (x down, y forward, z right) in odom."""
        if self._head_rotation is None:
            forward, left, up = matrix(self._head).T.tolist()
            rotation = np.array([[-u, f, -s] for u, f, s in zip(up, forward, left, strict=True)])
            rotation.setflags(write=False)
            self._head_rotation = rotation
        return self._head_rotation

    @property
    def gaze_odom(self) -> FloatArray:
        """(3,) unit vector of the gaze: the head's forward axis turned by the eyes."""
        yaw, pitch = self._eyes
        cos = math.cos(pitch)
        return np.array(
            turned(self._head, (cos * math.cos(yaw), cos * math.sin(yaw), math.sin(pitch)))
        )

    @property
    def position_nose_odom_m(self) -> FloatArray:
        """(3,) tip of the nose, the origin of the head frame."""
        return np.array(_sum(self._neck_odom_m, turned(self._head, self._face[0])))

    @property
    def eyes_odom_m(self) -> FloatArray:
        """(3,) midpoint of the eyes."""
        return np.array(_sum(self._neck_odom_m, turned(self._head, self._face[1])))

    @property
    def T_odom_eyes(self) -> FloatArray:  # noqa: N802
        """(4, 4) optical frame of a camera between the eyes, looking where the head points."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation_odom_head @ _ROTATION_HEAD_OPTICAL
        pose[:3, 3] = self.eyes_odom_m
        return pose

    def reach_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a generous box about all of the body in any posture."""
        if self._reach is None:
            side, top = _REACH_M * self.skeleton.scale, 1.15 * self.skeleton.stature_m
            low, high = self.position_odom_m - side, self.position_odom_m + side
            self._reach = np.array([(*low, -0.1), (*high, top)])
        return self._reach

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(23, 3) COCO's 17 keypoints, then big toe, small toe and heel, left and right."""
        if self._keypoints is None:
            self._keypoints = _keypoints(self.asset).odom_m(self.pose)
            self._keypoints.setflags(write=False)
        return self._keypoints

    @property
    def neck_odom_m(self) -> FloatArray:
        """(3,) midpoint of the shoulder keypoints."""
        return np.asarray(self.keypoints_odom_m[[LEFT_SHOULDER, RIGHT_SHOULDER]].mean(axis=0))

    def _bend(self, footing: Footing, local: bool, head: tuple[float, float]) -> None:
        """Joint angles from feet, hips, head and hands, in the frame of the heading, then odom."""
        activity = self._activity
        pelvis = product(about_z(footing.pelvis_yaw_rad), about_x(footing.pelvis_list_rad))
        lean = _LEAN_RAD * footing.vigour * (1.0 - activity.upright)
        thorax = product(about_z(footing.thorax_yaw_rad), about_y(lean))
        facing = product(about_z(head[0]), about_y(-head[1]))
        hips = (0.0, footing.sway_m, footing.hip_height_m)
        back = inverse(pelvis)
        legs: list[Quaternion] = []
        for side in (0, 1):
            ankle, yaw, pitch = self._ankle(footing.feet[side], local)
            hip = _sum(hips, turned(pelvis, self._hips[side]))
            # The knee points part of the way to the toes, the ankle turns the rest.
            knee_yaw = footing.pelvis_yaw_rad + _KNEE_SHARE * (yaw - footing.pelvis_yaw_rad)
            across = turned(back, (-math.sin(knee_yaw), math.cos(knee_yaw), 0.0))
            leg = self.skeleton.legs[side]
            thigh, bend = leg.solve(turned(back, _difference(ankle, hip)), across)
            knee = about(leg.axis, bend)
            foot = product(back, product(about_z(yaw), about_y(pitch)))
            legs += (thigh, knee, product(inverse(product(thigh, knee)), foot))
        eye = product(about_z(self._eyes[0]), about_y(-self._eyes[1]))
        left, right = self._arms.arms(footing, activity)
        self._joints: tuple[Quaternion, ...] = (
            product(back, thorax),
            product(inverse(thorax), facing),
            eye,
            eye,
            *left,
            *right,
            *legs,
        )
        heading = about_z(self._heading_rad)
        x, y, z = turned(heading, hips)
        self._hips_odom_m: Vector = (self._x_m + x, self._y_m + y, z)
        self._pelvis: Quaternion = product(heading, pelvis)
        self._thorax: Quaternion = product(heading, thorax)
        self._head: Quaternion = product(heading, facing)
        self._waist_odom_m = _sum(self._hips_odom_m, turned(self._pelvis, self._waist))
        self._neck_odom_m = _sum(self._waist_odom_m, turned(self._thorax, self._neck))

    def _ankle(
        self, foot: tuple[float, float, float, float, float], local: bool
    ) -> tuple[Vector, float, float]:
        """Ankle, yaw and pitch of a foot in the frame of the heading."""
        x, y, z, yaw, pitch = foot
        if local:
            return (x, y, z), yaw, pitch
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        dx, dy = x - self._x_m, y - self._y_m
        ankle = (cos * dx + sin * dy, cos * dy - sin * dx, z)
        return ankle, yaw - self._heading_rad, pitch


@lru_cache(maxsize=64)
def _keypoints(asset: WorkerAsset) -> BentPoints:
    return BentPoints(asset.joints_m, asset.keypoints_m, asset.keypoint_weights)


def _activity(name: str) -> Activity:
    if name not in ACTIVITIES:
        valid = ", ".join(map(repr, ACTIVITIES))
        raise SimError(f"activity must be one of {valid}, got {name!r}")
    return Activity(name, name)


def _angle(name: str, value: float, limit_rad: float) -> float:
    """A finite angle within ±limit; rounding at the limit is forgiven."""
    angle = finite_number(name, value, SimError)
    if abs(angle) > limit_rad + 1e-9:
        raise SimError(
            f"{name} must lie within ±{limit_rad:.3f} rad (±{math.degrees(limit_rad):.0f}°), "
            f"got {angle:g} rad"
        )
    return angle


def _sum(first: Vector, second: Vector) -> Vector:
    return (first[0] + second[0], first[1] + second[1], first[2] + second[2])


def _difference(first: Vector, second: Vector) -> Vector:
    return (first[0] - second[0], first[1] - second[1], first[2] - second[2])
