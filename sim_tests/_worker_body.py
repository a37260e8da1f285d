"""The worker's body in PyBullet: links, joints, collision shapes and what the camera sees of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from perception.anthropometry import HEAD_TEMPLATE_M, MEAN_STATURE_M

from ._bullet import pybullet
from ._meshes import Mesh, box, ellipsoid, merge, tube
from ._scenery import Colour
from ._skeleton import Skeleton
from ._warehouse import PERSON_GROUP, RAY_GROUP, ROBOT_GROUP, Warehouse

#: Order in which :class:`WorkerBody` takes joint angles.
JOINTS: Final = (
    "neck",
    "nod",
    "left_shoulder",
    "left_elbow",
    "right_shoulder",
    "right_elbow",
    "left_hip",
    "left_knee",
    "left_ankle",
    "right_hip",
    "right_knee",
    "right_ankle",
)
#: Arms hang this far away from the body.
ARM_SPREAD_RAD: Final = 0.10

_UP: Final = (0.0, 0.0, 1.0)
# About −y a positive angle carries what hangs down forwards, and what points forwards up.
_FORWARD_UP: Final = (0.0, -1.0, 0.0)
_LEVEL: Final = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class WorkerColours:
    """Red, green, blue in [0, 1] of what a worker wears."""

    vest: Colour = (0.88, 0.86, 0.10)
    bands: Colour = (0.80, 0.82, 0.84)
    shirt: Colour = (0.20, 0.26, 0.40)
    trousers: Colour = (0.17, 0.20, 0.30)
    shoes: Colour = (0.10, 0.09, 0.09)
    skin: Colour = (0.85, 0.64, 0.52)
    hair: Colour = (0.20, 0.12, 0.07)


@dataclass(slots=True)
class _Link:
    name: str
    parent: str
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] | None = None  # None: fixed
    orientation: tuple[float, float, float, float] = _LEVEL
    mesh: Mesh | None = None
    colour: Colour = (0.0, 0.0, 0.0)
    collision: int = -1


@dataclass(slots=True)
class _Builder:
    """Collects links, then makes them one multibody."""

    warehouse: Warehouse
    links: list[_Link] = field(default_factory=list)

    def capsule(
        self, radius_m: float, length_m: float, center_m: tuple[float, float, float], along: str
    ) -> int:
        """A collision capsule along one axis of its link; ``length_m`` is between the caps."""
        half = math.sqrt(0.5)
        turns = {"x": (0.0, half, 0.0, half), "y": (half, 0.0, 0.0, half), "z": _LEVEL}
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_CAPSULE,
                radius=radius_m,
                height=length_m,
                collisionFramePosition=center_m,
                collisionFrameOrientation=turns[along],
                physicsClientId=self.warehouse.client,
            )
        )

    def build(self, base_collision: int, base_mesh: Mesh, base_colour: Colour) -> int:
        """Make the body; returns PyBullet's id of it."""
        row = {link.name: number + 1 for number, link in enumerate(self.links)}
        row["base"] = 0
        count = len(self.links)
        return int(
            pybullet.createMultiBody(
                baseMass=0.0,
                baseCollisionShapeIndex=base_collision,
                baseVisualShapeIndex=self.warehouse.mesh_shape(base_mesh, base_colour),
                linkMasses=[0.0] * count,
                linkCollisionShapeIndices=[link.collision for link in self.links],
                linkVisualShapeIndices=[
                    -1 if link.mesh is None else self.warehouse.mesh_shape(link.mesh, link.colour)
                    for link in self.links
                ],
                linkPositions=[link.origin_m for link in self.links],
                linkOrientations=[link.orientation for link in self.links],
                linkInertialFramePositions=[(0.0, 0.0, 0.0)] * count,
                linkInertialFrameOrientations=[_LEVEL] * count,
                linkParentIndices=[row[link.parent] for link in self.links],
                linkJointTypes=[
                    pybullet.JOINT_FIXED if link.axis is None else pybullet.JOINT_REVOLUTE
                    for link in self.links
                ],
                linkJointAxis=[link.axis or _UP for link in self.links],
                flags=pybullet.URDF_ENABLE_SLEEPING,
                physicsClientId=self.warehouse.client,
            )
        )


