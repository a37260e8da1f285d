"""Options of the networks that see people, and of how they run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ._command import Decorator, option
from ._types import POSITIVE, FilePath, Number, OneOf, Whole

_NETWORKS: Final = "Networks"
_NETWORK_OPTIONS: Final = (
    option(
        "--networks",
        group=_NETWORKS,
        type=FilePath(),
        metavar="FILE",
        help="Detector, pose and head from a file, as `awarenav models fetch robot` writes it.",
    ),
    option(
        "--detector",
        group=_NETWORKS,
        excludes="--networks",
        default="shipped",
        metavar="NAME|FILE",
        help="Person detector: 'shipped' (made for the simulator), a network that `awarenav "
        "models` lists, or an ONNX file (YOLOv8, YOLO11, YOLOX, RTMDet). yolox:FILE, "
        "rtmdet:FILE and ultralytics:FILE say what a file is that does not tell it.",
    ),
    option(
        "--person-class",
        group=_NETWORKS,
        type=Whole(0),
        show_default="the class that the network calls 'person', else 0",
        metavar="N",
        help="Number of the class of a --detector that counts as people, from 0.",
    ),
    option(
        "--input-size",
        group=_NETWORKS,
        show_default="the network's own",
        metavar="WxH",
        help="Width and height, in pixels, of the input of a --detector that leaves them free.",
    ),
    option(
        "--pose",
        group=_NETWORKS,
        excludes="--networks",
        default="shipped",
        metavar="NAME|FILE",
        help="Pose network: 'shipped' (made for the simulator), a network that `awarenav models` "
        "lists, an ONNX file (RTMPose, RTMW, RTMW3D), or 'mediapipe' (needs the extra "
        "'mediapipe').",
    ),
    option(
        "--head",
        group=_NETWORKS,
        excludes="--networks",
        default="auto",
        metavar="NAME|FILE",
        help="Head pose: 'network' (the shipped one, made for the simulator), 'pnp' (from the "
        "keypoints), 'fused' (both), an ONNX file, or 'auto': 'network' with the shipped pose "
        "network, else 'pnp'.",
    ),
    option(
        "--eyes",
        group=_NETWORKS,
        excludes="--networks",
        default="auto",
        metavar="auto|mediapipe|none",
        help="Eyes of people nearer than about 2.5 m: 'mediapipe' (needs the extra 'mediapipe'), "
        "'none' (the gaze is the head's direction), or 'auto': 'mediapipe' with --pose mediapipe.",
    ),
)


def networks(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--networks``, and the options that choose detector, pose, head and eyes."""
    for add in reversed(_NETWORK_OPTIONS):
        function = add(function)
    return function


_RUNNING_OPTIONS: Final = (
    option(
        "--threads",
        group=_NETWORKS,
        type=POSITIVE,
        show_default="onnxruntime's own choice",
        metavar="N",
        help="Threads of each network.",
    ),
    option(
        "--provider",
        group=_NETWORKS,
        type=OneOf(["cpu", "cuda", "tensorrt", "openvino", "coreml"]),
        default="cpu",
        help="Execution provider of onnxruntime that runs the networks.",
    ),
    option(
        "--provider-options",
        group=_NETWORKS,
        default="",
        show_default="none",
        metavar="'KEY=VALUE ...'",
        help="Options of that provider, separated by spaces, as 'trt_fp16_enable=True "
        "trt_engine_cache_enable=True trt_engine_cache_path=DIR'.",
    ),
    option(
        "--detect-every-s",
        group=_NETWORKS,
        type=Number(0.0, 0.2),
        default=0.0,
        metavar="S",
        help="Longest time between two looks of the detector; boxes follow the keypoints in "
        "between. 0 looks at every image.",
    ),
)


def running(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of threads, providers and the time between looks of the detector."""
    for add in reversed(_RUNNING_OPTIONS):
        function = add(function)
    return function


def allow_simulator_networks() -> Decorator:
    """Add ``--allow-simulator-networks``: networks of renders may see other images."""
    return option(
        "--allow-simulator-networks",
        group=_NETWORKS,
        is_flag=True,
        help="Let networks that have seen renders only, such as the shipped ones, see other "
        "images. All results say so.",
    )
