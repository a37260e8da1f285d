"""Least-squares refinement of head poses from many starts at once, with priors from the torso.

The points of a head deviate from the template, each head by its own shape. Their errors in the
image are therefore correlated, and depend on the pose. A first pass finds the pose with pixel noise
alone; a second one weights the residuals with the inverse covariance of noise and shape together
(generalised least squares).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .anthropometry import HEAD_CENTRE_HEAD_M
from .arrays import FloatArray
from .body import BodyPlacement
from .matrices import rotation_exp, rotation_log, skew

# The joint of head and neck lies below and between the ears.
_PIVOT_HEAD_M: Final = np.array([0.035, -0.100, 0.0])
# From the shoulder midpoint to that joint, in the torso frame (forward, left, up). With it, the
# nose of a head that looks straight ahead lies where anthropometry says.
_NECK_TO_PIVOT_M: Final = np.array([0.046, 0.0, 0.168])
# Standard deviations of the head's rotation relative to the torso.
_YAW_STD_RAD, _ROLL_STD_RAD, _PITCH_STD_RAD = map(math.radians, (60.0, 15.0, 25.0))
_PIVOT_STD_M: Final = 0.04
#: A head without a body is upright in the camera within this standard deviation.
UPRIGHT_STD_RAD: Final = math.radians(30.0)
# It may look anywhere.
_UNKNOWN_YAW_STD_RAD: Final = math.radians(150.0)
_DOWN_CAMERA: Final = np.array([0.0, 1.0, 0.0])
# Relative standard deviation of the body's range where the head has a range of its own.
_LOOSE_SCALE_STD: Final = 0.25
_YAW_STARTS_RAD: Final = np.radians([0.0, 50.0, -50.0, 100.0, -100.0, 180.0])


@dataclass(frozen=True, slots=True, eq=False)
class HeadPrior:
    """Prior of a head's pose from the body: weak, but enough where few head points are seen.

    Attributes:
        rotation_camera_head: (3, 3) rotation of a head that looks straight ahead of the torso.
        rotation_information: (3, 3) inverse covariance of the head's rotation relative to that, as
            a rotation vector in head axes (x yaw, y roll, z pitch).
        pivot_head_m: (3,) joint of head and neck in the head frame.
        pivot_camera_m: (3,) position of that joint according to the body.
        position_information: (3, 3) inverse covariance of that position, camera frame.
    """

    rotation_camera_head: FloatArray
    rotation_information: FloatArray
    pivot_head_m: FloatArray
    pivot_camera_m: FloatArray
    position_information: FloatArray


def body_prior(body: BodyPlacement | None, *, whole: bool) -> HeadPrior | None:
    """Return the prior of the head's pose from the torso; None if too little of it is seen.

    ``whole`` is True for a head that shows enough keypoints to tell its own range.
    """
    if body is None:
        return None
    torso = _torso_axes(body)
    if torso is None:
        return None
    rotation_camera_torso, neck = torso
    forward, left, up = rotation_camera_torso.T
    pivot = neck + rotation_camera_torso @ _NECK_TO_PIVOT_M
    ray = pivot / np.linalg.norm(pivot)
    relative = max(body.scale_relative_std, _LOOSE_SCALE_STD if whole else 0.0)
    along = (relative * np.linalg.norm(pivot)) ** 2 + _PIVOT_STD_M**2
    covariance = _PIVOT_STD_M**2 * (np.eye(3) - np.outer(ray, ray)) + along * np.outer(ray, ray)
    stds = np.array([_YAW_STD_RAD, _ROLL_STD_RAD, _PITCH_STD_RAD])
    return HeadPrior(
        np.stack([-up, forward, -left], axis=1),
        np.diag(1.0 / stds**2),
        _PIVOT_HEAD_M,
        pivot,
        np.linalg.inv(covariance),
    )


def upright_prior(points: FloatArray, rays: FloatArray) -> HeadPrior:
    """Return the prior of a head without a body: upright, at about the range of its size."""
    span = float(np.linalg.norm(rays - rays.mean(axis=0), axis=1).max())
    size_m = float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
    # Foreshortening makes a head look smaller: the range is the largest one possible.
    pivot = np.append(rays.mean(axis=0), 1.0) * (0.8 * size_m / max(span, 1e-6))
    ray = pivot / np.linalg.norm(pivot)
    right = skew(_DOWN_CAMERA) @ -ray
    right = right / np.linalg.norm(right)
    down = skew(-ray) @ right
    across, along = _PIVOT_STD_M + 0.1, 0.5 * float(np.linalg.norm(pivot))
    covariance = across**2 * (np.eye(3) - np.outer(ray, ray)) + along**2 * np.outer(ray, ray)
    stds = np.array([_UNKNOWN_YAW_STD_RAD, UPRIGHT_STD_RAD, UPRIGHT_STD_RAD])
    return HeadPrior(
        np.stack([down, -ray, right], axis=1),
        np.diag(1.0 / stds**2),
        HEAD_CENTRE_HEAD_M,
        pivot,
        np.asarray(np.linalg.inv(covariance), dtype=np.float64),
    )


def _torso_axes(body: BodyPlacement) -> tuple[FloatArray, FloatArray] | None:
    """Return forward, left, up as columns (3, 3) and the neck (3,), in the camera frame."""
    shoulders = body.shoulders_camera_m
    if shoulders is None:
        return None
    neck = shoulders.mean(axis=0)
    up, left = neck - body.hips_camera_m, shoulders[0] - shoulders[1]
    forward = skew(left) @ up
    length = float(np.linalg.norm(forward))
    if length < 1e-6:
        return None
    forward = forward / length
    up = up / np.linalg.norm(up)
    return np.stack([forward, skew(up) @ forward, up], axis=1), neck


def prior_starts(prior: HeadPrior) -> tuple[FloatArray, FloatArray]:
    """Return starting poses with several yaw angles about the joint of the prior."""
    down = prior.rotation_camera_head[:, 0]
    rotations = rotation_exp(_YAW_STARTS_RAD[:, None] * down) @ prior.rotation_camera_head
    return rotations, prior.pivot_camera_m - rotations @ prior.pivot_head_m


_ITERATIONS: Final = 8
# The second pass starts at the optimum of the first.
_SHAPE_ITERATIONS: Final = 4
# A head is converged when no step promises to lower χ² by more; noise changes χ² by about 1.
_CONVERGED_CHI2: Final = 1e-2
_MIN_DEPTH_M: Final = 0.05
_EYE: Final = np.eye(3)
_EYE_2: Final = np.eye(2)
_EYE_6: Final = np.eye(6)


@dataclass(frozen=True, slots=True, eq=False)
class _Priors:
    """Priors of B starts; arrays as in :class:`HeadPrior` with B in front.

    ``rotation_information`` is in camera axes here. ``rows`` are the rows of these starts among
    all starts.
    """

    rows: slice | NDArray[np.int64]
    rotation_camera_head: FloatArray
    rotation_information: FloatArray
    pivot_head_m: FloatArray
    pivot_camera_m: FloatArray
    position_information: FloatArray

    @classmethod
    def of(cls, priors: Sequence[HeadPrior | None], owner: NDArray[np.int64]) -> _Priors | None:
        """Return the priors of starts that belong to the heads ``owner``; None without priors."""
        known = [prior for prior in priors if prior is not None]
        if not known:
            return None
        rows: slice | NDArray[np.int64] = slice(None)
        if len(known) < len(priors):
            has = np.array([prior is not None for prior in priors])
            rows = np.flatnonzero(has[owner])
            owner = (np.cumsum(has) - 1)[owner[rows]]
        axes = np.array([prior.rotation_camera_head for prior in known])
        information = np.array([prior.rotation_information for prior in known])
        return cls(
            rows,
            axes[owner],
            (axes @ information @ np.swapaxes(axes, 1, 2))[owner],
            np.array([prior.pivot_head_m for prior in known])[owner],
            np.array([prior.pivot_camera_m for prior in known])[owner],
            np.array([prior.position_information for prior in known])[owner],
        )


@dataclass(frozen=True, slots=True, eq=False)
class RefinedPose:
    """A local optimum of a head's pose.

    Attributes:
        rotation: (3, 3) from the head frame to the camera frame.
        translation_m: (3,) head origin in the camera frame.
        information: (6, 6) inverse covariance, order rotation vector, translation.
        cost: sum of squared normalised residuals, priors included.
        fit_chi2: sum of squared normalised residuals of the points.
        reprojection_px: (N,) pixel error of each point.
    """

    rotation: FloatArray
    translation_m: FloatArray
    information: FloatArray
    cost: float
    fit_chi2: float
    reprojection_px: FloatArray


_State = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def _linearise(
    model: FloatArray,
    rays: FloatArray,
    weight_px: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    prior: _Priors | None,
    whitening: FloatArray | None,
) -> _State:
    """Return cost (B,), gradient (B, 6), information (B, 6, 6) and pixel residuals (B, N, 2).

    The state is a rotation in camera axes, applied from the left, then the translation.
    """
    turned = model @ rotation.swapaxes(1, 2)
    points = turned + translation[:, None]
    nearest = points[..., 2]
    depth = np.maximum(nearest, _MIN_DEPTH_M)
    deep = depth[..., None]
    image = points[..., :2] / deep
    residual = (image - rays) * weight_px
    jacobian = np.empty((*depth.shape, 2, 6))
    slope = jacobian[..., 3:]
    slope[..., :2] = _EYE_2 / deep[..., None]
    np.divide(image, -deep, out=slope[..., 2])
    slope *= weight_px[..., None]
    np.matmul(slope, skew(-turned), out=jacobian[..., :3])
    flat = jacobian.reshape(len(rotation), -1, 6)
    flat_residual = residual.reshape(len(rotation), -1)
    if whitening is not None:
        flat = whitening @ flat
        flat_residual = (whitening @ flat_residual[..., None])[..., 0]
    information = flat.swapaxes(1, 2) @ flat
    gradient = np.einsum("bki,bk->bi", flat, flat_residual)
    cost = np.add.reduce(flat_residual * flat_residual, axis=1)
    # The penalty keeps a point behind the camera from being a good fit.
    if np.minimum.reduce(nearest, axis=None) < _MIN_DEPTH_M:
        behind = np.maximum(_MIN_DEPTH_M - nearest, 0.0)
        cost += 1e6 * np.add.reduce(behind * (weight_px[..., 0] > 0.0), axis=1)
    if prior is not None:
        rows = prior.rows
        rotation, translation = rotation[rows], translation[rows]
        away = rotation_log(rotation.swapaxes(1, 2) @ prior.rotation_camera_head)
        # In camera axes, R log(Rᵀ R0) is the rotation that takes the head to the prior.
        away = -np.einsum("bij,bj->bi", rotation, away)
        rotation_information = prior.rotation_information
        pivot = np.einsum("bij,bj->bi", rotation, prior.pivot_head_m)
        offset = pivot + translation - prior.pivot_camera_m
        motion = np.empty((len(pivot), 3, 6))
        motion[..., :3] = skew(-pivot)
        motion[..., 3:] = _EYE
        weighted = prior.position_information @ motion
        own_information = information[rows] + motion.swapaxes(1, 2) @ weighted
        own_information[:, :3, :3] += rotation_information
        information[rows] = own_information
        own_gradient = gradient[rows] + np.einsum("bji,bj->bi", weighted, offset)
        turning = np.einsum("bij,bj->bi", rotation_information, away)
        own_gradient[:, :3] += turning
        gradient[rows] = own_gradient
        shifting = np.einsum("bij,bj->bi", prior.position_information, offset)
        own_cost = cost[rows] + np.einsum("bi,bi->b", away, turning)
        cost[rows] = own_cost + np.einsum("bi,bi->b", offset, shifting)
    return cost, gradient, information, residual


def refine(
    model_m: FloatArray,
    rays: FloatArray,
    focal_px: FloatArray,
    keypoint_std_px: float,
    rotations: FloatArray,
    translations_m: FloatArray,
    priors: Sequence[HeadPrior | None],
    seen: FloatArray,
    owner: NDArray[np.int64],
    shape_factor_m: FloatArray | None,
) -> list[RefinedPose]:
    """Refine B starting poses at once, of one or several heads, by Levenberg–Marquardt.

    A head stops when none of its starts promises a better fit, so its result does not depend on the
    other heads.

    Args:
        model_m: (B, N, 3) points of each start in the head frame.
        rays: (B, N, 2) measured x/z and y/z of the points.
        focal_px: (2,) fx and fy.
        keypoint_std_px: standard deviation of the pixel noise.
        rotations: (B, 3, 3) starts.
        translations_m: (B, 3) starts.
        priors: prior of each head, or None for a head without one.
        seen: (B, N) 1 for points that count, 0 for others.
        owner: (B,) head of each start, with the starts of a head in consecutive rows.
        shape_factor_m: (N, 3, M) factor F of the covariance F Fᵀ of the points (flattened to 3 N)
            over heads, in the head frame; None for points that are known exactly.

    Returns:
        One local optimum per start, in the same order.
    """
    weight = seen[..., None] * (focal_px / keypoint_std_px)
    count = len(rotations)
    prior = _Priors.of(priors, owner)
    problem = _Problem(model_m, rays, weight, prior, owner)
    rotation, translation, state = _descend(problem, rotations, translations_m, None, _ITERATIONS)
    fit = state[3].reshape(count, -1)
    if shape_factor_m is not None:
        whitening = _whitening(problem, rotation, translation, shape_factor_m)
        rotation, translation, state = _descend(
            problem, rotation, translation, whitening, _SHAPE_ITERATIONS
        )
        fit = (whitening @ state[3].reshape(count, -1, 1))[..., 0]
    cost, _, information, residual = state
    chi2 = np.einsum("bk,bk->b", fit, fit)
    error_px = keypoint_std_px * np.sqrt(np.einsum("bni,bni->bn", residual, residual))
    return [
        RefinedPose(
            rotation[index],
            translation[index],
            information[index],
            float(cost[index]),
            float(chi2[index]),
            error_px[index],
        )
        for index in range(count)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The measurements of B starts; arrays as in :func:`refine`, ``weight_px`` (B, N, 2)."""

    model: FloatArray
    rays: FloatArray
    weight_px: FloatArray
    prior: _Priors | None
    owner: NDArray[np.int64]


