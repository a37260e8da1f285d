"""Options that several commands share: each is named, typed and explained once."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import click
from click.shell_completion import CompletionItem

from ._command import Decorator, option
from ._types import POSITIVE, FilePath, FolderPath, Number, OneOf, Whole

__all__ = [
    "CAMERA",
    "COMPLETE_POLICIES",
    "allow_simulator_networks",
    "as_json",
    "calibration",
    "completion_of",
    "networks",
    "out_file",
    "out_folder",
    "overwrite",
    "plot_file",
    "policy",
    "resume",
    "running",
    "seed",
    "workers",
]


def completion_of(
    package: str, folder: str, *others: str, sets: Sequence[str] = ()
) -> Callable[..., list[CompletionItem]]:
    """Return a completion of the names of a package's YAML files; it does not import the package.

    Files in the folders of ``sets`` count as well. A word that begins none of the names is
    completed as a file.
    """
    folders = [folder, *(f"{folder}/{name}" for name in sets)]

    def complete(
        context: click.Context, parameter: click.Parameter, text: str
    ) -> list[CompletionItem]:
        spec = find_spec(package)
        places = [] if spec is None else list(spec.submodule_search_locations or ())
        names = {
            path.stem
            for place in places
            for each in folders
            for path in Path(place, each).glob("*.yaml")
        }
        fitting = [name for name in sorted(names | set(others)) if name.startswith(text)]
        return [CompletionItem(name) for name in fitting] or [CompletionItem(text, type="file")]

    return complete


#: Completion of policies, for ``shell_complete`` of an option or argument.
COMPLETE_POLICIES: Final = completion_of("nav_adapter", "policies")


def seed(note: str = "", *, default: int | None = 0) -> Decorator:
    """Add ``--seed``: the seed of all random numbers."""
    text = f"Seed of the random numbers.{note}"
    return option("--seed", type=Whole(0), default=default, metavar="N", help=text)


def out_folder(
    default: str | None, help: str = "Folder of the results.", *, show_default: str | None = None
) -> Decorator:
    """Add ``--out``: a folder, which the command makes; it says so of missing ones above it."""
    return option(
        "--out",
        type=FolderPath(),
        default=default,
        callback=_named_parents,
        show_default=show_default,
        metavar="DIR",
        help=help,
    )


def _named_parents(
    context: click.Context, parameter: click.Parameter, out: Path | None
) -> Path | None:
    """Return the folder; say which folders above it are missing, in case of a slip."""
    if out is not None and not context.resilient_parsing and not out.parent.exists():
        print(f"{context.command_path}: makes the new folder {out.parent}, too", file=sys.stderr)
    return out


def out_file(
    default: str | None, help: str, metavar: str = "FILE", *, show_default: str | None = None
) -> Decorator:
    """Add ``--out``: the file of the results."""
    return option(
        "--out",
        type=FilePath(),
        default=default,
        show_default=show_default,
        metavar=metavar,
        help=help,
    )


def plot_file(default: str, help: str) -> Decorator:
    """Add ``--out``: the file of a plot; None for ``none``."""

    def file_or_none(context: click.Context, parameter: click.Parameter, out: Path) -> Path | None:
        return None if str(out) == "none" else out

    return option(
        "--out",
        type=FilePath(),
        default=default,
        metavar="FILE.png|svg|pdf|none",
        callback=file_or_none,
        help=help,
    )


def resume() -> Decorator:
    """Add ``--resume``: continue the work in ``--out``."""
    return option("--resume", is_flag=True, help="Continue the interrupted work in --out.")


def overwrite() -> Decorator:
    """Add ``--overwrite``: replace the work in ``--out``; without it, finished work is refused."""
    return option(
        "--overwrite", is_flag=True, excludes="--resume", help="Replace the work in --out."
    )


def workers(default: int | None = None) -> Decorator:
    """Add ``--workers``: the number of worker processes."""
    return option(
        "--workers",
        type=POSITIVE,
        default=default,
        show_default="one per processor core" if default is None else None,
        metavar="N",
        help="Worker processes.",
    )


def policy() -> Decorator:
    """Add ``--policy``: one policy."""
    return option(
        "--policy",
        default="balanced",
        metavar="NAME|FILE",
        shell_complete=COMPLETE_POLICIES,
        help="Policy: a preset, or a YAML file.",
    )


def as_json(what: str = "the table") -> Decorator:
    """Add ``--json``: print the result as JSON."""
    return option("--json", "as_json", is_flag=True, help=f"Print {what} as JSON.")


_NETWORKS: Final = "Networks"
_BY_PICTURES: Final = "from the set 'real' once fetched; 'shipped' for renders"
_NETWORK_OPTIONS: Final = (
    option(
        "--networks",
        group=_NETWORKS,
        metavar="SET|FILE",
        help="Detector, pose, head and face of a set, such as 'real' (`awarenav models list`), or "
        "of a YAML file with these keys.",
    ),
    option(
        "--detector",
        group=_NETWORKS,
        excludes="--networks",
        show_default=_BY_PICTURES,
        metavar="NAME|FILE",
        help="Person detector: 'shipped' (made for the simulator), a network that `awarenav "
        "models` lists, or an ONNX file (YOLOv8, YOLO11, YOLOX, RTMDet). yolox:FILE, "
        "rtmdet:FILE and ultralytics:FILE name the family of a file that does not reveal it.",
    ),
    option(
        "--person-class",
        group=_NETWORKS,
        type=Whole(0),
        show_default="the class that the network calls 'person', else 0",
        metavar="N",
        help="Number of the --detector's class that counts as people, from 0.",
    ),
    option(
        "--input-size",
        group=_NETWORKS,
        show_default="the network's own",
        metavar="WxH",
        help="Width and height, in pixels, of the input of a --detector that leaves them open.",
    ),
    option(
        "--pose",
        group=_NETWORKS,
        excludes="--networks",
        show_default=_BY_PICTURES,
        metavar="NAME|FILE",
        help="Pose network: 'shipped' (made for the simulator), a network that `awarenav models` "
        "lists, or a file: ONNX (RTMPose, RTMW, RTMW3D, MoveNet), TFLite (BlazePose).",
    ),
    option(
        "--head",
        group=_NETWORKS,
        excludes="--networks",
        show_default="as the set says, else auto",
        metavar="NAME|FILE",
        help="Head pose: 'network' (the shipped one, made for the simulator), 'pnp' (from the "
        "keypoints), an ONNX file, or 'auto': 'network' with the shipped pose network, else 'pnp'.",
    ),
    option(
        "--face",
        group=_NETWORKS,
        excludes="--networks",
        show_default="from the set 'real' once fetched, else 'none'",
        metavar="NAME|FILE",
        help="Face network for any pose network: 'face-mesh' (`awarenav models fetch real`), a "
        "file face_landmarker.task, or 'none'.",
    ),
    option(
        "--small-face",
        group=_NETWORKS,
        excludes="--networks",
        show_default="none",
        metavar="NAME|FILE",
        help="Network that looks again where --face finds none: 'retinaface-mobilenet' (`awarenav "
        "models fetch retinaface-mobilenet`), a file mobilenet0.25_Final.pth, or 'none'.",
    ),
    option(
        "--eyes",
        group=_NETWORKS,
        excludes="--networks",
        show_default="as the set says, else auto",
        metavar="auto|none",
        help="Eyes of people within about 2.5 m: 'auto' (with --face, from its irises), or "
        "'none' (the gaze is the head's direction).",
    ),
)


def networks(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--networks``, and the options that choose detector, pose, head and eyes."""
    for add in reversed(_NETWORK_OPTIONS):
        function = add(function)
    return function


