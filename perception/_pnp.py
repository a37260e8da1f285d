"""Head pose from head keypoints by Perspective-n-Point (PnP), as in the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from . import layouts as kp
from ._camera import Camera
from ._pose_refinement import (
    UPRIGHT_STD_RAD,
    HeadPrior,
    RefinedPose,
    body_prior,
    prior_starts,
    refine,
    upright_prior,
)
from ._stages import HeadPose, PersonKeypoints
from .anthropometry import (
    HEAD_KEYPOINTS,
    HEAD_SHAPE_FACTOR_M,
    HEAD_TEMPLATE_M,
)
from .arrays import FloatArray, finite_number
from .body import DEFAULT_MIN_SCORE, BodyPlacement, metric_scales, place_bodies
from .errors import PerceptionError
from .head_frame import lifted_head_model
from .matrices import rotation_exp, rotation_log, skew

HeadModel = Literal["template", "lifted"]

_HEAD_ROWS: Final = np.array(HEAD_KEYPOINTS)

# A seen keypoint should face the camera, an unseen one should face away. Each exception costs as
# much as an error of two standard deviations, since exceptions do occur.
_VISIBILITY_COST: Final = 4.0
# Directions that the five keypoints face in the head frame, and the cosines between them and the
# direction to the camera below which the keypoints are out of sight.
_FACING: Final = np.array(
    [[0.0, 1.0, 0.0], [0.0, 0.87, -0.5], [0.0, 0.87, 0.5], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]
)
_FACE_LIMIT: Final = math.cos(math.radians(95.0))
_EAR_LIMIT: Final = math.cos(math.radians(105.0))
_SIGHT_LIMIT: Final = np.array([_FACE_LIMIT, _FACE_LIMIT, _FACE_LIMIT, _EAR_LIMIT, _EAR_LIMIT])

# A head whose keypoints span less than this many standard deviations carries no direction.
_MIN_SPREAD_STD: Final = 3.0
# χ² that pixel noise of the stated size exceeds in 1 % of poses, by degrees of freedom.
_FIT_QUANTILE: Final = {1: 6.6, 2: 9.2, 3: 11.3, 4: 13.3, 5: 15.1, 6: 16.8}
# A local optimum is ignored if its χ² is larger than the best by more than this.
_MODE_CUTOFF_CHI2: Final = 16.0
# Local optima closer than 8° to each other count as one.
_SAME_MODE_COSINE: Final = math.cos(math.radians(8.0))
_MAX_ROTATION_STD_RAD: Final = math.radians(100.0)
# Relative standard deviation of a range by the size of a face, of heads and of the mesh together.
_FACE_SIZE_STD: Final = 0.07


@dataclass(frozen=True, slots=True, eq=False)
class _Head:
    """The five points of one head and the starting poses.

    Attributes:
        row: row of the person.
        model: (5, 3) points in the head frame.
        rays: (5, 2) measured x/z and y/z.
        seen: (5,) True for seen points.
        rotations: (B, 3, 3) starts.
        translations_m: (B, 3) starts.
        prior: prior from the body, or None.
        tells_range: True if a network of faces has placed the keypoints.
    """

    row: int
    model: FloatArray
    rays: FloatArray
    seen: NDArray[np.bool_]
    rotations: FloatArray
    translations_m: FloatArray
    prior: HeadPrior | None
    tells_range: bool


class PnpHeadPoseEstimator:
    """Head pose estimator of the paper: PnP on the head keypoints of each person.

    With four or more seen head keypoints, SQPnP gives the starts (OpenCV ``SOLVEPNP_SQPNP``) and
    Levenberg–Marquardt refines them. Solutions behind the camera are rejected. If two solutions fit
    equally well, the one wins whose visible side agrees with the keypoints that are seen, and
    without a torso the one that is upright in the camera. A torso that is seen adds a prior; with
    fewer keypoints (a profile, the back of a head) it tells most. Of a skeleton without depth
    (``lifted`` False), one or two keypoints of a face give no pose, and without a torso nose, eye
    and ear of one side give none either.

    Args:
        keypoint_std_px: standard deviation of the keypoint noise that the covariance assumes;
            larger residuals enlarge the covariance.
        min_score: keypoints with a lower score count as not seen.
        head_model: ``"template"`` for the anatomical template, whose forward axis is the Frankfurt
            horizontal, or the points that a network of faces has placed (``face_points_m``);
            ``"lifted"`` for the person's own lifted keypoints in the frame of the
            paper's printed formula (on an upright head a bias of about 36° downwards).

    Raises:
        PerceptionError: for an invalid value.
    """

    def __init__(
        self,
        keypoint_std_px: float = 1.0,
        min_score: float = DEFAULT_MIN_SCORE,
        head_model: HeadModel = "template",
    ) -> None:
        if head_model not in ("template", "lifted"):
            raise PerceptionError(f"head_model must be 'template' or 'lifted', got {head_model!r}")
        self._std_px = finite_number(
            "keypoint_std_px", keypoint_std_px, minimum=0.0, exclusive_minimum=True
        )
        self._min_score = finite_number("min_score", min_score, minimum=0.0, maximum=1.0)
        self._head_model: HeadModel = head_model
        # Heads differ in shape from the template; lifted keypoints are the person's own.
        self._shape_factor_m = None if head_model == "lifted" else HEAD_SHAPE_FACTOR_M

    def estimate(
        self, image_rgb: Any, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return one head pose per person; None if the keypoints do not determine one.

        Args:
            image_rgb: not used; may be None.
            camera: camera of the image.
            people: keypoints of each person.
        """
        poses: list[HeadPose | None] = [None] * len(people)
        bodies = place_bodies(camera, tuple(people), self._std_px, self._min_score)
        found = [
            self._head(camera, person, body, row)
            for row, (person, body) in enumerate(zip(people, bodies, strict=True))
        ]
        heads = [head for head in found if head is not None]
        if heads:
            for head, pose in zip(heads, self._refined(camera, heads), strict=True):
                poses[head.row] = pose
        return tuple(poses)

    def _head(
        self, camera: Camera, person: PersonKeypoints, body: BodyPlacement | None, row: int
    ) -> _Head | None:
        """Return the points and starting poses of a head; None without enough keypoints."""
        scores = person.scores[_HEAD_ROWS]
        seen = scores >= self._min_score
        rows = np.flatnonzero(seen)
        if not len(rows):
            return None
        model = self._model(person, seen)
        if model is None:
            return None
        pixels = person.keypoints_px[_HEAD_ROWS]
        spread = float(np.max(np.ptp(pixels[rows], axis=0))) if len(rows) > 1 else 0.0
        if len(rows) > 1 and spread < _MIN_SPREAD_STD * self._std_px:
            return None
        rays = camera.normalise(pixels, nearest=True)
        whole = len(rows) >= 4
        # The printed formula's frame is pitched: a torso says little of it.
        prior = None if whole and self._head_model == "lifted" else body_prior(body, whole=whole)
        if not person.lifted and not _is_determined(seen, with_torso=prior is not None):
            return None
        if prior is None and len(rows) == 3:
            prior = upright_prior(model[rows], rays[rows])
        starts = []
        if whole or prior is None:
            starts.append(_sqpnp(model[rows], rays[rows], without_body=prior is None))
        if prior is not None:
            starts.append(prior_starts(prior))
        found = [start for start in starts if start is not None]
        if not found:
            return None
        rotations, translations = (np.concatenate(each) for each in zip(*found, strict=True))
        tells_range = whole and person.face_points_m is not None
        return _Head(row, model, rays, seen, rotations, translations, prior, tells_range)

    def _refined(self, camera: Camera, heads: list[_Head]) -> list[HeadPose | None]:
        """Refine the starting poses of several heads at once and return their head poses."""
        counts = [len(head.rotations) for head in heads]
        owner = np.repeat(np.arange(len(heads)), counts)
        poses = refine(
            np.array([head.model for head in heads])[owner],
            np.array([head.rays for head in heads])[owner],
            np.array([camera.fx_px, camera.fy_px]),
            self._std_px,
            np.concatenate([head.rotations for head in heads]),
            np.concatenate([head.translations_m for head in heads]),
            [head.prior for head in heads],
            np.array([head.seen for head in heads], dtype=np.float64)[owner],
            owner,
            self._shape_factor_m,
        )
        results: list[HeadPose | None] = []
        for index, head in enumerate(heads):
            own = [poses[start] for start in np.flatnonzero(owner == index)]
            rows = np.flatnonzero(head.seen)
            costs = _costs(own, head.model[rows], head.seen, without_body=head.prior is None)
            results.append(self._finish(costs, len(rows), head) if costs else None)
        return results

    def _model(self, person: PersonKeypoints, seen: Any) -> FloatArray | None:
        """Return the object points (5, 3) in the head frame; None if they cannot be computed."""
        if self._head_model == "template":
            return HEAD_TEMPLATE_M if person.face_points_m is None else person.face_points_m
        neck_seen = person.scores[[kp.LEFT_SHOULDER, kp.RIGHT_SHOULDER]] >= self._min_score
        (scale,) = metric_scales((person,), self._min_score)
        if scale is None or not (neck_seen.all() and seen[[0, 3, 4]].all()):
            return None
        points = scale.factor * person.keypoints_root_m[kp.BODY]
        neck = 0.5 * (points[kp.LEFT_SHOULDER] + points[kp.RIGHT_SHOULDER])
        try:
            return lifted_head_model(points[list(HEAD_KEYPOINTS)], neck)
        except PerceptionError:
            return None

    def _finish(
        self, costs: list[tuple[float, RefinedPose]], points: int, head: _Head
    ) -> HeadPose | None:
        """Return the best pose with its covariance; None if its rotation is too uncertain."""
        pose = costs[0][1]
        try:
            covariance = np.linalg.inv(pose.information)
        except np.linalg.LinAlgError:
            return None
        squared = pose.fit_chi2
        # Of few points a prior determines what they do not.
        degrees = 2 * points - (0 if head.prior is not None and points < 4 else 6)
        if degrees > 0 and squared > _FIT_QUANTILE[min(degrees, 6)]:
            covariance = covariance * (squared / degrees)
        covariance = 0.5 * (covariance + covariance.T) + _spread_of_modes(costs)
        largest = float(np.linalg.eigvalsh(covariance[:3, :3])[-1])
        if not np.isfinite(covariance).all() or largest > _MAX_ROTATION_STD_RAD**2:
            return None
        return HeadPose(
            pose.translation_m,
            pose.rotation,
            covariance,
            float(np.sqrt(np.sum(pose.reprojection_px**2) / points)),
            range_relative_std=_FACE_SIZE_STD if head.tells_range else None,
        )