class WorkerBody:
    """One kinematic multibody: it goes where it is put, weighs nothing and is never simulated.

    Its base is the hip midpoint (x forward, y left, z up); the joints are :data:`JOINTS`.

    Attributes:
        body: PyBullet's id of it.
    """

    def __init__(self, warehouse: Warehouse, skeleton: Skeleton, colours: WorkerColours) -> None:
        self._client = warehouse.client
        builder = _Builder(warehouse)
        scale = skeleton.stature_m / MEAN_STATURE_M
        _add_head(builder, skeleton, colours)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            _add_arm(builder, skeleton, colours, side, sign)
            _add_leg(builder, skeleton, colours, side, sign)
        _add_torso_trim(builder, skeleton, colours)
        # Shoulders as one lying capsule, trunk as one upright capsule below them.
        trunk = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_CAPSULE, pybullet.GEOM_CAPSULE],
            radii=[0.10 * scale, 0.15 * scale],
            lengths=[1.4 * skeleton.shoulder_half_span_m, 0.30 * scale],
            collisionFramePositions=[
                (0.0, 0.0, skeleton.torso_m - 0.07 * scale),
                (0.0, 0.0, 0.12 * scale),
            ],
            collisionFrameOrientations=[(math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)), _LEVEL],
            physicsClientId=self._client,
        )
        self.body = builder.build(trunk, _vest(skeleton), colours.vest)
        names = [link.name for link in builder.links]
        self._joints = [names.index(name) for name in JOINTS]
        for joint in self._joints:
            pybullet.setJointMotorControl2(
                self.body,
                joint,
                pybullet.VELOCITY_CONTROL,
                force=0.0,
                physicsClientId=self._client,
            )
        for link in range(-1, len(names)):
            pybullet.setCollisionFilterGroupMask(
                self.body, link, PERSON_GROUP, ROBOT_GROUP | RAY_GROUP, physicsClientId=self._client
            )

    def put(
        self,
        hips_odom_m: tuple[float, float, float],
        heading_odom_rad: float,
        joints_rad: list[float],
    ) -> None:
        """Set the pose; ``joints_rad`` in the order of :data:`JOINTS`."""
        half = 0.5 * heading_odom_rad
        pybullet.resetBasePositionAndOrientation(
            self.body,
            hips_odom_m,
            (0.0, 0.0, math.sin(half), math.cos(half)),
            physicsClientId=self._client,
        )
        pybullet.resetJointStatesMultiDof(
            self.body,
            self._joints,
            [(angle,) for angle in joints_rad],
            physicsClientId=self._client,
        )
        # A sleeping body costs nothing in a step; a robot that touches it wakes it.
        pybullet.changeDynamics(
            self.body,
            -1,
            activationState=pybullet.ACTIVATION_STATE_SLEEP,
            physicsClientId=self._client,
        )


def _vest(skeleton: Skeleton) -> Mesh:
    s, top = skeleton.stature_m / MEAN_STATURE_M, skeleton.torso_m
    return tube(
        [
            (0.0, 0.0, top + 0.055 * s, 0.055 * s, 0.065 * s),
            (0.0, 0.0, top + 0.035 * s, 0.075 * s, 0.13 * s),
            (0.0, 0.0, top - 0.01 * s, 0.10 * s, 0.185 * s),
            (0.0, 0.0, top - 0.13 * s, 0.125 * s, 0.19 * s),
            (0.0, 0.0, 0.17 * s, 0.115 * s, 0.165 * s),
            (0.0, 0.0, 0.02 * s, 0.125 * s, 0.178 * s),
        ],
        sides=16,
    )


