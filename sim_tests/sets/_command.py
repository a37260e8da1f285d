"""The command ``awarenav render``."""

from __future__ import annotations

import argparse
from pathlib import Path

from .._arguments import count

Subparsers = argparse._SubParsersAction  # argparse has no public name for what it returns


def add_parser(commands: Subparsers[argparse.ArgumentParser]) -> None:
    """Add ``render`` to the commands."""
    render = commands.add_parser(
        "render",
        help="pictures of people in warehouses, with the truth about each of them",
        description="Render randomised scenes: frames, camera.yaml (ROS camera_info), truth.jsonl "
        "(boxes, keypoints, gaze, position, awareness; one line a frame) and contact_sheet.png. "
        "Run it again with the same settings to continue after an interruption.",
    )
    add = render.add_argument
    add("--frames", type=int, default=400, metavar="N", help="pictures (default: 400)")
    add("--people", type=int, default=3, metavar="N", help="the most in a picture (default: 3)")
    add(
        "--scenes",
        type=int,
        metavar="N",
        help="halls with a cast that the pictures are spread over (default: one a 20 pictures)",
    )
    add("--size", default="640x480", metavar="WxH", help="pixels (default: 640x480)")
    add("--fov", type=float, default=60.0, metavar="DEG", help="horizontal (default: 60)")
    add(
        "--range",
        type=float,
        nargs=2,
        default=(1.5, 8.0),
        metavar=("MIN", "MAX"),
        help="metres from the camera to people (default: 1.5 8)",
    )
    add("--workers", nargs="+", metavar="NAME", help="who appears: names or .npz (default: all)")
    add("--layouts", nargs="+", metavar="NAME", help="halls (default: all)")
    add(
        "--eyes",
        choices=["wander", "ahead"],
        default="wander",
        help="whether eyes turn in the head, by 7 and 3.4 degrees, or look ahead (default: wander)",
    )
    add(
        "--supersampling",
        type=int,
        default=1,
        metavar="N",
        help="samples a pixel and side; 2 smooths edges (default: 1)",
    )
    add("--processes", type=count, metavar="N", help="at once (default: one a processor)")
    add(
        "--out",
        type=Path,
        default=Path("render"),
        metavar="DIR",
        help="folder for the results (default: render)",
    )
    add("--seed", type=int, default=0, metavar="N", help="of everything random (default: 0)")
    render.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    # The simulator is imported when it is needed, so that help works without it.
    from ._render import render  # noqa: PLC0415
    from ._render_config import RenderConfig, picture_size  # noqa: PLC0415

    width, height = picture_size(options.size)
    config = RenderConfig.checked(
        frames=options.frames,
        people=options.people,
        scenes=options.scenes,
        width_px=width,
        height_px=height,
        horizontal_fov_deg=options.fov,
        min_range_m=options.range[0],
        max_range_m=options.range[1],
        supersampling=options.supersampling,
        seed=options.seed,
        workers=options.workers,
        layouts=options.layouts,
        eyes=options.eyes,
    )
    truth = render(config, options.out, processes=options.processes)
    print(
        f"Written to {options.out}: {config.frames} pictures, camera.yaml, {truth.name}, "
        "contact_sheet.png"
    )
    return 0
