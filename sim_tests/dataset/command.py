"""The command ``awarenav render``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.cli import NUMBER, POSITIVE, OneOf, command, option, options
from awarenav.errors import counted


@command(
    "render",
    examples=[
        "awarenav render --frames 100 --out render",
        "awarenav render --size 1280x720 --fov 90 --people 6 --range 1 12",
    ],
    exit_status={
        0: "Success.",
        2: "Bad input; nothing was written.",
        130: "Interrupted; the images so far are kept.",
    },
    epilog="The same command continues an interrupted set of images, with or without --resume. "
    "Needs the extra 'sim'.",
)
@option("--frames", type=POSITIVE, default=400, metavar="N", help="Number of images.")
@option("--people", type=POSITIVE, default=3, metavar="N", help="Most people in an image.")
@option(
    "--scenes",
    type=POSITIVE,
    show_default="one per 20 images",
    metavar="N",
    help="Number of scenes (a hall with people) that the images are taken in.",
)
@option("--size", default="640x480", metavar="WxH", help="Width and height of an image, pixels.")
@option("--fov", type=NUMBER, default=60.0, metavar="DEG", help="Horizontal field of view.")
@option(
    "--range",
    "range_m",
    type=NUMBER,
    nargs=2,
    default=(1.5, 8.0),
    metavar="MIN MAX",
    help="Distance of people from the camera, m.",
)
@option(
    "--bodies",
    many=True,
    show_default="all",
    metavar="NAME|FILE...",
    help="Bodies of the people: shipped ones, or .npz files.",
)
@option("--layouts", many=True, show_default="all", metavar="NAME...", help="Layouts of the halls.")
@option(
    "--eyes",
    type=OneOf(["wander", "ahead"]),
    default="wander",
    help="Eyes turn in the head (standard deviations 7 and 3.4 degrees), or look straight ahead.",
)
@option(
    "--supersampling",
    type=POSITIVE,
    default=1,
    metavar="N",
    help="Samples per pixel in width and in height; 2 smooths edges.",
)
@options.workers()
@options.out_folder("render")
@options.resume()
@options.overwrite()
@options.seed()
def render(
    out: Path,
    size: str,
    fov: float,
    range_m: tuple[float, float],
    bodies: tuple[str, ...],
    layouts: tuple[str, ...],
    *,
    workers: int | None,
    resume: bool,
    overwrite: bool,
    **settings: Any,
) -> int:
    """Render images of people in randomised warehouses, with the truth about each person.

    Writes the images, camera.yaml (ROS camera_info), truth.jsonl (boxes, keypoints, gaze, position
    and awareness: one line per image) and contact_sheet.png.
    """
    from ._config import RenderConfig, parse_image_size  # noqa: PLC0415 - help needs no simulator
    from ._render import render as render_images  # noqa: PLC0415

    width, height = parse_image_size(size)
    config = RenderConfig.checked(
        width_px=width,
        height_px=height,
        horizontal_fov_deg=fov,
        min_range_m=range_m[0],
        max_range_m=range_m[1],
        workers=list(bodies) or None,
        layouts=list(layouts) or None,
        **settings,
    )
    truth = render_images(config, out, processes=workers, resume=resume, overwrite=overwrite)
    print(
        f"Written to {out}: {counted(config.frames, 'image')}, camera.yaml, {truth.name}, "
        "contact_sheet.png"
    )
    return 0
