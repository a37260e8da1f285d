"""Options that several commands share: each is named, typed and explained once."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from ._command import Decorator, option
from ._types import POSITIVE, FilePath, FolderPath, Number, OneOf, Whole, WordAndNumbers

__all__ = [
    "COMPLETE_POLICIES",
    "COMPLETE_SCENARIOS",
    "COMPLETE_SIMULATED_POLICIES",
    "PERCEPTIONS",
    "POPULATIONS",
    "REFERENCE_PLANNER",
    "SENSOR_SETS",
    "allow_simulator_networks",
    "as_json",
    "camera",
    "faults",
    "networks",
    "out_file",
    "out_folder",
    "overwrite",
    "perception",
    "planner",
    "plot_file",
    "policies",
    "policy",
    "population",
    "resume",
    "robot",
    "running",
    "scenarios",
    "seed",
    "sensors",
    "workers",
]

#: The command line's name of the reference planner.
REFERENCE_PLANNER: Final = "reference"
#: The kinds of perception that the robot of a crossing can have.
PERCEPTIONS: Final = ("truth", "keypoints", "pixels")
#: The habits that the people of a crossing can have.
POPULATIONS: Final = ("classic", "recorded")
#: The sensors that the robot of a crossing can have.
SENSOR_SETS: Final = ("camera", "camera+scanner", "scanner")


def _shipped(
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


#: Completion of scenarios, for ``shell_complete`` of an option or argument.
COMPLETE_SCENARIOS: Final = _shipped(
    "sim_tests",
    "scenario/shipped",
    "all",
    "guidelines",
    "step_out",
    sets=["guidelines", "step_out"],
)
_COMPLETE_CAMERAS: Final = _shipped("sim_tests", "scenario/shipped/cameras")
_COMPLETE_ROBOTS: Final = _shipped("sim_tests", "actors/robot/shipped", "nova_carter")
#: Completion of policies.
COMPLETE_POLICIES: Final = _shipped("nav_adapter", "policies")
#: Completion of the policies of crossings, which have today's AMR besides.
COMPLETE_SIMULATED_POLICIES: Final = _shipped("nav_adapter", "policies", "scanner")
_COMPLETE_POLICIES_AND_ORACLE: Final = _shipped("nav_adapter", "policies", "scanner", "oracle")
_COMPLETE_FAULTS: Final = _shipped("sim_tests", "crossing/faults", "none")


def seed(note: str = "", *, default: int | None = 0) -> Decorator:
    """Add ``--seed``: the seed of all random numbers."""
    text = f"Seed of the random numbers.{note}"
    return option("--seed", type=Whole(0), default=default, metavar="N", help=text)


def out_folder(
    default: str | None, help: str = "Folder of the results.", *, show_default: str | None = None
) -> Decorator:
    """Add ``--out``: a folder."""
    return option(
        "--out",
        type=FolderPath(),
        default=default,
        show_default=show_default,
        metavar="DIR",
        help=help,
    )


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
    """Add ``--out``: the file of a plot; None for ``none``.

    Without matplotlib the default is none, with a remark; a file that is asked for is an error.
    """

    def file_or_none(context: click.Context, parameter: click.Parameter, out: Path) -> Path | None:
        if str(out) == "none":
            return None
        chosen = context.get_parameter_source(str(parameter.name)) is not ParameterSource.DEFAULT
        if chosen or context.resilient_parsing or _is_installed("matplotlib"):
            return out
        # This import loads the networks, which help does not need.
        from perception.installation import install_command  # noqa: PLC0415

        print(
            f"{context.command_path}: no plot, since matplotlib is not installed: "
            f"{install_command('plot')}",
            file=sys.stderr,
        )
        return None

    return option(
        "--out",
        type=FilePath(),
        default=default,
        metavar="FILE.png|svg|pdf|none",
        callback=file_or_none,
        help=f"{help} Needs matplotlib.",
    )


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ValueError:  # the module is blocked
        return False


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


def perception(
    kinds: Sequence[str] = PERCEPTIONS, note: str = "", *, default: str = "keypoints"
) -> Decorator:
    """Add ``--perception``: the kind of perception that the robot has."""
    return option(
        "--perception",
        type=OneOf(kinds),
        default=default,
        help=f"How the robot perceives people.{note}",
    )


def sensors(*, many: bool = False) -> Decorator:
    """Add ``--sensors``: a set of sensors, or several to compare."""
    several = " Several sets are compared." if many else ""
    return option(
        "--sensors",
        many=many,
        type=OneOf(SENSOR_SETS),
        default=["camera"] if many else "camera",
        help="Sensors of the robot: its camera, its laser scanners, or both. With scanners, "
        f"--perception is keypoints or pixels.{several}",
    )


def camera() -> Decorator:
    """Add ``--camera``: another camera on the robot of a crossing."""
    return option(
        "--camera",
        default="",
        show_default="each scenario's own",
        metavar="NAME|FILE",
        shell_complete=_COMPLETE_CAMERAS,
        help="Another camera on the robot: 'forward' (120 degrees, as in the shipped scenarios), "
        "'surround' (360 degrees), or a YAML file.",
    )


def robot() -> Decorator:
    """Add ``--robot``: another robot, to which the scenarios are fitted."""
    return option(
        "--robot",
        default="",
        show_default="nova_carter",
        metavar="NAME|FILE",
        shell_complete=_COMPLETE_ROBOTS,
        help="Another robot: 'forklift' (it steers), 'omni' (it moves sideways), 'delivery' "
        "(small), or a YAML file. Room and time of the scenarios are fitted to it.",
    )


def population() -> Decorator:
    """Add ``--population``: the habits of the people in a crossing."""
    return option(
        "--population",
        type=WordAndNumbers(POPULATIONS),
        show_default="each scenario's own",
        metavar="NAME|KEY=VALUE,...",
        help="Habits of the people: 'classic', or 'recorded' as fitted to recorded people; and how "
        "they hear a request for attention: 'answers=0.3', or 'recorded,answers=0.8,startles=0.2'.",
    )


def policy(*, simulated: bool = False) -> Decorator:
    """Add ``--policy``: one policy; in the simulator it may be today's AMR."""
    return option(
        "--policy",
        default="balanced",
        metavar="NAME|FILE",
        shell_complete=COMPLETE_SIMULATED_POLICIES if simulated else COMPLETE_POLICIES,
        help="Policy: a preset, or a YAML file.",
    )


