"""The command ``awarenav falsify``."""

from __future__ import annotations

import argparse
from pathlib import Path

from .._arguments import add_camera, count


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``falsify`` to the commands."""
    falsify = commands.add_parser(
        "falsify",
        help="search the people who come nearest to harm",
        description="Search start, way, speed, pauses, gaze and reactions of a scenario's people, "
        "within human limits, for the smallest separation margin at a moving robot. Writes "
        "worst_001.yaml and so on, which `awarenav crossings --scenario` plays again, "
        "episodes.csv, falsify.png, summary.json and the studies.",
        epilog="Killed or interrupted, the same command with --resume ends with the same result, "
        "with any number of --workers. Exit status: 0 no contact that the robot caused, 1 some, "
        "2 bad input. Needs the extra 'bench'.",
    )
    falsify.add_argument(
        "--policy", default="balanced", metavar="NAME|FILE", help="preset or YAML file"
    )
    falsify.add_argument(
        "--scenario",
        nargs="+",
        default=["all"],
        metavar="NAME",
        help="shipped scenarios, YAML files, or 'all' that have a planner and people (default)",
    )
    for option, default, what in (
        (
            "--episodes",
            2000,
            "at least: half to all scenarios alike, the rest to the worst third",
        ),
        ("--generation", 12, "episodes a generation of the search"),
        ("--people", 2, "how many people of a scenario are varied"),
        ("--worst", 10, "cases to write"),
        ("--workers", 1, "processes that run episodes"),
    ):
        falsify.add_argument(
            option,
            type=count,
            default=default,
            metavar="N",
            help=f"{what} (default: {default})",
        )
    falsify.add_argument(
        "--perception",
        choices=["truth", "keypoints", "pixels"],
        default="keypoints",
        help="what the robot sees with (default: keypoints)",
    )
    add_camera(falsify)
    driver = falsify.add_mutually_exclusive_group()
    driver.add_argument(
        "--planner", default="", metavar="MODULE:CLASS", help="default: the reference planner"
    )
    driver.add_argument(
        "--unsafe-no-floor",
        action="store_true",
        help="UNSAFE, in the simulation only: take the adapter's radii and speed limits away from "
        "the reference planner, to see that the search finds what that does",
    )
    falsify.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of search and episodes (default: 0)"
    )
    falsify.add_argument(
        "--out", type=Path, default=Path("falsify"), metavar="DIR", help="(default: falsify)"
    )
    falsify.add_argument("--resume", action="store_true", help="go on with what is in --out")
    falsify.set_defaults(run=_falsify)


def _falsify(options: argparse.Namespace) -> int:
    from ._falsify_command import falsify_command  # noqa: PLC0415 - help needs no simulator

    return falsify_command(options)
