"""Uncertainties of head poses and α on renders as real cameras take them.

For everybody found with a head pose: the NEES of the head's forward axis across itself (2 on
average for an exact covariance), the share of errors within the 95 % ellipse, and the share of α
within one σ (68 %). The latter is also counted of active people alone, whose α or true α is above
0.02: errors of 0 say little of σ. The pipeline knows how far the rendered eyes wander.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from perception import (
    AwarenessPipeline,
    Camera,
    HeadPose,
    HeadPoseEstimator,
    PersonKeypoints,
    PnpHeadPoseEstimator,
)
from perception.arrays import FloatArray, ImageRgb
from perception.networks import OnnxModel
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import HEAD

from ._pictures import Condition, chosen_conditions, degraded_pictures, pipeline_of

HeadKind = Literal["network", "pnp"]

#: The group of faces narrower than this, of all undegraded pictures.
SMALL_FACE_PX: Final = 20.0
#: An α above this, estimated or true, is that of an active person.
ACTIVE: Final = 0.02

# χ² of two degrees of freedom that is exceeded in 5 %.
_BOUND_95: Final = 5.991
_FACE_WIDTH_M: Final = 0.15
# Sideways, and up and down, of the rendered eyes (see RenderConfig).
_RENDERED_EYES_STD_RAD: Final = (math.radians(7.0), math.radians(3.4))


class RecordingHeads:
    """A head pose estimator that keeps what another one said of the last picture."""

    def __init__(self, estimator: HeadPoseEstimator) -> None:
        self._estimator = estimator
        self.last: tuple[HeadPose, ...] = ()

    def estimate(
        self, image_rgb: ImageRgb, camera: Camera, people: tuple[PersonKeypoints, ...]
    ) -> tuple[HeadPose | None, ...]:
        """Return the poses of the other estimator."""
        poses = self._estimator.estimate(image_rgb, camera, people)
        self.last = tuple(pose for pose in poses if pose is not None)
        return poses

    def pose_of(self, gaze_camera: FloatArray) -> HeadPose | None:
        """Return the last pose with this forward axis."""
        for pose in self.last:
            if np.allclose(pose.rotation_camera_head[:, 1], gaze_camera, rtol=0.0, atol=1e-9):
                return pose
        return None


@dataclass
class Sureness:
    """Errors of a group of people, in units of their uncertainties.

    Attributes:
        nees: of the head's forward axis, two degrees of freedom.
        sigma_deg: standard deviation of that axis, root of the mean of the two.
        within: whether the error of α is within one σ.
        active: whether α or its truth is above :data:`ACTIVE`.
    """

    nees: list[float] = field(default_factory=list)
    sigma_deg: list[float] = field(default_factory=list)
    within: list[bool] = field(default_factory=list)
    active: list[bool] = field(default_factory=list)

    def row(self, name: str) -> str:
        """Return a row of the table."""
        nees, within, active = np.array(self.nees), np.array(self.within), np.array(self.active)

        def percent(flags: FloatArray) -> str:
            return f"{100.0 * flags.mean():.0f} %" if len(flags) else "–"

        if not len(nees):
            return f"| {name} | 0 | – | – | – | – | – |"
        return " | ".join(
            [
                f"| {name}",
                str(len(nees)),
                f"{np.median(self.sigma_deg):.1f}°",
                f"{nees.mean():.1f}",
                percent(nees < _BOUND_95),
                percent(within),
                f"{percent(within[active])} of {int(active.sum())} |",
            ]
        )


HEADER: Final = (
    "| pictures | heads | σ of the head, median | NEES (2) | within 95 % | α within 1σ "
    "| of active people |\n| --- | --- | --- | --- | --- | --- | --- |"
)


def axis_nees(pose: HeadPose, forward_camera: FloatArray) -> tuple[float, float]:
    """Return the NEES of the forward axis across itself, and its σ in radians.

    A rotation error δ moves the axis by what is across it, so only those two components count.

    Args:
        pose: the estimate.
        forward_camera: (3,) true forward axis of the head.
    """
    axis = pose.rotation_camera_head[:, 1]
    across = pose.rotation_camera_head[:, [0, 2]].T
    covariance = across @ pose.covariance[:3, :3] @ across.T
    turn = np.cross(axis, forward_camera)
    sine = float(np.linalg.norm(turn))
    angle = math.atan2(sine, float(axis @ forward_camera))
    delta = turn * (angle / sine) if sine > 1e-9 else np.zeros(3)
    error = across @ delta
    return (
        float(error @ np.linalg.solve(covariance, error)),
        math.sqrt(0.5 * float(np.trace(covariance))),
    )


def matched(
    truth: FloatArray, found: FloatArray, min_iou: float = 0.5
) -> tuple[tuple[int, int], ...]:
    """Return pairs (truth, found) of boxes (T, 4) and (F, 4): the most, then the best overlaps."""
    low = np.maximum(truth[:, None, :2], found[None, :, :2])
    high = np.minimum(truth[:, None, 2:], found[None, :, 2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=2)
    areas = [np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) for boxes in (truth, found)]
    union = areas[0][:, None] + areas[1][None] - shared
    iou = np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)
    good = iou >= min_iou
    rows, columns = linear_sum_assignment(np.where(good, 10.0 + iou, 0.0), maximize=True)
    return tuple(
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if good[row, column]
    )


def measure(
    conditions: Sequence[Condition],
    frames: int,
    seed: int,
    folder: Path | None = None,
    head: HeadKind = "network",
) -> dict[str, Sureness]:
    """Return the figures of each condition, and of small faces in the undegraded pictures."""
    small = f"faces under {SMALL_FACE_PX:g} px"
    groups = {each.name: Sureness() for each in conditions} | {small: Sureness()}
    pipelines: dict[Camera, tuple[RecordingHeads, AwarenessPipeline]] = {}
    for condition, camera, number, rgb, record in degraded_pictures(conditions, frames, seed):
        if camera not in pipelines:
            heads = RecordingHeads(
                PnpHeadPoseEstimator()
                if head == "pnp"
                else OnnxHeadPoseEstimator(OnnxModel.shipped(HEAD, folder=folder))
            )
            pipeline = pipeline_of(camera, folder, heads, _RENDERED_EYES_STD_RAD)
            pipelines[camera] = heads, pipeline
        heads, pipeline = pipelines[camera]
        observations = [
            o for o in pipeline.process(rgb, float(number)) if o.box_xyxy_px is not None
        ]
        people = record["people"]
        pairs = matched(
            np.array([p["box_xyxy_px"] for p in people], dtype=np.float64).reshape(-1, 4),
            np.array([o.box_xyxy_px for o in observations], dtype=np.float64).reshape(-1, 4),
        )
        for row, column in pairs:
            person, seen = people[row], observations[column]
            pose = None if seen.gaze_camera is None else heads.pose_of(seen.gaze_camera)
            if pose is None or seen.awareness is None or seen.awareness_std is None:
                continue
            nees, sigma = axis_nees(pose, np.array(person["head_forward_camera"]))
            true = float(person["awareness"])
            face_px = camera.fx_px * _FACE_WIDTH_M / float(np.linalg.norm(pose.position_camera_m))
            is_small = face_px < SMALL_FACE_PX and condition.is_plain
            for name in [condition.name, *([small] if is_small else [])]:
                groups[name].nees.append(nees)
                groups[name].sigma_deg.append(math.degrees(sigma))
                groups[name].within.append(abs(seen.awareness - true) <= seen.awareness_std)
                groups[name].active.append(max(seen.awareness, true) > ACTIVE)
    return groups


def run(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Print a row for each condition."""
    wanted = chosen_conditions(parser, chosen.conditions)
    print(HEADER)
    groups = measure(wanted, chosen.frames, chosen.seed, chosen.networks, chosen.head)
    for name, group in groups.items():
        print(group.row(name), flush=True)