def _add_torso_trim(builder: _Builder, skeleton: Skeleton, colours: WorkerColours) -> None:
    s, top = skeleton.stature_m / MEAN_STATURE_M, skeleton.torso_m
    bands = [
        tube([(0.0, 0.0, z + 0.025 * s, rx, ry), (0.0, 0.0, z - 0.025 * s, rx, ry)], sides=16)
        for z, rx, ry in (
            (top - 0.20 * s, 0.127 * s, 0.190 * s),
            (0.13 * s, 0.1225 * s, 0.175 * s),
        )
    ]
    pelvis = tube(
        [
            (0.0, 0.0, 0.03 * s, 0.118 * s, 0.17 * s),
            (0.0, 0.0, -0.04 * s, 0.12 * s, 0.175 * s),
            (0.0, 0.0, -0.12 * s, 0.085 * s, 0.13 * s),
        ],
        sides=16,
    )
    # The front alone has a zip.
    front = box((0.112 * s, 0.0, 0.45 * top), (0.028, 0.014, 0.75 * top))
    builder.links += [
        _Link("bands", "base", mesh=merge(bands), colour=colours.bands),
        _Link("pelvis", "base", mesh=pelvis, colour=colours.trousers),
        _Link("zip", "base", mesh=front, colour=colours.shirt),
    ]


def _add_head(builder: _Builder, skeleton: Skeleton, colours: WorkerColours) -> None:
    """Head and face about the template of the head, so that keypoints lie on its surface."""
    pivot = skeleton.head_pivot_up_m
    # From here on in axes forward, left, up from the nose.
    nose = (skeleton.nose_ahead_m, 0.0, skeleton.nose_up_m - pivot)
    points = HEAD_TEMPLATE_M[:, [1, 2, 0]] * (1.0, -1.0, -1.0)
    crown = skeleton.stature_m - skeleton.neck_height_m - skeleton.nose_up_m

    def at(mesh: Mesh) -> Mesh:
        return mesh.transformed(translation_m=nose)

    skull = ellipsoid((-0.103, 0.0, 0.025), (0.092, 0.075, crown - 0.025), sides=20, rings=14)
    jaw = ellipsoid((-0.078, 0.0, -0.045), (0.058, 0.056, 0.062), sides=16, rings=12)
    nostrils = ellipsoid((-0.016, 0.0, -0.004), (0.017, 0.016, 0.013), sides=10, rings=8)
    bridge = ellipsoid((-0.016, 0.0, 0.015), (0.011, 0.009, 0.026), sides=10, rings=8)
    ears = [
        ellipsoid((x - 0.003, y * 0.985, z), (0.020, 0.008, 0.031), sides=10, rings=8)
        for x, y, z in points[3:5].tolist()
    ]
    hair = [
        ellipsoid((-0.112, 0.0, 0.064), (0.094, 0.083, crown - 0.060), sides=20, rings=12),
        ellipsoid((-0.138, 0.0, 0.020), (0.066, 0.070, 0.085), sides=16, rings=10),
    ]
    eyes, pupils = [], []
    for x, y, z in points[1:3].tolist():
        eyes.append(ellipsoid((x - 0.004, y, z), (0.009, 0.0155, 0.009), sides=12, rings=8))
        pupils.append(ellipsoid((x + 0.0005, y, z), (0.006, 0.007, 0.007), sides=10, rings=8))
    brows = [
        ellipsoid((x + 0.001, y * 0.97, z + 0.019), (0.009, 0.017, 0.0035), sides=10, rings=6)
        for x, y, z in points[1:3].tolist()
    ]
    mouth = ellipsoid((-0.024, 0.0, -0.040), (0.008, 0.023, 0.005), sides=10, rings=6)
    s = skeleton.stature_m / MEAN_STATURE_M
    neck = tube(
        [
            (0.020 * s, 0.0, 0.17 * s, 0.058 * s, 0.055 * s),
            (0.0, 0.0, -0.01, 0.062 * s, 0.066 * s),
        ]
    )
    sphere = pybullet.createCollisionShape(
        pybullet.GEOM_SPHERE,
        radius=0.105,
        collisionFramePosition=(nose[0] - 0.095, 0.0, nose[2] + 0.02),
        physicsClientId=builder.warehouse.client,
    )
    white, dark = (0.95, 0.95, 0.93), (0.07, 0.05, 0.05)
    builder.links += [
        _Link("neck", "base", (0.0, 0.0, skeleton.torso_m), _UP, mesh=neck, colour=colours.skin),
        _Link(
            "nod",
            "neck",
            (0.0, 0.0, pivot),
            _FORWARD_UP,
            mesh=at(merge([skull, jaw, nostrils, bridge, *ears])),
            colour=colours.skin,
            collision=int(sphere),
        ),
        _Link("hair", "nod", mesh=at(merge([*hair, *brows])), colour=colours.hair),
        _Link("eyes", "nod", mesh=at(merge(eyes)), colour=white),
        _Link("pupils", "nod", mesh=at(merge(pupils)), colour=dark),
        _Link("mouth", "nod", mesh=at(mouth), colour=(0.62, 0.30, 0.28)),
    ]


