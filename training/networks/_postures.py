"""Random postures: standing, bent, crouching, kneeling and sitting people with any arms.

Angles are of joints, in axes parallel to the body at rest: x forward, y left, z up. A positive turn
about y tips what points up forwards, and what hangs down backwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim_tests.actors.body import JOINTS, MAX_HEAD_PITCH_RAD, MAX_HEAD_YAW_RAD

PostureName = Literal["standing", "bent", "crouching", "kneeling", "sitting"]
#: Names of all postures, and how often each is drawn.
POSTURES: Final[dict[PostureName, float]] = {
    "standing": 0.28,
    "bent": 0.20,
    "crouching": 0.12,
    "kneeling": 0.15,
    "sitting": 0.25,
}
_SIDES: Final = (("left", 1.0), ("right", -1.0))
Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Posture:
    """The rotation of the pelvis and of all joints.

    Attributes:
        name: of the posture.
        pelvis_rotvec: (3,) rotation vector of the pelvis in the heading frame.
        joint_rotvecs: (16, 3) of the joints, as :class:`sim_tests.actors.body.BodyPose` has them.
    """

    name: PostureName
    pelvis_rotvec: NDArray[np.float64]
    joint_rotvecs: NDArray[np.float64]


def random_posture(rng: np.random.Generator, name: PostureName | None = None) -> Posture:
    """Return a random posture, of this name or any."""
    if name is None:
        names = list(POSTURES)
        name = names[int(rng.choice(len(names), p=list(POSTURES.values())))]
    turns: dict[str, Rotation] = {}
    pelvis_deg, spine_deg = _legs_and_trunk(name, rng, turns)
    for side, sign in _SIDES:
        _arm(side, sign, rng, turns)
    twist = rng.normal(0.0, 10.0), rng.normal(0.0, 5.0)
    turns["spine"] = _about(z=twist[0]) * _about(y=spine_deg) * _about(x=twist[1])
    # People who bend lift their heads, but not always.
    lifted = rng.uniform(-0.1, 0.8) * (pelvis_deg + spine_deg)
    yaw = rng.normal(0.0, 28.0) if rng.random() < 0.7 else rng.uniform(-80.0, 80.0)
    yaw_limit, pitch_limit = math.degrees(MAX_HEAD_YAW_RAD), math.degrees(MAX_HEAD_PITCH_RAD)
    pitch = float(np.clip(lifted + rng.normal(-2.0, 11.0), -pitch_limit, pitch_limit))
    turns["neck"] = (
        _about(z=float(np.clip(yaw, -yaw_limit, yaw_limit)))
        * _about(y=-pitch)
        * _about(x=rng.normal(0.0, 7.0))
    )
    eyes = _about(z=float(np.clip(rng.normal(0.0, 7.0), -28.0, 28.0)))
    turns["left_eye"] = turns["right_eye"] = eyes
    rotvecs = np.zeros((len(JOINTS), 3))
    for joint, turn in turns.items():
        rotvecs[JOINTS.index(joint)] = turn.as_rotvec()
    pelvis = _about(y=pelvis_deg) * _about(x=rng.normal(0.0, 2.0))
    return Posture(name, pelvis.as_rotvec(), rotvecs)


def _about(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Rotation:
    """Return the rotation about one axis, in degrees."""
    return Rotation.from_rotvec([x, y, z], degrees=True)


def _legs_and_trunk(
    name: PostureName, rng: np.random.Generator, turns: dict[str, Rotation]
) -> tuple[float, float]:
    """Set the legs; return the forward tilts of the pelvis and of the spine on it, degrees."""
    tilt, spine = rng.normal(0.0, 3.0), rng.normal(2.0, 6.0)
    # Of each leg: forward lift of the thigh, bend of the knee, and toes up, degrees.
    legs: list[Vector]
    if name == "standing":
        stride = rng.normal(0.0, 16.0)
        bends = rng.uniform(0.0, 12.0, 2) + rng.uniform(0.0, 1.2) * abs(stride)
        legs = [(stride, float(bends[0]), 0.0), (-stride, float(bends[1]), 0.0)]
    elif name == "bent":
        bend = rng.uniform(25.0, 95.0)
        share = rng.uniform(0.35, 0.75)
        tilt, spine = share * bend, (1.0 - share) * bend
        knees = rng.uniform(0.0, 40.0)
        legs = [(0.5 * knees + rng.normal(0.0, 6.0), knees, 0.5 * knees) for _ in range(2)]
    elif name == "crouching":
        thigh = rng.uniform(75.0, 120.0)
        tilt, spine = rng.uniform(0.0, 35.0), rng.uniform(0.0, 30.0)
        legs = [
            (thigh + rng.normal(0.0, 6.0), thigh + rng.uniform(15.0, 35.0), 15.0) for _ in range(2)
        ]
    elif name == "kneeling":
        tilt, spine = rng.uniform(-5.0, 30.0), rng.uniform(-5.0, 35.0)
        # The shank lies on the floor, the foot stretched; or the other foot stands on it.
        lift = rng.uniform(-12.0, 25.0)
        down = (lift, 90.0 + lift + rng.uniform(0.0, 6.0), rng.uniform(-88.0, -62.0))
        thigh = rng.uniform(98.0, 112.0)
        other = down if rng.random() < 0.5 else (thigh, thigh, 0.0)
        legs = [down, other] if rng.random() < 0.5 else [other, down]
    else:
        tilt, spine = rng.uniform(-12.0, 12.0), rng.uniform(-12.0, 35.0)
        legs = [
            (rng.uniform(65.0, 100.0), rng.uniform(50.0, 110.0), rng.normal(0.0, 8.0))
            for _ in range(2)
        ]
    spread = rng.uniform(2.0, 10.0) if name in ("standing", "bent") else rng.uniform(3.0, 28.0)
    for (side, sign), (lift, knee, toes) in zip(_SIDES, legs, strict=True):
        out = _about(x=sign * spread) * _about(z=sign * rng.uniform(0.0, 15.0))
        # Thighs are given from the vertical; the pelvis's tilt must not move them.
        turns[f"{side}_hip"] = _about(y=-tilt - lift) * out
        turns[f"{side}_knee"] = _about(y=knee)
        turns[f"{side}_ankle"] = _about(y=-toes)
    return tilt, spine


def _arm(side: str, sign: float, rng: np.random.Generator, turns: dict[str, Rotation]) -> None:
    """Set an arm: hanging, reaching, raised, folded, on the hip, or at the face."""
    kind = rng.random()
    if kind < 0.36:
        forward, apart, bend, inward = rng.normal(4.0, 14.0), 8.0, rng.uniform(0.0, 35.0), 0.0
    elif kind < 0.62:
        forward, apart = rng.uniform(25.0, 100.0), rng.uniform(-5.0, 35.0)
        bend, inward = rng.uniform(0.0, 80.0), rng.uniform(-10.0, 40.0)
    elif kind < 0.72:
        forward, apart = rng.uniform(95.0, 165.0), rng.uniform(0.0, 40.0)
        bend, inward = rng.uniform(0.0, 70.0), rng.uniform(0.0, 30.0)
    elif kind < 0.84:
        forward, apart = rng.uniform(15.0, 35.0), rng.uniform(0.0, 12.0)
        bend, inward = rng.uniform(80.0, 110.0), rng.uniform(40.0, 70.0)
    elif kind < 0.92:
        forward, apart = rng.uniform(-25.0, 5.0), rng.uniform(30.0, 50.0)
        bend, inward = rng.uniform(60.0, 100.0), rng.uniform(50.0, 90.0)
    else:
        forward, apart = rng.uniform(35.0, 75.0), rng.uniform(0.0, 15.0)
        bend, inward = rng.uniform(105.0, 140.0), rng.uniform(0.0, 35.0)
    turns[f"{side}_shoulder"] = (
        _about(x=sign * (apart + rng.normal(0.0, 4.0)))
        * _about(y=-forward)
        * _about(z=-sign * inward)
    )
    turns[f"{side}_elbow"] = _about(y=-bend)
    turns[f"{side}_wrist"] = _about(y=rng.normal(0.0, 15.0)) * _about(x=rng.normal(0.0, 15.0))
