"""Loads the networks that are named on the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from perception import (
    Camera,
    FusedHeadPoseEstimator,
    HeadPoseEstimator,
    OnnxHeadPoseEstimator,
    OnnxPersonDetector,
    OnnxPoseEstimator,
    PersonDetector,
    PnpHeadPoseEstimator,
    PoseEstimator,
)
from perception.networks import MediaPipePoseEstimator, OnnxModel, OnnxSettings
from perception.shipped import (
    DETECTOR,
    shipped_detector,
    shipped_head_pose_estimator,
    shipped_pose_estimator,
    verify_shipped_model,
)

from ..errors import AwarenavError
from ..models import ModelStore
from ._estimator import Networks

#: The name of the networks that come with the package.
SHIPPED: Final = "shipped"
_MEDIAPIPE: Final = "mediapipe"
_HEADS: Final = ("auto", "network", "pnp", "fused")


def choose_networks(
    detector: str = SHIPPED,
    pose: str = SHIPPED,
    head: str = _HEADS[0],
    *,
    min_score: float = 0.25,
    threads: int | None = None,
    provider: str = "cpu",
) -> Networks:
    """Load the networks.

    Args:
        detector: ``"shipped"``, an ONNX file, or the name of a network that
            ``awarenav models fetch`` has downloaded (this holds for the other two as well).
        pose: ``"shipped"``, ``"mediapipe"`` (needs the extra), or an ONNX file.
        head: ``"network"`` (the shipped one), ``"pnp"`` (the paper's method), ``"fused"`` (both,
            weighted by their uncertainties), an ONNX file, or ``"auto"``: the shipped network with
            the shipped pose network, else PnP. The shipped networks are made for the simulator, so
            they are used on real images only on request.
        min_score: people with a lower detection score are dropped.
        threads: of each network; None leaves the number to onnxruntime.
        provider: ``"cpu"``, ``"cuda"`` or ``"tensorrt"``.

    Raises:
        PerceptionError: for a file that is missing, damaged or of an unknown layout.
        AwarenavError: for a word that is neither a valid name nor a file.
    """
    if head == "auto":
        head = "network" if pose == SHIPPED else "pnp"
    settings = OnnxSettings(providers=(provider,), intra_op_threads=threads)
    return Networks(
        _detector(detector, min_score, settings), _pose(pose, settings), _head(head, settings)
    )


def _detector(
    name: str, min_score: float, settings: OnnxSettings
) -> PersonDetector | Callable[[Camera], PersonDetector]:
    if name == SHIPPED:
        verify_shipped_model(DETECTOR)  # now, not at the first frame
        return lambda camera: shipped_detector(settings, camera, score_threshold=min_score)
    model = _onnx_model("--detector", name, (SHIPPED,), settings)
    return OnnxPersonDetector(model, score_threshold=min_score)


def _pose(name: str, settings: OnnxSettings) -> PoseEstimator:
    if name == SHIPPED:
        return shipped_pose_estimator(settings)
    if name == _MEDIAPIPE:
        mediapipe: PoseEstimator = MediaPipePoseEstimator()
        return mediapipe
    return OnnxPoseEstimator(_onnx_model("--pose", name, (SHIPPED, _MEDIAPIPE), settings))


def _head(name: str, settings: OnnxSettings) -> HeadPoseEstimator:
    if name == "pnp":
        return PnpHeadPoseEstimator()
    if name == "network":
        return shipped_head_pose_estimator(settings)
    if name == "fused":
        return FusedHeadPoseEstimator(shipped_head_pose_estimator(settings), PnpHeadPoseEstimator())
    return OnnxHeadPoseEstimator(_onnx_model("--head", name, _HEADS, settings))


def _onnx_model(
    option: str, name: str, names: tuple[str, ...], settings: OnnxSettings
) -> OnnxModel:
    """Load an ONNX file, or a network that ``awarenav models fetch`` has downloaded."""
    if Path(name).is_file():
        return OnnxModel(name, settings=settings)
    store = ModelStore()
    if name in {model.name for model in store.catalogue.models}:
        return store.load(name, settings)
    raise AwarenavError(
        f"{option} must be {', '.join(map(repr, names))}, an ONNX file, or a network that "
        f"'awarenav models list' names; there is no file {name!r}"
    )
