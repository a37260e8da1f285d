"""From names and files on the command line to the networks that do the work."""

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

#: The networks that come with the package.
SHIPPED: Final = "shipped"
MEDIAPIPE: Final = "mediapipe"
HEADS: Final = ("auto", "network", "pnp", "fused")


def choose_networks(
    detector: str = SHIPPED,
    pose: str = SHIPPED,
    head: str = HEADS[0],
    *,
    min_score: float = 0.25,
    threads: int | None = None,
    provider: str = "cpu",
) -> Networks:
    """Load the networks.

    Args:
        detector: ``"shipped"``, an ONNX file that the detector recognises, or the name of a
            network that ``awarenav models fetch`` has brought (as for the other two).
        pose: ``"shipped"``, ``"mediapipe"`` (an optional extra), or an ONNX file.
        head: ``"network"`` (the shipped one), ``"pnp"`` (the paper's), ``"fused"`` (both by their
            uncertainties), ``"auto"`` (the network beside the shipped pose network, else PnP: a
            network made for the simulator looks at no real head unasked), or an ONNX file of a
            head-pose network.
        min_score: people detected with less confidence are dropped.
        threads: of one network; None leaves it to onnxruntime.
        provider: ``"cpu"``, ``"cuda"`` or ``"tensorrt"``.

    Raises:
        PerceptionError: for a file that is absent, damaged or of an unknown layout.
        AwarenavError: for a word that is neither a choice nor a file.
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
        verify_shipped_model(DETECTOR)  # before the first frame, not at it
        return lambda camera: shipped_detector(settings, camera, score_threshold=min_score)
    model = _model("--detector", name, (SHIPPED,), settings)
    return OnnxPersonDetector(model, score_threshold=min_score)


def _pose(name: str, settings: OnnxSettings) -> PoseEstimator:
    if name == SHIPPED:
        return shipped_pose_estimator(settings)
    if name == MEDIAPIPE:
        mediapipe: PoseEstimator = MediaPipePoseEstimator()
        return mediapipe
    return OnnxPoseEstimator(_model("--pose", name, (SHIPPED, MEDIAPIPE), settings))


def _head(name: str, settings: OnnxSettings) -> HeadPoseEstimator:
    if name == "pnp":
        return PnpHeadPoseEstimator()
    if name == "network":
        return shipped_head_pose_estimator(settings)
    if name == "fused":
        return FusedHeadPoseEstimator(shipped_head_pose_estimator(settings), PnpHeadPoseEstimator())
    return OnnxHeadPoseEstimator(_model("--head", name, HEADS, settings))


def _model(option: str, name: str, names: tuple[str, ...], settings: OnnxSettings) -> OnnxModel:
    """A file, or a network that ``awarenav models fetch`` has brought."""
    if Path(name).is_file():
        return OnnxModel(name, settings=settings)
    store = ModelStore()
    if name in {model.name for model in store.catalogue.models}:
        return store.load(name, settings)
    raise AwarenavError(
        f"{option} must be {', '.join(map(repr, names))}, an ONNX file, or a network that "
        f"'awarenav models list' names, and there is no file {name!r}"
    )
