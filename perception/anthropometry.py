"""Body sizes: limb lengths for the metric scale, and an anatomical template of the head.

Limb lengths are distances between COCO keypoints of an adult of stature :data:`MEAN_STATURE_M`.
Where two sources define a limb alike, they are averaged: the body-segment fractions of Drillis and
Contini (1966; reprinted in D. A. Winter, *Biomechanics and Motor Control of Human Movement*,
table/figure 4.1), and 27 adult bodies of the parametric model ``anny`` 0.6.2 (its COCO keypoint
definitions; body data of MakeHuman, CC0), measured by
``training/anthropometry.py`` of commit 11d37c7.

=============== ===================== ================ =========
limb            Drillis–Contini / H   anny / H         used / H
=============== ===================== ================ =========
torso           0.288                 0.294            0.291
upper arm       0.186                 0.160            0.173
forearm         0.146                 0.143            0.145
thigh           0.245                 0.233            0.239
shank           0.246                 0.233            0.240
shoulder span   0.259 (0.45 m)        0.191            0.259
hip span        0.191                 0.109            0.150
=============== ===================== ================ =========

The spans depend most on where a labeller puts the joint (over the deltoid or at the joint's
centre). Their relative standard deviation is therefore large, and they count little compared to the
long bones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from . import layouts as kp
from .arrays import FloatArray

#: Stature at which the Drillis–Contini shoulder span is the 0.45 m that the paper names.
MEAN_STATURE_M: Final = 1.74

#: Relative standard deviation of adult stature, women and men together (NCD-RisC 2020: national
#: means of 1.6–1.8 m and standard deviations of 6–7 cm within each sex).
STATURE_RELATIVE_STD: Final = 0.05

#: Probability that a person has not the size of an adult who stands: a child, somebody bent or
#: seated. Then the logarithm of their size is below an adult's by this much on average, with this
#: standard deviation (statures of 1.02 to 1.62 m at one standard deviation). About the adult, the
#: root mean square of the whole mixture is 17.5 % of the range.
UNUSUAL_SIZE_PROBABILITY: Final = 0.2
UNUSUAL_SIZE_LOG_OFFSET: Final = 0.3
UNUSUAL_SIZE_LOG_STD: Final = 0.23


@dataclass(frozen=True, slots=True)
class Limb:
    """A limb between two keypoints, or between the midpoints of two pairs of keypoints.

    Attributes:
        name: name of the limb.
        start: one keypoint, or two whose midpoint is the start.
        end: one keypoint, or two whose midpoint is the end.
        length_m: average length.
        relative_std: relative standard deviation of the length over adults of the same stature,
            including the spread of where labels put its ends.
    """

    name: str
    start: tuple[int, ...]
    end: tuple[int, ...]
    length_m: float
    relative_std: float


def _limb(
    name: str, start: tuple[int, ...], end: tuple[int, ...], fraction: float, relative_std: float
) -> Limb:
    return Limb(name, start, end, fraction * MEAN_STATURE_M, relative_std)


_SHOULDERS = (kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER)
_HIPS = (kp.LEFT_HIP, kp.RIGHT_HIP)

LIMBS: Final[tuple[Limb, ...]] = (
    _limb("torso", _SHOULDERS, _HIPS, 0.291, 0.06),
    _limb("left upper arm", (kp.LEFT_SHOULDER,), (kp.LEFT_ELBOW,), 0.173, 0.10),
    _limb("right upper arm", (kp.RIGHT_SHOULDER,), (kp.RIGHT_ELBOW,), 0.173, 0.10),
    _limb("left forearm", (kp.LEFT_ELBOW,), (kp.LEFT_WRIST,), 0.145, 0.08),
    _limb("right forearm", (kp.RIGHT_ELBOW,), (kp.RIGHT_WRIST,), 0.145, 0.08),
    _limb("left thigh", (kp.LEFT_HIP,), (kp.LEFT_KNEE,), 0.239, 0.06),
    _limb("right thigh", (kp.RIGHT_HIP,), (kp.RIGHT_KNEE,), 0.239, 0.06),
    _limb("left shank", (kp.LEFT_KNEE,), (kp.LEFT_ANKLE,), 0.240, 0.06),
    _limb("right shank", (kp.RIGHT_KNEE,), (kp.RIGHT_ANKLE,), 0.240, 0.06),
    _limb("shoulder span", (kp.LEFT_SHOULDER,), (kp.RIGHT_SHOULDER,), 0.259, 0.20),
    _limb("hip span", (kp.LEFT_HIP,), (kp.RIGHT_HIP,), 0.150, 0.30),
)

#: Keypoints of the head template, in the order of :data:`HEAD_TEMPLATE_M`.
HEAD_KEYPOINTS: Final[tuple[int, ...]] = (
    kp.NOSE,
    kp.LEFT_EYE,
    kp.RIGHT_EYE,
    kp.LEFT_EAR,
    kp.RIGHT_EAR,
)


def _locked(rows: list[list[float]]) -> FloatArray:
    array = np.array(rows)
    array.setflags(write=False)
    return array


#: (5, 3) nose, left eye, right eye, left ear, right ear in the paper's head frame: origin nose,
#: x down, y forward along the Frankfurt horizontal, z to the right ear. Mean of the 27 bodies: the
#: ear midpoint lies 110 mm behind and 12 mm above the nose, the ears 156 mm and the eyes 63 mm
#: apart, the eyes 23 mm behind and 33 mm above the nose.
HEAD_TEMPLATE_M: Final[FloatArray] = _locked(
    [
        [0.000, 0.000, 0.000],
        [-0.033, -0.023, -0.0315],
        [-0.033, -0.023, 0.0315],
        [-0.012, -0.110, -0.078],
        [-0.012, -0.110, 0.078],
    ]
)


#: Width of the head template, ear to ear.
HEAD_WIDTH_M: Final = 0.156

_SIZE_STD: Final = 0.04
_ASYMMETRY_STD_M: Final = 0.0015
# Standard deviations (mm) down, forward and outwards: of eyes and ears together relative to the tip
# of the nose, then of the eyes and of the ears alone.
_FACE_STD_MM, _EYE_STD_MM, _EAR_STD_MM = (3.0, 2.0, 0.0), (1.5, 1.0, 1.3), (3.0, 5.0, 3.0)
_EYES, _EARS, _EYES_AND_EARS = [1, 2], [3, 4], [1, 2, 3, 4]


def _head_shape_factor() -> FloatArray:
    modes = [_SIZE_STD * HEAD_TEMPLATE_M]
    outwards = np.sign(HEAD_TEMPLATE_M[:, 2:])
    for rows, stds in (
        (_EYES_AND_EARS, _FACE_STD_MM), (_EYES, _EYE_STD_MM), (_EARS, _EAR_STD_MM)
    ):  # fmt: skip
        for axis, std_mm in enumerate(stds):
            mode = np.zeros((5, 3))
            mode[rows, axis] = 1e-3 * std_mm
            modes.append(np.where(np.arange(3) == 2, outwards * mode, mode))
    asymmetry = _ASYMMETRY_STD_M * np.eye(15).reshape(15, 5, 3)
    factor = np.moveaxis(np.concatenate([np.array(modes), asymmetry]), 0, 2)
    factor.setflags(write=False)
    return factor


#: (5, 3, M) factor F of the covariance F Fᵀ of adult heads about :data:`HEAD_TEMPLATE_M`, women and
#: men together, with the points flattened to 15 numbers. Independent modes: size (4 %); height and
#: depth of eyes and ears from the nose (3 and 2 mm); of the eyes alone (1.5, 1.0 and 1.3 mm down,
#: forward, outwards) and of the ears alone (3, 5 and 3 mm); each coordinate (1.5 mm, asymmetry and
#: the labels' own spread). In sum bitragion breadth varies by 8 mm, interpupillary distance by
#: 4.5 mm, depth of the ears by 7 mm and protrusion of the nose by 2.7 mm. These are round figures
#: of the size that surveys of head-and-face anthropometry report (Zhuang and Bradtmiller 2005,
#: doi:10.1080/15459620500309855; ANSUR II), not fitted to their tables; heads of the parametric
#: model vary as much.
HEAD_SHAPE_FACTOR_M: Final = _head_shape_factor()

#: (3,) centre of the head in the paper's head frame: between the ears and a little above them.
HEAD_CENTRE_HEAD_M: Final[FloatArray] = np.array([-0.045, -0.090, 0.0])
HEAD_CENTRE_HEAD_M.setflags(write=False)

#: (3,) midpoint of the eyes in the head frame: the apex of the attention cone.
EYES_HEAD_M: Final[FloatArray] = HEAD_TEMPLATE_M[1:3].mean(axis=0)

#: From the shoulder midpoint (neck) up to the nose of an upright adult who looks straight ahead,
#: mean of the same bodies.
NECK_TO_NOSE_UP_M: Final = 0.198

#: Radius of a circle around the body's vertical centre line that contains an adult with arms down:
#: half the 95th-percentile bideltoid breadth of men in the ANSUR II survey (0.56 m), rounded up.
BODY_RADIUS_M: Final = 0.30
