"""A person in the warehouse: placed, not simulated, with the true position of every keypoint."""

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
from ._footsteps import steady_walk
from ._gait import FootPose, Gait, GaitPose
from ._physics import WorkerBody
from ._pose import BodyPose, SkinnedPoints, link_transforms
from ._postures import Activity, Foot, JointAngles, arm_postures, kneeling_pose, seated_pose
from ._quaternions import (
    Quaternion,
    Vector,
    add,
    multiply,
    rotate,
    rotation_matrix,
    rotation_vector,
    rotation_z,
    subtract,
)
from ._skeleton import Skeleton, skeleton
from ._skin import HeldObject, Seat, SeatKind, WorkerSkin, fitting_seat, seat_pose

#: Largest yaw and pitch of the head from the body.
MAX_HEAD_YAW_RAD: Final = math.radians(80.0)
MAX_HEAD_PITCH_RAD: Final = math.radians(40.0)
#: Largest yaw and pitch of the eyes from the head.
MAX_EYE_YAW_RAD: Final = math.radians(35.0)
MAX_EYE_PITCH_RAD: Final = math.radians(25.0)

_DEFAULT_STATURE_M: Final = 1.75
# No part of an unscaled body is farther from its centre line.
_REACH_M: Final = 1.0
# The optical frame (x right, y down, z forward) in the head frame (x down, y forward, z right).
_ROTATION_HEAD_OPTICAL: Final = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
# The chest lies at this share of the way from the hips to the shoulders.
_CHEST_SHARE: Final = 0.7
_NECK: Final = "neck"
_SPINE: Final = "spine"
_RIGHT_WRIST: Final = JOINTS.index("right_wrist")