#: Heading of the options of a camera.
CAMERA: Final = "Camera"
_CALIBRATION_OPTIONS: Final = (
    option(
        "--camera",
        group=CAMERA,
        type=FilePath(),
        show_default="camera.yaml beside the images, or camera_info of the recording",
        metavar="FILE",
        help="Calibration (ROS camera_info YAML). Without any, EXIF's focal length counts, or 60 "
        "degrees across the longer side are assumed.",
    ),
    option(
        "--fov-deg",
        group=CAMERA,
        type=Number(1.0, 179.0),
        excludes="--camera",
        metavar="DEG",
        help="Horizontal field of view, instead of a calibration.",
    ),
)


def calibration(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--camera`` and ``--fov-deg``."""
    for add in reversed(_CALIBRATION_OPTIONS):
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
        help="Options of that provider, separated by spaces, such as 'trt_fp16_enable=True "
        "trt_engine_cache_enable=True trt_engine_cache_path=DIR'.",
    ),
    option(
        "--detect-every-s",
        group=_NETWORKS,
        type=Number(0.0, 0.2),
        default=0.0,
        metavar="S",
        help="Longest time between two runs of the detector; boxes follow the keypoints in "
        "between. 0 runs it on every image.",
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
        help="Allow networks that have only seen renders, such as the shipped ones, on other "
        "images. All results then say so.",
    )
