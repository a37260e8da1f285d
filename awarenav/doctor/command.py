"""The command ``awarenav doctor``."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from ..cli import POSITIVE, FilePath, argument, command, option, options


@command(
    "doctor",
    examples=[
        "awarenav doctor",
        "awarenav doctor 0 --camera camera.yaml",
        "awarenav doctor photographs/",
        "awarenav doctor drive/ --topic /camera/image_raw",
    ],
    exit_status={
        0: "No errors.",
        1: "There are errors; the first of them is the most important.",
        2: "Bad input.",
    },
)
@argument(
    "source",
    required=False,
    help="Images as `awarenav estimate` reads them: a camera's number (0), a stream, a video, a "
    "folder, an image or a ROS recording, which may also hold scans, odometry and tf. Without it "
    "only the installation is examined.",
)
@option(
    "--out",
    type=FilePath(),
    default="doctor.png",
    metavar="FILE.png|none",
    help="A test picture: the image with the most people, and what is estimated about them.",
)
@option("--frames", type=POSITIVE, default=20, metavar="N", help="Number of images to look at.")
@option("--topic", metavar="NAME", help="Image topic of a recording that has several.")
@options.networks
@options.running
@options.calibration
@options.as_json("the findings")
def doctor(**values: Any) -> int:
    """Say what is wrong with the installation and the camera, the most important first.

    Looks at packages and networks; and with SOURCE at what the networks were trained on, the
    calibration, the frame rate reached, exposure, sharpness, and the people found. In the first
    minute of a ROS recording it also looks for blind scanners, for odometry that contradicts tf or
    itself, and for images in a frame that is not optical; and says how hard the robot braked, and
    whether it kept to its curve (brakes_on_curve of a robot file).
    """
    from ._run import doctor_command  # noqa: PLC0415 - help needs no networks

    return doctor_command(SimpleNamespace(**values))
