"""Options that several commands take: each named, typed and explained once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import click
from click.shell_completion import CompletionItem

from ._command import Decorator, option
from ._types import POSITIVE, FilePath, FolderPath, OneOf, Whole

#: What the command line calls the reference planner.
REFERENCE_PLANNER: Final = "reference"
#: What the robot of a crossing can see with.
PERCEPTIONS: Final = ("truth", "keypoints", "pixels")


def _shipped(package: str, folder: str, *others: str) -> Callable[..., list[CompletionItem]]:
    """Completion of the names of a package's YAML files; the package is not imported."""

    def complete(
        context: click.Context, parameter: click.Parameter, text: str
    ) -> list[CompletionItem]:
        spec = find_spec(package)
        places = [] if spec is None else list(spec.submodule_search_locations or ())
        names = {path.stem for place in places for path in Path(place, folder).glob("*.yaml")}
        return [CompletionItem(name) for name in sorted(names | set(others)) if text in name]

    return complete


_SCENARIOS: Final = _shipped("sim_tests", "scenario/shipped", "all")
_POLICIES: Final = _shipped("nav_adapter", "policies")
_POLICIES_AND_ORACLE: Final = _shipped("nav_adapter", "policies", "oracle")
_FAULTS: Final = _shipped("sim_tests", "crossing/faults", "none")


def seed(what: str = "everything random") -> Decorator:
    """``--seed``: the whole number that all chance is drawn from."""
    return option("--seed", type=Whole(0), default=0, metavar="N", help=f"Seed of {what}.")


def out_folder(default: str) -> Decorator:
    """``--out``: the folder of the results."""
    return option(
        "--out", type=FolderPath(), default=default, metavar="DIR", help="Folder of the results."
    )


def out_file(default: str | None, help: str, metavar: str = "FILE") -> Decorator:
    """``--out``: the file of the results."""
    return option("--out", type=FilePath(), default=default, metavar=metavar, help=help)


def resume() -> Decorator:
    """``--resume``: continue what is in ``--out``."""
    return option("--resume", is_flag=True, help="Continue the interrupted work in --out.")


def workers(default: int | None = None) -> Decorator:
    """``--workers``: worker processes."""
    text = "Worker processes." if default else "Worker processes (default: one for each core)."
    return option("--workers", type=POSITIVE, default=default, metavar="N", help=text)


def perception(kinds: Sequence[str] = PERCEPTIONS, note: str = "") -> Decorator:
    """``--perception``: what the robot sees with."""
    return option(
        "--perception",
        type=OneOf(kinds),
        default="keypoints",
        help=f"What the robot perceives people with.{note}",
    )


def camera() -> Decorator:
    """``--camera``: another camera on the robot of a crossing."""
    return option(
        "--camera",
        default="",
        metavar="NAME|FILE",
        shell_complete=_shipped("sim_tests", "scenario/shipped/cameras"),
        help="Another camera on the robot: 'forward' (120 degrees, as in the shipped scenarios), "
        "'surround' (360 degrees), or a YAML file (default: each scenario's own).",
    )


def policy(default: str = "balanced") -> Decorator:
    """``--policy``: a preset or a policy file."""
    return option(
        "--policy",
        default=default,
        metavar="NAME|FILE",
        shell_complete=_POLICIES,
        help="Preset, or policy YAML file.",
    )


def policies(default: Sequence[str]) -> Decorator:
    """``--policy``: one or more policies to compare."""
    return option(
        "--policy",
        many=True,
        default=list(default),
        metavar="NAME|FILE...",
        shell_complete=_POLICIES_AND_ORACLE,
        help="Presets, policy YAML files, or 'oracle': balanced with true awareness.",
    )


def scenarios(which: str) -> Decorator:
    """``--scenario``: shipped scenarios and files."""
    return option(
        "--scenario",
        many=True,
        default=["all"],
        metavar="NAME|FILE...",
        shell_complete=_SCENARIOS,
        help=f"Shipped scenarios, YAML files, or 'all' {which}.",
    )


def faults() -> Decorator:
    """``--fault``: faults of camera, odometry and detections."""
    return option(
        "--fault",
        many=True,
        default=["none"],
        metavar="NAME|FILE...",
        shell_complete=_FAULTS,
        help="Shipped faults, YAML files, or 'none'; each is a run of its own.",
    )


_PLANNER_HELP: Final = (
    "made with the robot's profile, and with static_boxes_odom_m if it takes that; 'reference' for "
    "the reference planner."
)


def _without_reference(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """The value with '' for 'reference', as the simulator calls its own planner."""
    if isinstance(value, tuple):
        return tuple("" if each == REFERENCE_PLANNER else each for each in value)
    return "" if value == REFERENCE_PLANNER else value


def planner() -> Decorator:
    """``--planner``: a local planner of the user's own; empty for the reference planner."""
    return option(
        "--planner",
        default=REFERENCE_PLANNER,
        callback=_without_reference,
        metavar="MODULE:CLASS",
        help=f"Your own planner, {_PLANNER_HELP}",
    )


def planners() -> Decorator:
    """``--planner``: one or more local planners to compare; empty for the reference planner."""
    return option(
        "--planner",
        many=True,
        default=[REFERENCE_PLANNER],
        callback=_without_reference,
        metavar="MODULE:CLASS...",
        help=f"Your own planners, each {_PLANNER_HELP}",
    )


def as_json(what: str = "the table") -> Decorator:
    """``--json``: the table as JSON on standard output."""
    return option("--json", "as_json", is_flag=True, help=f"Print {what} as JSON.")
