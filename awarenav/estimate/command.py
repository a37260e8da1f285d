"""The command ``awarenav estimate``."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Final

from ..cli import NUMBER, POSITIVE, SHARE, FilePath, Number, argument, command, option, options

_NETWORKS: Final = "Networks"


@command(
    "estimate",
    examples=[
        "awarenav estimate photo.jpg --overlay drawn.jpg",
        "awarenav estimate video.mp4 --detector yolox-tiny --pose rtmpose-m",
        "awarenav estimate images --depth depth --networks real-movenet_networks.yaml",
        "awarenav estimate 0 --fov-deg 70 --tracks",
    ],
    exit_status={
        0: "Success.",
        1: "Some frames could not be read or estimated; standard error names them.",
        2: "Bad input; nothing was done.",
        130: "Interrupted; the estimates so far are kept.",
    },
)
@argument(
    "source",
    help="An image, a folder of images, a video, the number of a camera (0), the address of a "
    "stream (rtsp://...), or a ROS recording.",
)
@options.out_file("estimates.jsonl", "The results: one JSON line per frame.")
@options.resume()
@options.overwrite()
@option(
    "--overlay",
    default="none",
    metavar="FILE.mp4|DIR|none",
    help="Draw boxes, skeletons, attention cones, awareness and distances into a video or a folder "
    "of images; for a single image, into an image file.",
)
@option("--tracks", is_flag=True, help="Track people from frame to frame.")
@option("--frames", type=POSITIVE, metavar="N", help="Stop after N frames.")
@option("--topic", metavar="NAME", help="Image topic of a recording that has several.")
@option(
    "--fps",
    type=Number(0.01, 1000.0),
    show_default="one image a second",
    metavar="HZ",
    help="Images per second of a folder of frames; speeds and predictions depend on it.",
)
@option(
    "--depth",
    type=FilePath(),
    metavar="PATH",
    help="Depth images that are aligned with the pictures: 16-bit PNG in millimetres, .npy or "
    "TIFF in floating-point metres. A file for one image; a folder with the same stems for a "
    "folder; for a video, a folder of files named by frame number from 0, or with as many "
    "files as frames.",
)
@options.networks
@options.allow_simulator_networks()
@option(
    "--min-score",
    group=_NETWORKS,
    type=SHARE,
    show_default="the detector's own, else 0.25",
    metavar="P",
    help="Drop people whose detection score, from 0 to 1, is below this.",
)
@options.running
@options.calibration
@option(
    "--camera-height-m",
    group=options.CAMERA,
    type=Number(0.0, min_open=True),
    metavar="M",
    help="Height of a fixed camera above a level floor: distances then follow from the feet.",
)
@option(
    "--camera-pitch-deg",
    group=options.CAMERA,
    type=NUMBER,
    default=0.0,
    metavar="DEG",
    help="Angle by which that camera looks down from the horizontal.",
)
def estimate(**values: Any) -> int:
    """Estimate position, gaze and awareness of the people in every frame of SOURCE.

    Writes one JSON line per frame, in the format of the truth that `awarenav render` writes.
    """
    from ._run import estimate_command  # noqa: PLC0415 - help needs no networks

    return estimate_command(SimpleNamespace(**values))