def _limb(length_m: float, top: float, bottom: float) -> Mesh:
    """A tapered limb down its link's −z with rounded ends."""
    shaft = tube([(0.0, 0.0, 0.0, top, top), (0.0, 0.0, -length_m, bottom, bottom)], sides=10)
    caps = [
        ellipsoid((0.0, 0.0, z), (radius, radius, radius), sides=10, rings=6)
        for z, radius in ((0.0, top), (-length_m, bottom))
    ]
    return merge([shaft, *caps])


def _add_arm(
    builder: _Builder, skeleton: Skeleton, colours: WorkerColours, side: str, sign: float
) -> None:
    s = skeleton.stature_m / MEAN_STATURE_M
    upper, fore = skeleton.upper_arm_m, skeleton.forearm_m
    spread = sign * 0.5 * ARM_SPREAD_RAD
    hand = ellipsoid((0.012, 0.0, -fore - 0.07 * s), (0.038 * s, 0.020 * s, 0.085 * s), sides=10)
    builder.links += [
        _Link(
            f"{side}_shoulder",
            "base",
            (0.0, sign * skeleton.shoulder_half_span_m, skeleton.torso_m),
            _FORWARD_UP,
            (math.sin(spread), 0.0, 0.0, math.cos(spread)),
            mesh=_limb(upper, 0.056 * s, 0.045 * s),
            colour=colours.shirt,
            collision=builder.capsule(0.05 * s, upper, (0.0, 0.0, -0.5 * upper), "z"),
        ),
        _Link(
            f"{side}_elbow",
            f"{side}_shoulder",
            (0.0, 0.0, -upper),
            _FORWARD_UP,
            mesh=merge([_limb(fore, 0.043 * s, 0.030 * s), hand]),
            colour=colours.skin,
            collision=builder.capsule(
                0.042 * s, fore + 0.10 * s, (0.0, 0.0, -0.5 * (fore + 0.10 * s)), "z"
            ),
        ),
    ]


def _add_leg(
    builder: _Builder, skeleton: Skeleton, colours: WorkerColours, side: str, sign: float
) -> None:
    s = skeleton.stature_m / MEAN_STATURE_M
    thigh, shank, ankle = skeleton.thigh_m, skeleton.shank_m, skeleton.ankle_height_m
    heel, toe = skeleton.heel_back_m, skeleton.toe_ahead_m
    length = heel + toe
    middle = 0.5 * (toe - heel)
    shoe = merge(
        [
            box((middle, 0.0, 0.012 - ankle), (length, 0.085 * s, 0.024)),
            ellipsoid((middle + 0.01, 0.0, 0.03 - ankle), (0.56 * length, 0.046 * s, 0.040)),
            ellipsoid((-0.01, 0.0, 0.045 - ankle), (0.055 * s, 0.042 * s, 0.065)),
        ]
    )
    builder.links += [
        _Link(
            f"{side}_hip",
            "base",
            (0.0, sign * skeleton.hip_half_span_m, 0.0),
            _FORWARD_UP,
            mesh=_limb(thigh, 0.088 * s, 0.062 * s),
            colour=colours.trousers,
            collision=builder.capsule(0.075 * s, thigh, (0.0, 0.0, -0.5 * thigh), "z"),
        ),
        _Link(
            f"{side}_knee",
            f"{side}_hip",
            (0.0, 0.0, -thigh),
            _FORWARD_UP,
            mesh=_limb(shank, 0.062 * s, 0.050 * s),
            colour=colours.trousers,
            collision=builder.capsule(0.055 * s, shank, (0.0, 0.0, -0.5 * shank), "z"),
        ),
        _Link(
            f"{side}_ankle",
            f"{side}_knee",
            (0.0, 0.0, -shank),
            _FORWARD_UP,
            mesh=shoe,
            colour=colours.shoes,
            collision=builder.capsule(0.045, length - 0.06, (middle, 0.0, 0.045 - ankle), "x"),
        ),
    ]