class Worker:
    """An articulated person in a warehouse.

    The body is one kinematic multibody. Only :meth:`place` moves it; a robot that runs into it does
    not. The body's frame stands on the floor below its centre line, x forward, y left, z up.

    Args:
        warehouse: the world to stand in.
        stature_m: standing height with shoes, in [1.0, 2.1]; None is that of ``look``, or 1.75 m.
        look: name of a shipped worker (:func:`worker_names`), scaled to the stature; None is the
            one of nearest stature.
        position_odom_m: (2,) first position; None waits outside the warehouse.
        heading_odom_rad: first heading.
        seat: what the person sits on when seated.

    Attributes:
        body: PyBullet's id of the person.
        collision_left_behind: whether the collision body is not at the present posture.
        collision_place_odom_m: x and y of the person when it was last moved.
        client: PyBullet's id of the world.
        skin: visual actor of the person.
        actor: number of the skin among the visual actors.
        seat: what the person sits on when seated.
        held_object: visual actor of what the person holds or sits on.
        skeleton: the bones.
        gait: the gait.

    Raises:
        SimError: for arguments that are not finite, out of range or not shipped.
    """

    def __init__(
        self,
        warehouse: Warehouse,
        stature_m: float | None = None,
        *,
        look: str | None = None,
        position_odom_m: Any = None,
        heading_odom_rad: float = 0.0,
        seat: SeatKind = "stool",
    ) -> None:
        if stature_m is None:
            stature_m = _DEFAULT_STATURE_M if look is None else load_worker(look).stature_m
        self.skeleton: Skeleton = skeleton(look, stature_m)
        self.gait = Gait(self.skeleton)
        if position_odom_m is None:
            position_odom_m = (warehouse.layout.x_min_m - 5.0, 0.0)
        finite_array("position_odom_m", position_odom_m, (2,), SimError)
        finite_number("heading_odom_rad", heading_odom_rad, SimError)
        bones = self.skeleton
        self._arms = arm_postures(bones)
        self._angles = JointAngles(bones)
        self._waist = subtract(bones.joint_m(_SPINE), bones.hips_m)
        self._neck = subtract(bones.joint_m(_NECK), bones.joint_m(_SPINE))
        self._chest = (
            subtract(bones.shoulders_m, bones.joint_m(_SPINE)),
            subtract(bones.hip_keypoints_m, bones.hips_m),
        )
        self._eyes_from_neck = subtract(bones.eyes_m, bones.joint_m(_NECK))
        self.seat: Seat = fitting_seat(bones, seat)
        self._body = WorkerBody(warehouse, bones, self.seat)
        self.client: int = warehouse.client
        self.body: int = self._body.body
        self.place(position_odom_m, heading_odom_rad)
        self.skin = WorkerSkin(self)
        self.actor: int = warehouse.add_actor(self.skin)
        self.held_object = HeldObject(self)
        warehouse.add_actor(self.held_object)

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
        feet: GaitPose | None = None,
        collides: bool = True,
    ) -> None:
        """Place the person in a posture. The same arguments always give the same posture.

        Args:
            position_odom_m: (2,) the body's centre line.
            heading_odom_rad: of the body, counter-clockwise from odom x.
            walked_m: distance walked so far, which sets the phase of the gait.
            speed_mps: speed of a straight walk, in [0, 3]; 0 stands.
            head_yaw_rad: of the head from the body, left positive, within ±80°.
            head_pitch_rad: of the head, up positive, within ±40°.
            eye_yaw_rad: of the eyes from the head, left positive, within ±35°.
            eye_pitch_rad: of the eyes from the head, up positive, within ±25°.
            activity: ``"none"``, ``"carry_box"``, ``"phone"``, or a change between two of them;
                or ``"sitting"`` on the seat, or ``"kneeling"``; the hips are above the position.
            feet: gait pose in odom, as :class:`OnlineFootsteps` gives it; None takes the straight
                walk of ``walked_m`` and ``speed_mps``, which are unused otherwise. Unused low down.
            collides: False leaves the collision body behind until :meth:`place_collision_body`,
                which saves half the time.

        Raises:
            SimError: for a value that is not finite or out of range; the person is not moved then.
        """
        x, y = finite_array("position_odom_m", position_odom_m, (2,), SimError).tolist()
        heading = finite_number("heading_odom_rad", heading_odom_rad, SimError)
        head = (
            _checked_angle("head_yaw_rad", head_yaw_rad, MAX_HEAD_YAW_RAD),
            _checked_angle("head_pitch_rad", head_pitch_rad, MAX_HEAD_PITCH_RAD),
        )
        eyes = (
            _checked_angle("eye_yaw_rad", eye_yaw_rad, MAX_EYE_YAW_RAD),
            _checked_angle("eye_pitch_rad", eye_pitch_rad, MAX_EYE_PITCH_RAD),
        )
        doing = activity if isinstance(activity, Activity) else Activity.of(activity)
        gait_pose, feet_are_local = feet, False
        if doing.stays:
            gait_pose = seated_pose(self.skeleton) if doing.seated else kneeling_pose(self.skeleton)
            feet_are_local = True
        elif gait_pose is None:
            walked = finite_number("walked_m", walked_m, SimError)
            speed = finite_number("speed_mps", speed_mps, SimError, minimum=0.0, maximum=3.0)
            gait_pose, feet_are_local = steady_walk(self.gait, walked, speed), True
        self._x_m, self._y_m, self._heading_rad = x, y, heading
        self._activity, self._eyes = doing, eyes
        self._keypoints: FloatArray | None = None
        self._reach: FloatArray | None = None
        self._pose: BodyPose | None = None
        self._links: FloatArray | None = None
        self._head_rotation: FloatArray | None = None
        self._gait_pose, self._feet_are_local = gait_pose, feet_are_local
        self._solved_joints: tuple[Quaternion, ...] | None = None
        self._solve_trunk(head)
        self.collision_left_behind = True
        if collides:
            self.place_collision_body()

    def place_collision_body(self) -> None:
        """Move the collision body to the present posture, if it was left behind."""
        if not self.collision_left_behind:
            return
        self.collision_left_behind = False
        doing = self._activity
        seat = self.T_odom_held if doing.seated else None
        self._body.place(self._hips_odom_m, self._pelvis, self._joints, doing.held == "box", seat)
        self.collision_place_odom_m = (self._x_m, self._y_m)

    @property
    def place_odom_m(self) -> tuple[float, float]:
        """Position of the body's centre line, x and y."""
        return self._x_m, self._y_m

    @property
    def asset(self) -> WorkerAsset:
        """The shipped worker whose body it is."""
        return self.skeleton.asset

    @property
    def stature_m(self) -> float:
        """Standing height with shoes."""
        return self.skeleton.stature_m

    @property
    def position_odom_m(self) -> FloatArray:
        """(2,) position of the body's centre line."""
        return np.array([self._x_m, self._y_m])

    @property
    def heading_odom_rad(self) -> float:
        """Heading of the body."""
        return self._heading_rad

    @property
    def held(self) -> Literal["box", "phone", "seat"] | None:
        """The object in the hands, or the seat under the body; None for neither."""
        return self._activity.held

    @property
    def T_odom_held(self) -> FloatArray | None:  # noqa: N802
        """(4, 4) pose of the held object or the seat, with its middle as origin; None for neither.

        A box (:data:`BOX_SIZE_M`) and a seat have x forward and z up. A phone
        (:data:`PHONE_SIZE_M`) has its screen towards −x and its long side along z.
        """
        if self.held is None:
            return None
        if self.held == "seat":
            return seat_pose(self.seat, self._x_m, self._y_m, self._heading_rad)
        links = self.links_odom
        if self.held == "phone":
            return np.asarray(links[1 + _RIGHT_WRIST] @ self._arms.T_hand_phone)
        T_thorax_box = np.eye(4)
        T_thorax_box[:3, 3] = self._arms.box_m
        return np.asarray(links[1] @ T_thorax_box)

    @property
    def pose(self) -> BodyPose:
        """The pose from which the body is drawn."""
        if self._pose is None:
            T_odom_body = np.eye(4)
            rotation = rotation_matrix(self._pelvis)
            T_odom_body[:3, :3] = rotation
            T_odom_body[:3, 3] = self._hips_odom_m - rotation @ self.skeleton.hips_m
            rotvecs = np.array([rotation_vector(joint) for joint in self._joints])
            for array in (T_odom_body, rotvecs):
                array.setflags(write=False)
            self._pose = BodyPose(T_odom_body, self.skeleton.scale, rotvecs)
        return self._pose

    @property
    def links_odom(self) -> FloatArray:
        """(17, 4, 4) link transforms to odom; see :func:`link_transforms`."""
        if self._links is None:
            self._links = link_transforms(self.asset.joints_m, self.pose)
        return self._links

    @property
    def chest_odom_m(self) -> FloatArray:
        """(3,) centre line at chest height: 0.7 of the shoulder and 0.3 of the hip keypoints."""
        shoulders = add(self._waist_odom_m, rotate(self._thorax, self._chest[0]))
        hips = add(self._hips_odom_m, rotate(self._pelvis, self._chest[1]))
        rest = 1.0 - _CHEST_SHARE
        return np.array([_CHEST_SHARE * a + rest * b for a, b in zip(shoulders, hips, strict=True)])

    @property
    def rotation_odom_head(self) -> FloatArray:
        """(3, 3) rotation of the paper's head frame (x down, y forward, z right) in odom."""
        if self._head_rotation is None:
            forward, left, up = rotation_matrix(self._head).T.tolist()
            rotation = np.array([[-u, f, -s] for u, f, s in zip(up, forward, left, strict=True)])
            rotation.setflags(write=False)
            self._head_rotation = rotation
        return self._head_rotation

    @property
    def gaze_odom(self) -> FloatArray:
        """(3,) unit vector of the gaze: the head's forward axis rotated by the eyes."""
        yaw, pitch = self._eyes
        cos = math.cos(pitch)
        return np.array(
            rotate(self._head, (cos * math.cos(yaw), cos * math.sin(yaw), math.sin(pitch)))
        )

    @property
    def eyes_odom_m(self) -> FloatArray:
        """(3,) midpoint of the eyes."""
        return np.array(add(self._neck_odom_m, rotate(self._head, self._eyes_from_neck)))

    @property
    def T_odom_eyes(self) -> FloatArray:  # noqa: N802
        """(4, 4) optical frame of a camera between the eyes that looks along the head's axis."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation_odom_head @ _ROTATION_HEAD_OPTICAL
        pose[:3, 3] = self.eyes_odom_m
        return pose

    def reach_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the body in any posture."""
        if self._reach is None:
            side, top = _REACH_M * self.skeleton.scale, 1.15 * self.skeleton.stature_m
            low, high = self.position_odom_m - side, self.position_odom_m + side
            self._reach = np.array([(*low, -0.1), (*high, top)])
        return self._reach

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(23, 3) COCO's 17 keypoints, then big toe, small toe and heel, left before right."""
        if self._keypoints is None:
            self._keypoints = _skinned_keypoints(self.asset).odom_m(self.pose)
            self._keypoints.setflags(write=False)
        return self._keypoints

    @property
    def neck_odom_m(self) -> FloatArray:
        """(3,) midpoint of the shoulder keypoints."""
        return np.asarray(self.keypoints_odom_m[[LEFT_SHOULDER, RIGHT_SHOULDER]].mean(axis=0))

    def _solve_trunk(self, head_rad: tuple[float, float]) -> None:
        """Set hips, trunk and head, from which everything but the limbs follows."""
        trunk = self._trunk = JointAngles.trunk(self._gait_pose, self._activity.upright, head_rad)
        heading = rotation_z(self._heading_rad)
        x, y, z = rotate(heading, trunk.hips_m)
        self._hips_odom_m: Vector = (self._x_m + x, self._y_m + y, z)
        self._pelvis: Quaternion = multiply(heading, trunk.pelvis)
        self._thorax: Quaternion = multiply(heading, trunk.thorax)
        self._head: Quaternion = multiply(heading, trunk.head)
        self._waist_odom_m = add(self._hips_odom_m, rotate(self._pelvis, self._waist))
        self._neck_odom_m = add(self._waist_odom_m, rotate(self._thorax, self._neck))

    @property
    def _joints(self) -> tuple[Quaternion, ...]:
        if self._solved_joints is None:
            left, right = self._gait_pose.feet
            self._solved_joints = self._angles.joints(
                self._trunk,
                self._gait_pose,
                (self._local_foot(left), self._local_foot(right)),
                self._eyes,
                self._activity,
            )
        return self._solved_joints

    def _local_foot(self, foot: FootPose) -> Foot:
        x, y, z, yaw, pitch = foot
        if self._feet_are_local:
            return (x, y, z), yaw, pitch
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        dx, dy = x - self._x_m, y - self._y_m
        ankle = (cos * dx + sin * dy, cos * dy - sin * dx, z)
        return ankle, yaw - self._heading_rad, pitch


@lru_cache(maxsize=64)
def _skinned_keypoints(asset: WorkerAsset) -> SkinnedPoints:
    return SkinnedPoints(asset.joints_m, asset.keypoints_m, asset.keypoint_weights)


def _checked_angle(name: str, value: float, limit_rad: float) -> float:
    """Return a finite angle within ±limit, with a tolerance for rounding errors."""
    angle = finite_number(name, value, SimError)
    if abs(angle) > limit_rad + 1e-9:
        raise SimError(
            f"{name} must lie within ±{limit_rad:.3f} rad (±{math.degrees(limit_rad):.0f}°), "
            f"got {angle:g} rad"
        )
    return angle