def _is_determined(seen: NDArray[np.bool_], *, with_torso: bool) -> bool:
    """Return whether the seen points (5,) of a skeleton without depth determine a head's direction.

    Two points of a face leave open what a flat torso leaves open too, and so do nose, eye and ear
    of one side without a torso: a profile and a face that is half covered have one image. Ears
    alone show no face, wherever it looks.
    """
    pair = bool(seen[1:3].all() or seen[3:].all())
    several = bool(np.count_nonzero(seen) > 2)
    return not bool(seen[:3].any()) or (several and (pair or with_torso))


def _sqpnp(
    points: FloatArray, rays: FloatArray, *, without_body: bool
) -> tuple[FloatArray, FloatArray] | None:
    """Return starting poses: each SQPnP solution in front of the camera, and its mirror images."""
    if len(points) < 3:
        return None
    try:
        _, rotation_vectors, translations, _ = cv2.solvePnPGeneric(
            points.reshape(-1, 1, 3), rays.reshape(-1, 1, 2), np.eye(3), None,
            flags=cv2.SOLVEPNP_SQPNP,
        )  # fmt: skip
    except cv2.error:  # raised on nearly coincident points
        return None
    centre = np.asarray(points.mean(axis=0), dtype=np.float64)
    normal = np.linalg.svd(points - centre)[2][2] if without_body else None
    rotations, origins = [], []
    for vector, translation in zip(rotation_vectors, translations, strict=True):
        origin: FloatArray = np.ravel(translation).astype(np.float64)
        if not (np.isfinite(vector).all() and np.isfinite(origin).all()):
            continue
        if origin[2] <= 0.0:
            continue
        rotation = rotation_exp(np.ravel(vector))
        rotations.append(rotation)
        origins.append(origin)
        ray = rotation @ centre + origin
        ray = ray / np.linalg.norm(ray)
        mirrored = [_turned_gaze(rotation, ray)]
        if normal is not None:
            mirrored.append(_mirrored(rotation, ray, normal))
        for second in mirrored:
            rotations.append(second)
            origins.append(origin + (rotation - second) @ centre)
    if not rotations:
        return None
    return np.array(rotations), np.array(origins)


