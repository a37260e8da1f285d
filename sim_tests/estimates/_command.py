"""The commands ``awarenav estimate`` and ``awarenav judge``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from .._arguments import count
from .._errors import SimError
from ._judge import judge_files
from ._judge_config import JudgeConfig
from ._judge_report import markdown_report, requirements

_JUDGE_DEFAULTS = JudgeConfig()


def add_parsers(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add both commands."""
    _add_estimate(commands)
    _add_judge(commands)


def _add_estimate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    estimate = commands.add_parser(
        "estimate",
        help="people in images, video, a camera or a recording: where they are, who has looked",
        description="Estimate the people in every frame and write one JSON line a frame, in the "
        "schema of `awarenav render`'s truth. SOURCE is an image, a folder of images, a video, a "
        "camera's number (0), a stream's address (rtsp://…) or a ROS recording. Ctrl-C keeps what "
        "was done.",
        epilog="Exit status: 0 well, 1 some of the source could not be read or estimated (named on "
        "standard error; the rest is written), 2 bad input and nothing done, 130 interrupted.",
    )
    estimate.add_argument("source", metavar="SOURCE")
    estimate.add_argument(
        "--out",
        type=Path,
        default=Path("estimates.jsonl"),
        metavar="FILE",
        help="the results (default: estimates.jsonl)",
    )
    present = estimate.add_mutually_exclusive_group()
    present.add_argument("--resume", action="store_true", help="continue the file --out")
    present.add_argument("--overwrite", action="store_true", help="replace the file --out")
    estimate.add_argument(
        "--overlay",
        default="none",
        metavar="FILE.mp4|DIR|none",
        help="draw boxes, skeletons, attention cones, α and distances into a video or a folder of "
        "pictures (or, of one image, a picture file)",
    )
    _add_networks(estimate)
    _add_camera(estimate)
    estimate.add_argument(
        "--tracks", action="store_true", help="follow people from frame to frame too"
    )
    estimate.add_argument(
        "--every", type=count, default=1, metavar="N", help="each N-th frame only"
    )
    estimate.add_argument("--frames", type=count, metavar="N", help="at most N frames")
    estimate.add_argument("--topic", metavar="NAME", help="image topic of a recording with several")
    estimate.set_defaults(run=_estimate)


def _add_networks(estimate: argparse.ArgumentParser) -> None:
    networks = estimate.add_argument_group("networks")
    networks.add_argument(
        "--detector",
        default="shipped",
        metavar="FILE",
        help="ONNX person detector: YOLOv8/11, YOLOX, RTMDet and relatives (default: the shipped "
        "one, which is made for the simulator)",
    )
    networks.add_argument(
        "--pose",
        default="shipped",
        metavar="FILE|mediapipe",
        help="ONNX pose network: RTMPose, RTMW, RTMW3D; or MediaPipe, an extra (default: the "
        "shipped one)",
    )
    networks.add_argument(
        "--head",
        default="auto",
        metavar="auto|network|pnp|fused|FILE",
        help="head pose from the shipped head network, from PnP on the keypoints, from both, or "
        "from another ONNX network (default: auto, the network beside the shipped pose network "
        "and PnP beside any other)",
    )
    networks.add_argument(
        "--min-score",
        type=float,
        default=0.25,
        metavar="P",
        help="people detected with less confidence are dropped (default: 0.25)",
    )
    networks.add_argument(
        "--threads", type=count, metavar="N", help="of one network (default: onnxruntime's)"
    )
    networks.add_argument(
        "--provider",
        choices=["cpu", "cuda", "tensorrt"],
        default="cpu",
        help="what runs the networks (default: cpu)",
    )


def _add_camera(estimate: argparse.ArgumentParser) -> None:
    camera = estimate.add_argument_group("camera")
    view = camera.add_mutually_exclusive_group()
    view.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="ROS camera_info YAML (default: camera.yaml beside the images, the recording's "
        "camera_info, else a field of view of 60 degrees is assumed)",
    )
    view.add_argument("--fov-deg", type=float, metavar="DEG", help="horizontal field of view")
    camera.add_argument(
        "--camera-height-m",
        type=float,
        metavar="M",
        help="of a camera that stands still, above a level floor; feet then tell distances",
    )
    camera.add_argument(
        "--camera-pitch-deg",
        type=float,
        default=0.0,
        metavar="DEG",
        help="how far that camera looks down (default: 0)",
    )


def _add_judge(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    judge = commands.add_parser(
        "judge",
        help="how good estimates are against the truth",
        description="Compare estimates with the truth, both JSON Lines as `awarenav render` and "
        "`awarenav estimate` write them, and print a Markdown table: detection (COCO's AP at "
        "IoU 0.5, 101 recalls), gaze, position, awareness, and whether the stated uncertainties "
        "hold; by facing and by range.",
    )
    judge.add_argument("truth", type=Path, metavar="TRUTH.jsonl")
    judge.add_argument("estimates", type=Path, metavar="ESTIMATES.jsonl")
    judge.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the table (.md) or every figure (.json) too",
    )
    judge.add_argument(
        "--min-height-px",
        type=float,
        default=_JUDGE_DEFAULTS.min_height_px,
        metavar="PX",
        help=f"people less tall need not be found (default: {_JUDGE_DEFAULTS.min_height_px:g})",
    )
    judge.add_argument(
        "--max-occlusion",
        type=float,
        default=_JUDGE_DEFAULTS.max_occlusion,
        metavar="SHARE",
        help="nor people hidden to this share or more "
        f"(default: {_JUDGE_DEFAULTS.max_occlusion:g})",
    )
    judge.add_argument(
        "--max-truncation",
        type=float,
        default=_JUDGE_DEFAULTS.max_truncation,
        metavar="SHARE",
        help="nor people outside the picture to this share or more "
        f"(default: {_JUDGE_DEFAULTS.max_truncation:g})",
    )
    judge.add_argument(
        "--common",
        action="store_true",
        help="leave out frames without an estimate (default: nobody was found in them)",
    )
    judge.add_argument(
        "--gate",
        action="store_true",
        help="exit status 1 when a figure is not what the project asks of its own networks",
    )
    judge.set_defaults(run=_judge)


def _estimate(options: argparse.Namespace) -> int:
    from ._estimate_command import estimate_command  # noqa: PLC0415 - help needs no networks

    return estimate_command(options)


def _judge(options: argparse.Namespace) -> int:
    out: Path | None = options.out
    if out is not None and out.suffix not in (".json", ".md"):
        raise SimError(f"--out must end in .json or .md, got {out}")
    config = JudgeConfig.checked(
        min_height_px=options.min_height_px,
        max_occlusion=options.max_occlusion,
        max_truncation=options.max_truncation,
    )
    figures = judge_files(options.truth, options.estimates, config, common=options.common)
    report = markdown_report(figures)
    print(report, end="")
    if out is not None:
        _write(out, report if out.suffix == ".md" else _as_json(figures))
    met = all(each.met for each in requirements(figures))
    return 1 if options.gate and not met else 0


def _as_json(figures: dict[str, Any]) -> str:
    return json.dumps(figures, indent=2, ensure_ascii=False) + "\n"


def _write(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
