"""The command ``awarenav estimate``."""

from __future__ import annotations

from typing import Any, Final

from ..cli import POSITIVE, SHARE, FilePath, OneOf, argument, command, option, options

_NETWORKS: Final = "Networks"
_CAMERA: Final = "Camera"


@command(
    "estimate",
    epilog="Exit status: 0 success; 1 some frames could not be read or estimated (they are named "
    "on standard error, the others are written); 2 bad input, nothing done; 130 interrupted.",
)
@argument(
    "source",
    help="An image, a folder of images, a video, a camera's number (0), a stream's address "
    "(rtsp://...), or a ROS recording.",
)
@options.out_file("estimates.jsonl", "The results, one JSON line for each frame.")
@options.resume()
@option("--overwrite", is_flag=True, excludes="--resume", help="Replace the file --out.")
@option(
    "--overlay",
    default="none",
    metavar="FILE.mp4|DIR|none",
    help="Draw boxes, skeletons, attention cones, awareness and distances into a video or a folder "
    "of images (for a single image: into an image file).",
)
@option("--tracks", is_flag=True, help="Track people from frame to frame.")
@option("--every", type=POSITIVE, default=1, metavar="N", help="Use every N-th frame only.")
@option("--frames", type=POSITIVE, metavar="N", help="Stop after N frames.")
@option("--topic", metavar="NAME", help="Image topic, for a recording with several.")
@option(
    "--detector",
    group=_NETWORKS,
    default="shipped",
    metavar="NAME|FILE",
    help="ONNX person detector: YOLOv8/11, YOLOX, RTMDet and relatives. The shipped one is made "
    "for the simulator.",
)
@option(
    "--pose",
    group=_NETWORKS,
    default="shipped",
    metavar="NAME|FILE|mediapipe",
    help="ONNX pose network: RTMPose, RTMW, RTMW3D; or MediaPipe (an extra). The shipped one is "
    "made for the simulator.",
)
@option(
    "--head",
    group=_NETWORKS,
    default="auto",
    metavar="auto|network|pnp|fused|FILE",
    help="Head pose from the shipped head network, from PnP on the keypoints, from both, or from "
    "another ONNX network. 'auto' is the network beside the shipped pose network, and PnP beside "
    "any other.",
)
@option(
    "--min-score",
    group=_NETWORKS,
    type=SHARE,
    default=0.25,
    metavar="P",
    help="Drop people detected with less confidence.",
)
@option(
    "--threads",
    group=_NETWORKS,
    type=POSITIVE,
    metavar="N",
    help="Threads of each network (default: onnxruntime's).",
)
@option(
    "--provider",
    group=_NETWORKS,
    type=OneOf(["cpu", "cuda", "tensorrt"]),
    default="cpu",
    help="What runs the networks.",
)
@option(
    "--camera",
    group=_CAMERA,
    type=FilePath(),
    metavar="FILE",
    help="ROS camera_info YAML (default: camera.yaml beside the images, or the recording's "
    "camera_info; without either, a field of view of 60 degrees is assumed).",
)
@option(
    "--fov-deg",
    group=_CAMERA,
    type=float,
    excludes="--camera",
    metavar="DEG",
    help="Horizontal field of view instead.",
)
@option(
    "--camera-height-m",
    group=_CAMERA,
    type=float,
    metavar="M",
    help="Height of a fixed camera above a level floor; feet then tell distances.",
)
@option(
    "--camera-pitch-deg",
    group=_CAMERA,
    type=float,
    default=0.0,
    metavar="DEG",
    help="How far that camera looks down.",
)
def estimate(**values: Any) -> int:
    """Estimate position, gaze and awareness of the people in every frame of SOURCE.

    Writes one JSON line for each frame, in the schema of the truth that `awarenav render` writes.
    Ctrl-C keeps what is done.
    """
    from ._run import EstimateOptions, estimate_command  # noqa: PLC0415 - help needs no networks

    return estimate_command(EstimateOptions(**values))