def _mirrored(rotation: FloatArray, ray: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the second rotation that fits the image of a planar object (Oberkampf et al. 1996).

    The image of a small, distant head is nearly a weak-perspective one. Then points of a plane keep
    their image if they are reflected across the ray. The second reflection, in the plane itself,
    moves none of them and makes a rotation of the first. ``normal`` is that of the plane in the
    head frame: eyes and ears lie in one.
    """
    reflected = rotation - 2.0 * np.outer(ray, ray @ rotation)
    return np.asarray(reflected - 2.0 * np.outer(reflected @ normal, normal))


def _turned_gaze(rotation: FloatArray, ray: FloatArray) -> FloatArray:
    """Return the rotation whose gaze is reflected across the ray, and which keeps the head up."""
    forward = rotation[:, 1]
    # Rotate the gaze to its reflection in the plane across the ray, about their common normal.
    reflected = forward - 2.0 * (forward @ ray) * ray
    axis = skew(forward) @ reflected
    sine = float(np.linalg.norm(axis))
    if sine < 1e-6:
        return rotation_exp(math.pi * rotation[:, 0]) @ rotation
    angle = math.atan2(sine, float(forward @ reflected))
    return np.asarray(rotation_exp(axis / sine * angle) @ rotation)


def _costs(
    poses: list[RefinedPose], points: FloatArray, seen: Any, *, without_body: bool
) -> list[tuple[float, RefinedPose]]:
    """Return the poses in front of the camera with their costs, the lowest cost first.

    The cost is χ² of fit and prior, plus a fixed cost for each keypoint that should be visible and
    was not seen, or the reverse. Without a body, a head that is far from upright costs too.
    """
    costs = []
    for pose in poses:
        depth = points @ pose.rotation[2] + pose.translation_m[2]
        if depth.min() <= 0.0:
            continue
        origin = HEAD_TEMPLATE_M @ pose.rotation.T + pose.translation_m
        to_camera = -origin / np.linalg.norm(origin, axis=1, keepdims=True)
        facing = np.sum((_FACING @ pose.rotation.T) * to_camera, axis=1)
        expected = facing > _SIGHT_LIMIT
        cost = pose.cost + _VISIBILITY_COST * float(np.count_nonzero(expected != seen))
        tilt_rad = math.acos(min(max(pose.rotation[1, 0], -1.0), 1.0))
        # Smaller tilts tell no optimum from another, and starts that end in one differ a little.
        if without_body and tilt_rad > 2.0 * UPRIGHT_STD_RAD:
            cost += (tilt_rad / UPRIGHT_STD_RAD) ** 2
        costs.append((cost, pose))
    return sorted(costs, key=lambda pair: pair[0])


def _spread_of_modes(costs: list[tuple[float, RefinedPose]]) -> FloatArray:
    """Return the second moment (6, 6) about the best pose of other poses that fit nearly as well.

    The weight of a pose is exp(−Δχ²/2). If the image allows two solutions, the covariance includes
    both: an α that may be 0 or 0.8 then has a large standard deviation.
    """
    lowest, best = costs[0]
    modes: list[RefinedPose] = [best]
    spread = np.zeros((6, 6))
    total = 1.0
    for cost, pose in costs[1:]:
        if cost - lowest > _MODE_CUTOFF_CHI2:
            break
        cosines = [0.5 * (np.sum(pose.rotation * mode.rotation) - 1.0) for mode in modes]
        if max(cosines) > _SAME_MODE_COSINE:
            continue
        modes.append(pose)
        turn = rotation_log(pose.rotation @ best.rotation.T)
        difference = np.concatenate([turn, pose.translation_m - best.translation_m])
        weight = math.exp(-0.5 * (cost - lowest))
        spread += weight * np.outer(difference, difference)
        total += weight
    return spread / total