def policies(default: Sequence[str], *, repeated: bool = False) -> Decorator:
    """Add ``--policy``: one or more policies to compare.

    Args:
        default: names.
        repeated: each policy needs the option before it, as beside positional arguments.
    """
    return option(
        "--policy",
        **_several(repeated),
        default=list(default),
        shell_complete=_COMPLETE_POLICIES_AND_ORACLE,
        help="Policies: presets, 'scanner' (today's AMR), YAML files, or 'oracle' (balanced with "
        "true awareness)." + _again(repeated),
    )


def scenarios(
    which: str, *, repeated: bool = False, default: Sequence[str] = ("all",)
) -> Decorator:
    """Add ``--scenario``: shipped scenarios and files.

    Args:
        which: the shipped ones that the name of a set stands for.
        repeated: each scenario needs the option before it, as beside positional arguments.
        default: names.
    """
    return option(
        "--scenario",
        **_several(repeated),
        default=list(default),
        shell_complete=COMPLETE_SCENARIOS,
        help=f"Scenarios: shipped ones, YAML files, or a set of shipped ones {which}: 'all', "
        f"'guidelines' or 'step_out'.{_again(repeated)}",
    )


def _several(repeated: bool) -> dict[str, Any]:
    """Return the settings of an option of several values, with or without its name before each."""
    if repeated:
        return {"multiple": True, "metavar": "NAME|FILE"}
    return {"many": True, "metavar": "NAME|FILE..."}


def _again(repeated: bool) -> str:
    return " May be given more than once." if repeated else ""


def faults() -> Decorator:
    """Add ``--fault``: faults of camera, scanners, odometry and detections."""
    return option(
        "--fault",
        many=True,
        default=["none"],
        metavar="NAME|FILE...",
        shell_complete=_COMPLETE_FAULTS,
        help="Faults: shipped ones, YAML files, several joined by '+', or 'none'; every "
        "combination runs with each. 'scanner_*' stands for all shipped ones that fit.",
    )


def planner(*, many: bool = False) -> Decorator:
    """Add ``--planner``: a local planner, or several to compare; '' is the reference planner."""
    return option(
        "--planner",
        many=many,
        metavar="MODULE:CLASS..." if many else "MODULE:CLASS",
        default=[REFERENCE_PLANNER] if many else REFERENCE_PLANNER,
        callback=_without_reference,
        help="Local planner: 'reference', 'costmap' (that of today's AMR), 'straight_on', or a "
        "class of yours, which gets the robot's profile, and static_boxes_odom_m if it takes that.",
    )


def _without_reference(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Return the value with '' for 'reference', the simulator's name of its own planner."""
    if isinstance(value, tuple):
        return tuple("" if each == REFERENCE_PLANNER else each for each in value)
    return "" if value == REFERENCE_PLANNER else value


def as_json(what: str = "the table") -> Decorator:
    """Add ``--json``: print the result as JSON."""
    return option("--json", "as_json", is_flag=True, help=f"Print {what} as JSON.")


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