def _descend(
    problem: _Problem,
    rotation: FloatArray,
    translation: FloatArray,
    whitening: FloatArray | None,
    iterations: int,
) -> tuple[FloatArray, FloatArray, _State]:
    """Return rotations, translations and states after some steps of Levenberg–Marquardt."""

    def linearise(rotation: FloatArray, translation: FloatArray) -> _State:
        return _linearise(
            problem.model, problem.rays, problem.weight_px, rotation, translation,
            problem.prior, whitening,
        )  # fmt: skip

    count, owner = len(rotation), problem.owner
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    active = np.ones(count, dtype=np.bool_)
    damping: FloatArray = np.full(count, 1e-3)
    state = linearise(rotation, translation)
    for _ in range(iterations):
        cost, gradient, information, _ = state
        scale = information.reshape(count, 36)[:, ::7]  # the diagonals
        damped = information + (damping[:, None] * scale + 1e-9)[..., None] * _EYE_6
        step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
        # The decrease of χ² that the local model still promises.
        promise = np.maximum.reduceat(-np.add.reduce(gradient * step, axis=1), first)
        active &= (promise >= _CONVERGED_CHI2)[owner]
        if not np.logical_or.reduce(active):
            break
        turn = step[:, :3]
        length = np.sqrt(np.einsum("bi,bi->b", turn, turn))[:, None]
        turn = turn * np.minimum(1.0, 0.7 / np.maximum(length, 1e-12))
        trial_rotation = rotation_exp(turn) @ rotation
        trial_translation = translation + step[:, 3:]
        trial = linearise(trial_rotation, trial_translation)
        better = active & (trial[0] < cost)
        damping = damping * np.where(better, 0.2, 10.0)
        if np.logical_and.reduce(better):
            rotation, translation, state = trial_rotation, trial_translation, trial
        elif np.logical_or.reduce(better):
            one = better[:, None]
            rotation = np.where(one[..., None], trial_rotation, rotation)
            translation = np.where(one, trial_translation, translation)
            state = (
                np.where(better, trial[0], cost),
                np.where(one, trial[1], gradient),
                np.where(one[..., None], trial[2], information),
                np.where(one[..., None], trial[3], state[3]),
            )
    return rotation, translation, state


def _whitening(
    problem: _Problem, rotation: FloatArray, translation: FloatArray, factor: FloatArray
) -> FloatArray:
    """Return W (B, 2 N, 2 N) with W C Wᵀ = 1 for the covariance C of the residuals.

    C = 1 + G Gᵀ, in units of the pixel noise. G is the factor of the points' covariance, projected
    into the image at each pose.
    """
    points = problem.model @ rotation.swapaxes(1, 2) + translation[:, None]
    depth = np.maximum(points[..., 2], _MIN_DEPTH_M)[..., None]
    slope = np.empty((*points.shape[:2], 2, 3))
    slope[..., :2] = _EYE_2 / depth[..., None]
    slope[..., 2] = -points[..., :2] / depth**2
    slope *= problem.weight_px[..., None]
    shape = slope @ rotation[:, None] @ factor
    shape = shape.reshape(len(rotation), -1, factor.shape[-1])
    covariance = shape @ shape.swapaxes(1, 2) + np.eye(shape.shape[1])
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
