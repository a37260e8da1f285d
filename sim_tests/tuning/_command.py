"""The command ``awarenav tune``."""

from __future__ import annotations

import argparse
from pathlib import Path

from .._arguments import add_camera, count


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``tune`` to the commands."""
    tune = commands.add_parser(
        "tune",
        help="search policies that lose less time and keep the separation margin",
        description="Search the numbers of a policy for the least mean time lost and the least "
        "mean time with a negative separation margin, without contacts caused by the robot. Writes "
        "study.db, trials.csv, pareto.png, importances.json, chosen.json and chosen/*.yaml with "
        "their figures on held-out seeds.",
        epilog="Killed or interrupted, the same command with --resume ends with the same study; "
        "given in several terminals at once, they share the trials. Exit status: 0 well, 2 bad "
        "input. Needs the extra 'bench'.",
    )
    tune.add_argument(
        "--policy",
        default="balanced",
        metavar="NAME|FILE",
        help="preset or YAML file to start from (default: balanced)",
    )
    tune.add_argument(
        "--scenario",
        nargs="+",
        default=["all"],
        metavar="NAME",
        help="shipped scenarios, YAML files, or 'all' that have a planner (default)",
    )
    tune.add_argument(
        "--ranges",
        metavar="FILE",
        help="YAML of the parameters to search and their ranges (default: the shipped ranges)",
    )
    for option, default, what in (
        ("--trials", 60, "policies to try"),
        ("--episodes", 5, "tuning seeds, each run in every scenario"),
        ("--held-out", 10, "held-out seeds for presets and chosen policies"),
        ("--generation", 6, "trials proposed together: so many processes can share the work"),
        ("--workers", 1, "processes that run episodes"),
    ):
        tune.add_argument(
            option,
            type=count,
            default=default,
            metavar="N",
            help=f"{what} (default: {default})",
        )
    tune.add_argument(
        "--sampler",
        choices=["tpe", "nsga2"],
        default="tpe",
        help="tpe for up to some hundred trials, nsga2 for more, with a --generation of 20 or so "
        "(default: tpe)",
    )
    tune.add_argument(
        "--perception",
        choices=["truth", "keypoints", "pixels"],
        default="keypoints",
        help="what the robot sees with (default: keypoints)",
    )
    add_camera(tune)
    tune.add_argument(
        "--planner", default="", metavar="MODULE:CLASS", help="default: the reference planner"
    )
    tune.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of everything random (default: 0)"
    )
    tune.add_argument(
        "--out", type=Path, default=Path("tune"), metavar="DIR", help="results (default: tune)"
    )
    tune.add_argument("--resume", action="store_true", help="go on with what is in --out")
    tune.set_defaults(run=_tune)


def _tune(options: argparse.Namespace) -> int:
    from ._tune_command import tune_command  # noqa: PLC0415 - help needs no simulator

    return tune_command(options)
