"""The command ``awarenav render``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, OneOf, command, option, options


@command("render")
@option("--frames", type=int, default=400, metavar="N", help="Images.")
@option("--people", type=int, default=3, metavar="N", help="The most people in an image.")
@option(
    "--scenes",
    type=int,
    metavar="N",
    help="Halls with a cast that the images are spread over (default: one for each 20 images).",
)
@option("--size", default="640x480", metavar="WxH", help="Pixels.")
@option("--fov", type=float, default=60.0, metavar="DEG", help="Horizontal field of view.")
@option(
    "--range",
    "range_m",
    type=float,
    nargs=2,
    default=(1.5, 8.0),
    metavar="MIN MAX",
    help="Distance of people from the camera, metres.",
)
@option(
    "--workers",
    many=True,
    metavar="NAME...",
    help="Who appears: names or .npz files (default: all).",
)
@option("--layouts", many=True, metavar="NAME...", help="Halls (default: all).")
@option(
    "--eyes",
    type=OneOf(["wander", "ahead"]),
    default="wander",
    help="Whether eyes turn in the head (standard deviations 7 and 3.4 degrees) or look ahead.",
)
@option(
    "--supersampling",
    type=int,
    default=1,
    metavar="N",
    help="Samples for each pixel and side; 2 smooths edges.",
)
@option(
    "--processes",
    type=POSITIVE,
    metavar="N",
    help="Worker processes (default: one for each core).",
)
@options.out_folder("render")
@options.seed()
def render(**values: Any) -> int:
    """Render pictures of people in randomised warehouses, with the truth about each person.

    Writes frames, camera.yaml (ROS camera_info), truth.jsonl (boxes, keypoints, gaze, position,
    awareness; one line for each frame) and contact_sheet.png. The same command continues an
    interrupted set.
    """
    from ._run import RenderOptions, render_command  # noqa: PLC0415 - help needs no simulator

    return render_command(RenderOptions(**values))
